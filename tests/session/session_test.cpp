// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// run_session(): steps, their outputs and their reuse.
#include "session/session.h"

#include <gmock/gmock.h>

#include <set>
#include <stdexcept>

#include "rendered_session.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using RunSession = RenderedSession;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

/// Returns the names of the files in a folder, without those in its subfolders.
std::set<std::string> list_files(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.is_regular_file()) names.insert(entry.path().filename().string());
  }
  return names;
}

TEST_F(RunSession, RunsStepsInOrderAndWritesOutputsForGivenCamera) {
  const SessionResult result = run();
  EXPECT_EQ(result.verdict, Verdict::pass);
  EXPECT_EQ(result.failure, StepFailure::none);
  EXPECT_EQ(result.reason, "");
  EXPECT_THAT(list_steps(result),
              ElementsAre("lens", "rotation", "dispersion", "check", "evaluate"));
  EXPECT_EQ(list_executed_steps(result), list_steps(result));
  EXPECT_EQ(list_files(results_folder),
            (std::set<std::string>{"calibration.yaml", "check-fixes.csv", "evaluation.json",
                                   "junit.xml", "rotated.yaml", "session.json"}));
}

TEST_F(RunSession, EstimatesTiltLeverArmAndDispersionOfRenderedCamera) {
  const SessionResult result = run();
  ASSERT_TRUE(result.calibration && result.calibration->rotation_center &&
              result.calibration->dispersion);
  const Calibration& calibration = *result.calibration;
  const RotationCenter& center = *calibration.rotation_center;
  const auto tilt_deg = find_metric_value(find_step(result, "rotation").result.metrics, "tilt_deg");
  ASSERT_TRUE(tilt_deg && center.lever_arm_m);
  EXPECT_NEAR(*tilt_deg, 0.9, 0.02);
  EXPECT_LT((*center.lever_arm_m - Eigen::Vector2d(0.02, -0.01)).norm(), 5e-4);
  EXPECT_EQ(calibration.dispersion->captures, 4);
  EXPECT_EQ(calibration.camera.id, "unit-7");
  const auto written = read_calibration(results_file("calibration.yaml"));
  ASSERT_TRUE(written.dispersion);
  EXPECT_EQ(written.dispersion->offset_px, calibration.dispersion->offset_px);
  EXPECT_FALSE(read_calibration(results_file("rotated.yaml")).dispersion);
}

TEST_F(RunSession, ReportOptionAddsPlotsDrivesAndReportHtml) {
  options.report = true;
  const SessionResult result = run();
  EXPECT_EQ(result.verdict, Verdict::pass) << result.reason;
  EXPECT_THAT(list_steps(result),
              ElementsAre("lens", "rotation", "dispersion", "check", "line-x", "evaluate"));
  EXPECT_EQ(list_files(results_folder),
            (std::set<std::string>{"calibration.yaml", "check-fixes.csv", "dispersion.svg",
                                   "evaluation.json", "junit.xml", "line-x-fixes.csv",
                                   "report.html", "rotated.yaml", "rotation.svg", "session.json"}));
  const std::string page = read_result("report.html");
  for (const char* text :
       {"Accuracy report: unit-7", "<h2>Rotation center", "Traces of the lamps",
        "dispersion circles, before and after", "line-x-fixes.csv: fitted line from the commanded",
        "Floor plan with the lamps", "evaluation: test 1.2, 10 inputs"}) {
    EXPECT_NE(page.find(text), std::string::npos) << text;
  }
  options.report = false;
  EXPECT_THAT(list_steps(run()),
              ElementsAre("lens", "rotation", "dispersion", "check", "evaluate"));
  for (const char* name : {"report.html", "rotation.svg", "dispersion.svg", "line-x-fixes.csv"}) {
    EXPECT_FALSE(has_result(name)) << name;
  }
}

TEST_F(RunSession, LocatesDrivesInOrderOfNames) {
  fs::copy(session_file("line-x"), session_file("line-a"));
  fs::copy(session_file("line-x"), session_file("line-without-positions"));
  fs::remove(session_file("line-without-positions/truth.csv"));
  options.report = true;
  EXPECT_THAT(list_steps(run()), ElementsAre("lens", "rotation", "dispersion", "check", "line-a",
                                             "line-x", "evaluate"));
  EXPECT_EQ(read_result("line-a-fixes.csv"), read_result("line-x-fixes.csv"));
  EXPECT_FALSE(has_result("line-without-positions-fixes.csv"));
}

TEST_F(RunSession, NotifiesObserverOfEachStepAndOfImages) {
  std::vector<std::string> events;
  std::size_t images = 0;
  SessionObserver observer;
  observer.on_step_started = [&](const std::string& step) { events.push_back("start " + step); };
  observer.on_step_finished = [&](const SessionStep& step) {
    EXPECT_TRUE(step.result.has_succeeded());
    events.push_back((step.is_up_to_date ? "reused " : "done ") + step.name);
  };
  observer.progress = [&](std::size_t done, std::size_t total) {
    EXPECT_LE(done, total);
    ++images;
  };
  run_session(session_folder, results_folder, options, observer);
  EXPECT_THAT(events, ElementsAre("start lens", "done lens", "start rotation", "done rotation",
                                  "start dispersion", "done dispersion", "start check",
                                  "done check", "start evaluate", "done evaluate"));
  EXPECT_GE(images, 18U) << "8 of the rotation, 4 of the dispersion, 6 of the check";
  events.clear();
  images = 0;
  fs::remove(results_file("steps/rotation.json"));
  run_session(session_folder, results_folder, options, observer);
  EXPECT_THAT(events, ElementsAre("start lens", "reused lens", "start rotation", "done rotation",
                                  "start dispersion", "reused dispersion", "start check",
                                  "reused check", "start evaluate", "reused evaluate"));
  EXPECT_GE(images, 8U);
}

TEST_F(RunSession, ReusesStepsOnlyIfTheirInputsAreUnchanged) {
  run();
  const std::string session = read_result("session.json"), junit = read_result("junit.xml");
  EXPECT_THAT(list_executed_steps(run()), IsEmpty());
  EXPECT_EQ(read_result("session.json"), session);
  EXPECT_EQ(read_result("junit.xml"), junit);
  const auto expect_executed_steps = [&](const std::string& change,
                                         std::vector<std::string> steps) {
    EXPECT_EQ(list_executed_steps(run()), steps) << change;
    EXPECT_THAT(list_executed_steps(run()), IsEmpty()) << change;
  };
  const std::vector<std::string> lamp_steps{"rotation", "dispersion", "check", "evaluate"};
  const auto append = [&](const std::string& name, const std::string& text) {
    write_session_file(name, TemporaryFolder::read_content(session_file(name)) + text);
  };
  append("lamps.yaml", "# surveyed again\n");
  expect_executed_steps("lamp map", lamp_steps);
  append("camera.yaml", "# calibrated again\n");
  expect_executed_steps("camera", {"lens", "rotation", "dispersion", "check", "evaluate"});
  append("rotation/captures.csv", "0099.png,99\n");
  expect_executed_steps("table of the rotation", {"rotation"});
  append("dispersion/truth.csv", "0099.png,0,0,0,0\n");
  expect_executed_steps("positions of the dispersion", {"dispersion", "check", "evaluate"});
  append("check/truth.csv", "0099.png,0,0,0,0\n");
  expect_executed_steps("positions of the check", {"check", "evaluate"});
  append("check/captures.csv", "0099.png,99\n");
  expect_executed_steps("table of the check", {"check", "evaluate"});
  write_session_file("check/0001.png",
                     TemporaryFolder::read_content(session_file("check/0000.png")));
  expect_executed_steps("image of the check", {"check", "evaluate"});
  write_session_file("rotation/notes.txt", "taken at noon");
  expect_executed_steps("another file", {"rotation"});
  write_session_file("line-x/truth.csv", "image,x_m,y_m\n");
  expect_executed_steps("drive that is not reported", {});
}

TEST_F(RunSession, RunsDriveAndEvaluationAgainIfPositionsOfDriveChange) {
  options.report = true;
  run();
  edit_session_file("line-x/truth.csv", "-0.280000000,-0.010000000", "-0.281000000,-0.010000000");
  EXPECT_THAT(list_executed_steps(run()), ElementsAre("line-x", "evaluate"));
  edit_session_file("line-x/captures.csv", "0001.png,2.0", "0001.png,2.1");
  EXPECT_THAT(list_executed_steps(run()), ElementsAre("line-x", "evaluate"));
}

TEST_F(RunSession, RunsStepsAgainIfProgramOrOptionsChange) {
  run();
  const std::vector<std::string> all{"lens", "rotation", "dispersion", "check", "evaluate"};
  options.program.version = "1.3";
  EXPECT_EQ(list_executed_steps(run()), all) << "another version";
  options.program.program = "other";
  EXPECT_EQ(list_executed_steps(run()), all) << "another program";
  options.frontend.threads = 2;
  EXPECT_THAT(list_executed_steps(run()), IsEmpty()) << "threads do not affect the results";
  options.camera_id = "other";
  EXPECT_THAT(list_executed_steps(run()), ElementsAre("lens")) << "warning about the option";
  options.report = true;
  EXPECT_THAT(list_executed_steps(run()),
              ElementsAre("rotation", "dispersion", "line-x", "evaluate"));
}

TEST_F(RunSession, RunsStepsWithLampsOfSelectedRoom) {
  std::string lamps = TemporaryFolder::read_content(session_file("lamps.yaml"));
  for (auto at = lamps.find("duty: 0.5"); at != std::string::npos;
       at = lamps.find("duty: 0.5", at + 20)) {
    lamps.replace(at, 9, "duty: 0.5, room: hall");
  }
  write_session_file("lamps.yaml", lamps);
  run();
  options.frontend.room = "hall";
  const SessionResult hall = run();
  EXPECT_EQ(hall.verdict, Verdict::pass) << hall.reason;
  EXPECT_EQ(list_executed_steps(hall), list_steps(hall));
  options.frontend.room = "attic";
  const SessionResult attic = run();
  EXPECT_EQ(attic.failure, StepFailure::bad_input);
  EXPECT_THAT(attic.reason, HasSubstr("rotation: lamps.yaml"));
  EXPECT_THAT(attic.reason, HasSubstr("attic"));
}

TEST_F(RunSession, RunsStepAgainIfItsOutputWasChangedOrRemoved) {
  options.report = true;
  run();
  const std::string rotated = read_result("rotated.yaml");
  folder.file("results/rotated.yaml", "changed\n");
  EXPECT_THAT(list_executed_steps(run()), ElementsAre("rotation"));
  EXPECT_EQ(read_result("rotated.yaml"), rotated);
  for (const auto& [output, step] :
       std::vector<std::pair<std::string, std::string>>{{"rotation.svg", "rotation"},
                                                        {"dispersion.svg", "dispersion"},
                                                        {"calibration.yaml", "dispersion"},
                                                        {"check-fixes.csv", "check"},
                                                        {"line-x-fixes.csv", "line-x"},
                                                        {"evaluation.json", "evaluate"},
                                                        {"report.html", "evaluate"}}) {
    fs::remove(results_file(output));
    EXPECT_THAT(list_executed_steps(run()), ElementsAre(step)) << output;
    EXPECT_TRUE(has_result(output)) << output;
  }
}

TEST_F(RunSession, RunsNamedStepsAgainOnRequest) {
  run();
  options.steps_to_redo = {"evaluate", "rotation"};
  EXPECT_THAT(list_executed_steps(run()), ElementsAre("rotation", "evaluate"));
  options.steps_to_redo = {"lens"};
  EXPECT_THAT(list_executed_steps(run()), ElementsAre("lens"));
}

TEST_F(RunSession, RejectsRequestForUnknownStep) {
  options.steps_to_redo = {"rotation", "checks"};
  EXPECT_THAT([&] { run(); },
              ThrowsMessage<std::invalid_argument>(
                  "no step checks; the steps are: lens, row-time, rotation, dispersion, check, "
                  "evaluate"));
  options.steps_to_redo = {"line-x"};
  EXPECT_THAT([&] { run(); }, ThrowsMessage<std::invalid_argument>(HasSubstr("no step line-x")))
      << "only the report has drives";
  options.report = true;
  EXPECT_NO_THROW(run());
  fs::remove_all(session_file("check"));
  options.steps_to_redo = {"check"};
  EXPECT_THAT([&] { run(); }, ThrowsMessage<std::invalid_argument>(HasSubstr("no step check;")));
}

TEST_F(RunSession, EstimatesRowTimeIfCameraHasNone) {
  write_camera(std::nullopt);
  const SessionResult result = run();
  EXPECT_EQ(result.verdict, Verdict::pass) << result.reason;
  EXPECT_THAT(list_steps(result),
              ElementsAre("lens", "row-time", "rotation", "dispersion", "check", "evaluate"));
  ASSERT_TRUE(has_result("camera.yaml"));
  const Calibration camera = read_calibration(results_file("camera.yaml"));
  ASSERT_TRUE(camera.camera.row_time_s);
  const double row_time_s = *camera.camera.row_time_s;
  EXPECT_NEAR(row_time_s, 3e-5, 1e-7);
  const auto metric_us =
      find_metric_value(find_step(result, "row-time").result.metrics, "row_time_us");
  ASSERT_TRUE(metric_us);
  EXPECT_NEAR(*metric_us, 1e6 * row_time_s, 1e-9);
  EXPECT_FALSE(find_metric_value(find_step(result, "rotation").result.metrics, "row_time_us"))
      << "the step row-time measured it";
  ASSERT_TRUE(result.calibration);
  EXPECT_EQ(result.calibration->camera.row_time_s, row_time_s) << "used by the next steps";
  write_session_file("rotation/notes.txt", "changes the input");
  EXPECT_THAT(list_executed_steps(run()), ElementsAre("row-time", "rotation"));
}

TEST_F(RunSession, RotationStepReportsRowTimeOnceCameraHasOne) {
  write_camera(std::nullopt);
  run();
  fs::copy(results_file("camera.yaml"), session_file("camera.yaml"),
           fs::copy_options::overwrite_existing);
  const SessionResult result = run();
  EXPECT_THAT(list_executed_steps(result), ElementsAre("lens", "rotation", "dispersion"));
  EXPECT_TRUE(find_metric_value(find_step(result, "rotation").result.metrics, "row_time_us"));
}

TEST_F(RunSession, RemovesRowTimeEstimateOnceRowTimeIsGiven) {
  const std::string camera = TemporaryFolder::read_content(session_file("camera.yaml"));
  write_camera(std::nullopt);
  run();
  write_session_file("camera.yaml", camera);
  EXPECT_THAT(list_steps(run()),
              ElementsAre("lens", "rotation", "dispersion", "check", "evaluate"));
  EXPECT_FALSE(has_result("camera.yaml"));
  EXPECT_FALSE(has_result("steps/row-time.json"));
}

TEST_F(RunSession, UsesRotatedCalibrationWithoutDispersion) {
  options.report = true;
  run();
  fs::remove_all(session_file("dispersion"));
  const SessionResult result = run();
  EXPECT_EQ(result.verdict, Verdict::pass) << result.reason;
  EXPECT_THAT(list_steps(result), ElementsAre("lens", "rotation", "check", "line-x", "evaluate"));
  EXPECT_EQ(read_result("calibration.yaml"), read_result("rotated.yaml"));
  EXPECT_FALSE(has_result("dispersion.svg"));
  EXPECT_FALSE(has_result("steps/dispersion.json"));
  ASSERT_TRUE(result.calibration);
  EXPECT_FALSE(result.calibration->dispersion);
}

}  // namespace
}  // namespace vlp
