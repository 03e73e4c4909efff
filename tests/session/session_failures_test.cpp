// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// run_calibration_session(): steps that fail, and sessions and options that it rejects.
#include <fmt/core.h>
#include <gmock/gmock.h>

#include "captures/truth_table.h"
#include "rendered_session.h"
#include "rig/input_error.h"
#include "session/session.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using RunCalibrationSession = RenderedSession;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::StartsWith;
using testing::ThrowsMessage;

constexpr const char* kGates = "format: vlp-gates/1\ngates:\n";

/// Expects that the last step of a run failed, for this reason.
void expect_failure(const SessionResult& result, const std::string& step, StepFailure failure,
                    const testing::Matcher<std::string>& message) {
  EXPECT_EQ(result.verdict, Verdict::invalid);
  EXPECT_EQ(result.failure, failure) << step_failure_name(result.failure);
  ASSERT_FALSE(result.steps.empty());
  const SessionStep& last = result.steps.back();
  EXPECT_EQ(last.name, step);
  EXPECT_EQ(last.result.failure, failure);
  EXPECT_THAT(last.result.message, message);
  EXPECT_EQ(result.reason, step + ": " + last.result.message);
}

TEST_F(RunCalibrationSession, FailsStepLensIfCameraCannotBeRead) {
  run();
  write_session_file("camera.yaml", "format: vlp-calibration/1\ncamera: 7\n");
  const SessionResult result = run();
  expect_failure(result, "lens", StepFailure::bad_input, StartsWith("camera.yaml:2"));
  EXPECT_THAT(list_steps(result), ElementsAre("lens"));
  EXPECT_FALSE(result.calibration);
  for (const char* name : {"rotated.yaml", "calibration.yaml", "check-fixes.csv", "evaluation.json",
                           "steps/rotation.json"}) {
    EXPECT_FALSE(has_result(name)) << name;
  }
  EXPECT_THAT(read_result("session.json"), HasSubstr("\"verdict\": \"no result\""));
  EXPECT_THAT(read_result("junit.xml"), HasSubstr("<error type=\"bad_input\""));
  EXPECT_THAT(list_executed_steps(run()), ElementsAre("lens")) << "a bad input is read again";
}

TEST_F(RunCalibrationSession, FailsStepLensForAnotherBoard) {
  add_boards_in_place_of_camera();
  edit_session_file("board.yaml", "tag36h11", "tag25h9");
  const SessionResult result = run();
  expect_failure(
      result, "lens", StepFailure::wrong_board,
      StartsWith("board.yaml: boards/0000.png: the image shows tags of family tag36h11"));
  EXPECT_THAT(list_steps(result), ElementsAre("lens"));
  EXPECT_FALSE(has_result("lens.yaml"));
}

TEST_F(RunCalibrationSession, FailsStepLensWithoutBoardsInImages) {
  add_boards_in_place_of_camera();
  fs::remove_all(session_file("boards"));
  fs::copy(session_file("check"), session_file("boards"));
  expect_failure(run(), "lens", StepFailure::undetermined, Not(IsEmpty()));
  const SessionResult again = run();
  EXPECT_THAT(list_executed_steps(again), IsEmpty()) << "the images have not changed";
  expect_failure(again, "lens", StepFailure::undetermined, Not(IsEmpty()));
}

TEST_F(RunCalibrationSession, FailsStepRowTimeWithoutFrequenciesInMap) {
  write_camera(std::nullopt);
  run();
  std::string lamps = TemporaryFolder::read_content(session_file("lamps.yaml"));
  for (auto at = lamps.find(", frequency_hz"); at != std::string::npos;
       at = lamps.find(", frequency_hz")) {
    lamps.erase(at, lamps.find(", duty", at) - at);
  }
  write_session_file("lamps.yaml", lamps);
  const SessionResult result = run();
  expect_failure(result, "row-time", StepFailure::bad_input, StartsWith("lamps.yaml: "));
  EXPECT_FALSE(has_result("camera.yaml"));
  EXPECT_FALSE(has_result("rotated.yaml"));
  ASSERT_TRUE(result.calibration) << "camera of the step before";
  EXPECT_FALSE(result.calibration->rotation_center);
}

TEST_F(RunCalibrationSession, FailsStepRotationForTooFewCaptures) {
  run();
  keep_captures("rotation", 2);
  const SessionResult result = run();
  expect_failure(result, "rotation", StepFailure::undetermined, Not(IsEmpty()));
  EXPECT_THAT(list_steps(result), ElementsAre("lens", "rotation"));
  ASSERT_TRUE(result.calibration);
  EXPECT_EQ(result.calibration->camera.id, "unit-7");
  EXPECT_FALSE(result.calibration->rotation_center);
  for (const char* name : {"rotated.yaml", "calibration.yaml", "check-fixes.csv", "evaluation.json",
                           "steps/dispersion.json", "steps/check.json"}) {
    EXPECT_FALSE(has_result(name)) << name;
  }
  EXPECT_TRUE(has_result("steps/rotation.json"));
  EXPECT_THAT(list_executed_steps(run()), IsEmpty()) << "the captures have not changed";
}

TEST_F(RunCalibrationSession, FailsStepRotationWithoutImages) {
  fs::remove_all(session_file("rotation"));
  fs::create_directory(session_file("rotation"));
  expect_failure(run(), "rotation", StepFailure::bad_input, StartsWith("rotation: "));
}

TEST_F(RunCalibrationSession, FailsStepIfNoImageOfItsFolderShowsLamps) {
  add_boards_in_place_of_camera();
  write_camera();
  for (const std::string step : {"dispersion", "rotation"}) {
    for (const auto& entry : fs::directory_iterator(session_file(step))) {
      if (entry.path().extension() == ".png") fs::remove(entry.path());
    }
    for (const char* image : {"0000.png", "0001.png", "0002.png"}) {
      fs::copy(session_file(std::string("boards/") + image), session_file(step + "/" + image));
    }
    const SessionResult result = run();
    expect_failure(result, step, StepFailure::undetermined, Not(IsEmpty()));
    EXPECT_EQ(find_step(result, step).result.skipped.size(), 3U) << step;
  }
}

TEST_F(RunCalibrationSession, FailsStepDispersionForSingleCapture) {
  run();
  const std::string rotated = read_result("rotated.yaml");
  keep_captures("dispersion", 1);
  const SessionResult result = run();
  expect_failure(result, "dispersion", StepFailure::undetermined, Not(IsEmpty()));
  EXPECT_EQ(read_result("rotated.yaml"), rotated);
  EXPECT_FALSE(has_result("calibration.yaml"));
  EXPECT_FALSE(has_result("check-fixes.csv"));
  ASSERT_TRUE(result.calibration);
  EXPECT_TRUE(result.calibration->rotation_center);
  EXPECT_FALSE(result.calibration->dispersion);
}

TEST_F(RunCalibrationSession, FailsStepDispersionWithoutPositions) {
  fs::remove(session_file("dispersion/truth.csv"));
  fs::remove(session_file("dispersion/captures.csv"));
  expect_failure(run(), "dispersion", StepFailure::bad_input,
                 StartsWith("dispersion: its captures have no positions; add x_m and y_m"));
}

TEST_F(RunCalibrationSession, FailsStepCheckWithoutImagesAndKeepsCalibration) {
  run();
  const std::string calibration = read_result("calibration.yaml");
  fs::remove_all(session_file("check"));
  fs::create_directory(session_file("check"));
  const SessionResult result = run();
  expect_failure(result, "check", StepFailure::bad_input, StartsWith("check: "));
  EXPECT_EQ(read_result("calibration.yaml"), calibration);
  EXPECT_FALSE(has_result("check-fixes.csv"));
  EXPECT_FALSE(has_result("evaluation.json"));
  ASSERT_TRUE(result.calibration);
  EXPECT_TRUE(result.calibration->dispersion);
}

TEST_F(RunCalibrationSession, FailsStepEvaluateIfCaptureHasNoTruePosition) {
  edit_session_file("check/truth.csv", "0002.png", "other.png");
  expect_failure(run(), "evaluate", StepFailure::bad_input,
                 AllOf(HasSubstr("0002.png"), Not(HasSubstr((folder / "").string()))));
  EXPECT_TRUE(has_result("check-fixes.csv"));
  EXPECT_FALSE(has_result("evaluation.json"));
}

TEST_F(RunCalibrationSession, FailsStepEvaluateIfTruthIsInMillimeters) {
  std::string truth_in_mm = "image,x_m,y_m\n";
  for (const TruthRow& row : read_truth_table(session_file("check/truth.csv")))
    truth_in_mm += fmt::format("{},{},{}\n", row.image, 1e3 * row.xy_m.x(), 1e3 * row.xy_m.y());
  write_session_file("check/truth.csv", truth_in_mm);
  expect_failure(run(), "evaluate", StepFailure::bad_input,
                 StartsWith("check/truth.csv:2: x_m: the values agree with the fixes if they are "
                            "in mm; convert them to m"));
}

TEST_F(RunCalibrationSession, FailsStepEvaluateIfDriveHasNoDirection) {
  options.report = true;
  run();
  const auto places = TemporaryFolder::read_content(session_file("line-x/truth.csv"));
  write_session_file("line-x/truth.csv", "image,x_m,y_m\n0000.png,0,0\n0003.png,0,0\n");
  expect_failure(run(), "evaluate", StepFailure::bad_input,
                 StartsWith("line-x/truth.csv: start and end of the drive are equal"));
  EXPECT_TRUE(has_result("calibration.yaml"));
  EXPECT_TRUE(has_result("line-x-fixes.csv"));
  EXPECT_FALSE(has_result("report.html"));
  write_session_file("line-x/truth.csv", places);
  for (const char* image : {"0001.png", "0002.png", "0003.png"}) {
    fs::remove(session_file(std::string("line-x/") + image));
    fs::copy(session_file("line-x/0000.png"), session_file(std::string("line-x/") + image));
  }
  expect_failure(run(), "evaluate", StepFailure::bad_input,
                 StartsWith("line-x-fixes.csv: no line can be fitted to its fixes"));
}

TEST_F(RunCalibrationSession, FailsStepOfDriveWhoseTableCannotBeRead) {
  options.report = true;
  fs::remove(session_file("line-x/truth.csv"));
  write_session_file("line-x/captures.csv", "image,x_m,y_m\n0000.png,1");
  const SessionResult result = run();
  expect_failure(result, "line-x", StepFailure::bad_input, StartsWith("line-x/captures.csv:2"));
  EXPECT_TRUE(has_result("calibration.yaml"));
  EXPECT_TRUE(has_result("check-fixes.csv"));
  EXPECT_FALSE(has_result("evaluation.json"));
}

TEST_F(RunCalibrationSession, ReportsContradictedRowTimeAndItsSource) {
  write_camera(3.3e-5);
  expect_failure(run(), "rotation", StepFailure::bad_input,
                 HasSubstr("row time is 33 us in camera.yaml, but the stripes of"));
  write_camera(3.1e-5);
  const SessionResult result = run();
  EXPECT_EQ(result.verdict, Verdict::fail);
  EXPECT_THAT(result.reason, StartsWith("row_time_error_percent is 2."));
  for (const char* step : {"rotation", "dispersion"}) {
    EXPECT_THAT(find_step(result, step).result.warnings,
                testing::Contains(HasSubstr("row time is 31 us in camera.yaml")))
        << step;
  }
}

TEST_F(RunCalibrationSession, NamesReadoutThatContradictsImages) {
  edit_session_file("camera.yaml", "readout: rows", "readout: columns");
  expect_failure(run(), "rotation", StepFailure::bad_input,
                 HasSubstr("the readout is along columns in camera.yaml, but the images show "
                           "stripes along rows; correct it"));
}

TEST_F(RunCalibrationSession, MessagesDoNotContainPathOfSession) {
  write_session_file("rotation/0002.png", "no image");
  write_session_file("dispersion/0009.png", "no image");
  options.report = true;
  const SessionResult result = run();
  for (const SessionStep& step : result.steps) {
    for (const std::string& warning : step.result.warnings) {
      EXPECT_THAT(warning, Not(HasSubstr(session_folder.string()))) << step.name;
    }
    for (const auto& [image, reason] : step.result.skipped) {
      EXPECT_THAT(reason, Not(HasSubstr(session_folder.string()))) << step.name;
    }
  }
  ASSERT_EQ(find_step(result, "rotation").result.skipped.size(), 1U);
  EXPECT_EQ(find_step(result, "rotation").result.skipped[0].image, "0002.png");
  ASSERT_EQ(find_step(result, "dispersion").result.skipped.size(), 1U);
  EXPECT_THAT(find_step(result, "dispersion").result.skipped[0].reason,
              HasSubstr("cannot be read as an image"));
  EXPECT_THAT(read_result("session.json"), Not(HasSubstr(session_folder.string())));
}

TEST_F(RunCalibrationSession, RemovesPathOfSessionOnlyAtBeginningOfFileName) {
  fs::remove(session_file("dispersion/truth.csv"));
  const std::string path = session_file("a.png").string();
  write_session_file("dispersion/captures.csv", "image,x_m,y_m\n0000.png," + path + ",1\n");
  EXPECT_THAT(run().reason, testing::EndsWith("should be a finite number, not 'a.png'"));
  write_session_file("dispersion/captures.csv", "image,x_m,y_m\n0000.png,x" + path + ",1\n");
  EXPECT_THAT(run().reason, testing::EndsWith("should be a finite number, not 'x" + path + "'"));
}

TEST_F(RunCalibrationSession, FailsStepCheckIfItIsAFile) {
  fs::remove_all(session_file("check"));
  write_session_file("check", "a file");
  expect_failure(run(), "check", StepFailure::bad_input,
                 testing::Eq("check: is not a folder of images"));
}

TEST_F(RunCalibrationSession, IncompleteSessionHasNoResultAndNoOutputs) {
  run();
  fs::remove(session_file("lamps.yaml"));
  const SessionResult result = run();
  EXPECT_EQ(result.verdict, Verdict::invalid);
  EXPECT_EQ(result.failure, StepFailure::bad_input);
  EXPECT_EQ(result.reason, "lamps.yaml: is missing");
  EXPECT_THAT(result.steps, IsEmpty());
  EXPECT_FALSE(result.calibration);
  for (const char* name : {"rotated.yaml", "calibration.yaml", "check-fixes.csv", "evaluation.json",
                           "steps/lens.json"}) {
    EXPECT_FALSE(has_result(name)) << name;
  }
  EXPECT_THAT(read_result("session.json"), HasSubstr("\"reason\": \"lamps.yaml: is missing\""));
  EXPECT_THAT(read_result("junit.xml"), HasSubstr("lamps.yaml: is missing"));
}

TEST_F(RunCalibrationSession, InvalidGatesOfSessionRemoveOnlyEvaluation) {
  run();
  write_session_file("gates.yaml", std::string(kGates) + "  odd_mm: 1\n");
  const SessionResult result = run();
  EXPECT_EQ(result.verdict, Verdict::invalid);
  EXPECT_EQ(result.failure, StepFailure::bad_input);
  EXPECT_THAT(result.reason, StartsWith("gates.yaml:3: "));
  EXPECT_TRUE(has_result("calibration.yaml"));
  EXPECT_TRUE(has_result("check-fixes.csv"));
  EXPECT_FALSE(has_result("evaluation.json"));
  EXPECT_THAT(read_result("session.json"), HasSubstr("odd_mm"));
  fs::remove(session_file("gates.yaml"));
  EXPECT_THAT(list_executed_steps(run()), ElementsAre("evaluate"));
}

TEST_F(RunCalibrationSession, RejectsInvalidGatesFileOfOptionsBeforeFirstStep) {
  options.gates_file = folder.file("gates.yaml", std::string(kGates) + "  odd_mm: 1\n");
  EXPECT_THAT([&] { run(); }, ThrowsMessage<InputError>(HasSubstr("gates.yaml:3: ")));
  EXPECT_FALSE(fs::exists(results_folder));
  write_session_file("gates.yaml", std::string(kGates) + "  mean_mm: 1\n");
  EXPECT_THAT([&] { run(); }, ThrowsMessage<InputError>(HasSubstr("gates.yaml:3: ")))
      << "even if the session has gates of its own";
}

TEST_F(RunCalibrationSession, RejectsMissingSessionFolder) {
  EXPECT_THAT([&] { run_calibration_session(folder / "none", results_folder, options); },
              ThrowsMessage<InputError>(HasSubstr("none: is not a folder of captures")));
  EXPECT_FALSE(fs::exists(results_folder));
}

TEST_F(RunCalibrationSession, RejectsFolderWithCapturesAsResultsFolder) {
  for (const fs::path& results : {session_folder, session_file("check")}) {
    EXPECT_THAT([&] { run_calibration_session(session_folder, results, options); },
                ThrowsMessage<InputError>(
                    HasSubstr("contains captures: choose another folder for the results")));
    EXPECT_FALSE(fs::exists(results / "steps"));
  }
}

TEST_F(RunCalibrationSession, RejectsResultsOfAnotherSession) {
  fs::copy(session_folder, folder / "other", fs::copy_options::recursive);
  run();
  EXPECT_THAT([&] { run_calibration_session(folder / "other", results_folder, options); },
              ThrowsMessage<InputError>(HasSubstr("contains the results of another session")));
}

}  // namespace
}  // namespace vlp
