// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// run_session(): steps that fail, and sessions and options that it rejects.
#include <fmt/core.h>
#include <gmock/gmock.h>

#include <functional>
#include <regex>

#include "captures/truth_table.h"
#include "rendered_session.h"
#include "rig/input_error.h"
#include "session/session.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using RunSession = RenderedSession;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::StartsWith;
using testing::ThrowsMessage;

constexpr const char* kGates = "format: vlp-gates/1\ngates:\n";

class FaultySession;

/// A change of a session that makes a step fail, and the message, which begins with these words.
struct SessionFault {
  std::string name, step;
  StepFailure failure;
  std::string message;
  std::function<void(FaultySession&)> make;
};
void PrintTo(const SessionFault& fault, std::ostream* out) { *out << fault.name; }

/// A session that was calibrated before it is changed.
class FaultySession : public RenderedSession, public testing::WithParamInterface<SessionFault> {
 public:
  using RenderedSession::add_boards_in_place_of_camera;
  using RenderedSession::edit_session_file;
  using RenderedSession::keep_captures;
  using RenderedSession::session_file;
  using RenderedSession::write_camera;
  using RenderedSession::write_session_file;

  void keep_no_image(const std::string& captures) {
    fs::remove_all(session_file(captures));
    fs::create_directory(session_file(captures));
  }
  /// Replaces the images of lamps by those of boards.
  void show_boards_in(const std::string& captures) {
    add_boards_in_place_of_camera();
    write_camera();
    keep_captures(captures, 0);
    for (const char* image : {"0000.png", "0001.png", "0002.png"}) {
      fs::copy(session_file(std::string("boards/") + image), session_file(captures + "/" + image));
    }
  }
};

TEST_P(FaultySession, StepFailsAndOutputsOfItAndLaterStepsAreRemoved) {
  options.report = true;
  ASSERT_NE(run().verdict, Verdict::invalid);
  GetParam().make(*this);
  const SessionResult result = run();
  EXPECT_EQ(result.verdict, Verdict::invalid);
  EXPECT_EQ(result.failure, GetParam().failure) << step_failure_name(result.failure);
  ASSERT_FALSE(result.steps.empty());
  const StepResult& last = result.steps.back().result;
  ASSERT_EQ(result.steps.back().name, GetParam().step) << result.reason;
  EXPECT_EQ(last.failure, GetParam().failure);
  EXPECT_THAT(last.message, AllOf(Not(IsEmpty()), StartsWith(GetParam().message)));
  EXPECT_EQ(result.reason, GetParam().step + ": " + last.message);
  EXPECT_EQ(last.message.find(session_folder.string()), std::string::npos);
  bool has_failed = GetParam().step == "lens" || GetParam().step == "row-time";
  for (const auto& [step, output] : {std::pair("rotation", "rotated.yaml"),
                                     {"dispersion", "calibration.yaml"},
                                     {"check", "check-fixes.csv"},
                                     {"line-x", "line-x-fixes.csv"},
                                     {"evaluate", "evaluation.json"},
                                     {"", "report.html"}}) {
    has_failed = has_failed || step == GetParam().step;
    EXPECT_EQ(has_result(output), !has_failed) << output;
  }
  EXPECT_THAT(read_result("session.json"), HasSubstr("\"verdict\": \"no result\""));
  EXPECT_THAT(read_result("junit.xml"), HasSubstr("<error type="));
  // A bad input is read again, as its file may be another; images that have not changed are not.
  const auto again = list_executed_steps(run());
  EXPECT_EQ(again.empty(), GetParam().failure != StepFailure::bad_input)
      << testing::PrintToString(again);
}

const SessionFault kFaults[] = {
    {"CameraFile", "lens", StepFailure::bad_input, "camera.yaml:2",
     [](FaultySession& session) {
       session.write_session_file("camera.yaml", "format: vlp-calibration/1\ncamera: 7\n");
     }},
    {"OtherBoard", "lens", StepFailure::wrong_board,
     "board.yaml: boards/0000.png: the image shows tags of family tag36h11",
     [](FaultySession& session) {
       session.add_boards_in_place_of_camera();
       session.edit_session_file("board.yaml", "tag36h11", "tag25h9");
     }},
    {"NoBoards", "lens", StepFailure::undetermined, "",
     [](FaultySession& session) {
       session.add_boards_in_place_of_camera();
       fs::remove_all(session.session_file("boards"));
       fs::copy(session.session_file("check"), session.session_file("boards"));
     }},
    {"NoFrequencies", "row-time", StepFailure::bad_input, "lamps.yaml: ",
     [](FaultySession& session) {
       session.write_camera(std::nullopt);
       const auto lamps = TemporaryFolder::read_content(session.session_file("lamps.yaml"));
       session.write_session_file(
           "lamps.yaml", std::regex_replace(lamps, std::regex(", frequency_hz: [0-9.e+]+"), ""));
     }},
    {"NoImageOfRotation", "rotation", StepFailure::bad_input,
     "rotation: ", [](FaultySession& session) { session.keep_no_image("rotation"); }},
    {"TwoCapturesOfRotation", "rotation", StepFailure::undetermined, "",
     [](FaultySession& session) { session.keep_captures("rotation", 2); }},
    {"BoardsInRotation", "rotation", StepFailure::undetermined, "",
     [](FaultySession& session) { session.show_boards_in("rotation"); }},
    {"RowTime", "rotation", StepFailure::bad_input,
     "row time is 33 us in camera.yaml, but the stripes of",
     [](FaultySession& session) { session.write_camera(3.3e-5); }},
    {"Readout", "rotation", StepFailure::bad_input,
     "the readout is along columns in camera.yaml, but the images show stripes along rows",
     [](FaultySession& session) {
       session.edit_session_file("camera.yaml", "readout: rows", "readout: columns");
     }},
    {"BoardsInDispersion", "dispersion", StepFailure::undetermined, "",
     [](FaultySession& session) { session.show_boards_in("dispersion"); }},
    {"OneCaptureOfDispersion", "dispersion", StepFailure::undetermined, "",
     [](FaultySession& session) { session.keep_captures("dispersion", 1); }},
    {"NoPositionsOfDispersion", "dispersion", StepFailure::wrong_place,
     "4 of the 4 captures have no position: add x_m and y_m",
     [](FaultySession& session) {
       fs::remove(session.session_file("dispersion/truth.csv"));
       fs::remove(session.session_file("dispersion/captures.csv"));
     }},
    {"NoImageOfCheck", "check", StepFailure::bad_input,
     "check: ", [](FaultySession& session) { session.keep_no_image("check"); }},
    {"CheckIsFile", "check", StepFailure::bad_input, "check: is not a folder of images",
     [](FaultySession& session) {
       fs::remove_all(session.session_file("check"));
       session.write_session_file("check", "a file");
     }},
    {"TableOfDrive", "line-x", StepFailure::bad_input, "line-x/captures.csv:2",
     [](FaultySession& session) {
       fs::remove(session.session_file("line-x/truth.csv"));
       session.write_session_file("line-x/captures.csv", "image,x_m,y_m\n0000.png,1");
     }},
    {"NoTruthOfCapture", "evaluate", StepFailure::bad_input, "check-fixes.csv:4: image: '0002.png'",
     [](FaultySession& session) {
       session.edit_session_file("check/truth.csv", "0002.png", "other.png");
     }},
    {"TruthInMillimeters", "evaluate", StepFailure::bad_input,
     "check/truth.csv:2: x_m: the values agree with the fixes if they are in mm; convert them to m",
     [](FaultySession& session) {
       std::string truth_in_mm = "image,x_m,y_m\n";
       for (const TruthRow& row : read_truth_table(session.session_file("check/truth.csv"))) {
         truth_in_mm +=
             fmt::format("{},{},{}\n", row.image, 1e3 * row.xy_m.x(), 1e3 * row.xy_m.y());
       }
       session.write_session_file("check/truth.csv", truth_in_mm);
     }},
    {"DriveWithoutLength", "evaluate", StepFailure::bad_input,
     "line-x/truth.csv: start and end of the drive are equal",
     [](FaultySession& session) {
       session.write_session_file("line-x/truth.csv",
                                  "image,x_m,y_m\n0000.png,0,0\n0003.png,0,0\n");
     }},
    {"DriveThatStood", "evaluate", StepFailure::bad_input,
     "line-x-fixes.csv: no line can be fitted to its fixes", [](FaultySession& session) {
       for (const char* image : {"line-x/0001.png", "line-x/0002.png", "line-x/0003.png"}) {
         fs::remove(session.session_file(image));
         fs::copy(session.session_file("line-x/0000.png"), session.session_file(image));
       }
     }}};

INSTANTIATE_TEST_SUITE_P(RunSession, FaultySession, testing::ValuesIn(kFaults),
                         [](const auto& instance) { return instance.param.name; });

TEST_F(RunSession, WarnsOfRowTimeThatFailsGate) {
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

TEST_F(RunSession, RemovesPathOfSessionOnlyAtBeginningOfFileName) {
  fs::remove(session_file("dispersion/truth.csv"));
  const std::string path = session_file("a.png").string();
  write_session_file("dispersion/captures.csv", "image,x_m,y_m\n0000.png," + path + ",1\n");
  EXPECT_THAT(run().reason, testing::EndsWith("should be a finite number, not 'a.png'"));
  write_session_file("dispersion/captures.csv", "image,x_m,y_m\n0000.png,x" + path + ",1\n");
  EXPECT_THAT(run().reason, testing::EndsWith("should be a finite number, not 'x" + path + "'"));
}

TEST_F(RunSession, IncompleteSessionIsInvalidAndHasNoOutputs) {
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

TEST_F(RunSession, InvalidGatesOfSessionRemoveOnlyEvaluation) {
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

TEST_F(RunSession, RejectsInvalidGatesFileOfOptionsBeforeFirstStep) {
  options.gates_file = folder.file("gates.yaml", std::string(kGates) + "  odd_mm: 1\n");
  EXPECT_THAT([&] { run(); }, ThrowsMessage<InputError>(HasSubstr("gates.yaml:3: ")));
  EXPECT_FALSE(fs::exists(results_folder));
  write_session_file("gates.yaml", std::string(kGates) + "  mean_mm: 1\n");
  EXPECT_THAT([&] { run(); }, ThrowsMessage<InputError>(HasSubstr("gates.yaml:3: ")))
      << "even if the session has gates of its own";
}

TEST_F(RunSession, RejectsMissingFolderCapturesAsResultsAndResultsOfAnotherSession) {
  const auto expect_rejected = [&](const fs::path& session, const fs::path& results,
                                   const std::string& message) {
    EXPECT_THAT([&] { run_session(session, results, options); },
                ThrowsMessage<InputError>(HasSubstr(message)));
  };
  expect_rejected(folder / "none", results_folder, "none: is not a folder of captures");
  EXPECT_FALSE(fs::exists(results_folder));
  for (const fs::path& results : {session_folder, session_file("check")}) {
    expect_rejected(session_folder, results,
                    "contains captures: choose another folder for the results");
    EXPECT_FALSE(fs::exists(results / "steps"));
  }
  fs::copy(session_folder, folder / "other", fs::copy_options::recursive);
  run();
  expect_rejected(folder / "other", results_folder, "contains the results of another session");
}

}  // namespace
}  // namespace vlp
