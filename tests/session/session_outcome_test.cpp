// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// run_session(): gates, warnings, metrics and history.
#include <gmock/gmock.h>

#include <algorithm>

#include "captures/digest.h"
#include "captures/fixes_table.h"
#include "rendered_session.h"
#include "session/session.h"
#include "session/session_gates.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using RunSession = RenderedSession;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::StartsWith;

std::string format_gates(const std::string& gates) {
  return "format: vlp-gates/1\ngates: {" + gates + "}\n";
}

/// Returns true for a default gate that is met.
bool is_usual(const CheckedMetric& gate) {
  return gate.has_passed_gate() && !make_step_gates({{gate.name, 0}}).empty();
}

/// Returns the names of gates, without default ones that are met; "!" before those that failed.
std::vector<std::string> list_gates(const std::vector<CheckedMetric>& gates) {
  std::vector<std::string> names;
  for (const CheckedMetric& gate : gates) {
    if (!is_usual(gate)) names.push_back((gate.has_passed_gate() ? "" : "!") + gate.name);
  }
  return names;
}

TEST_F(RunSession, ChecksDefaultGatesOfEachStepForGivenCamera) {
  const SessionResult result = run();
  EXPECT_EQ(result.verdict, Verdict::pass) << result.reason;
  EXPECT_EQ(std::ranges::count_if(result.gates, is_usual), 2);
  EXPECT_EQ(result.gates.size(), 2U);
  write_session_file("gates.yaml", format_gates("normalized_error_rms: 0.001"));
  EXPECT_THAT(list_gates(run().gates), ElementsAre("!normalized_error_rms"));
}

TEST(MakeStepGates, LimitsYawErrorsAboveFiveDegrees) {
  const auto gates = make_step_gates({{"yaw_rms_deg", 4.9}, {"normalized_yaw_error_rms", 99}});
  EXPECT_THAT(gates, IsEmpty()) << "a heading that is set by hand";
  const auto found = make_step_gates({{"yaw_rms_deg", 5.1}, {"normalized_yaw_error_rms", 99}});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].metric, "normalized_yaw_error_rms");
}

TEST_F(RunSession, StrictOptionFailsSessionWithWarning) {
  options.camera_id = "another";  // than that of camera.yaml, which warns
  EXPECT_EQ(run().verdict, Verdict::pass);
  options.strict = true;
  const SessionResult result = run();
  EXPECT_THAT(list_executed_steps(result), ElementsAre("evaluate"));
  EXPECT_EQ(result.verdict, Verdict::fail);
  EXPECT_EQ(result.reason, "warnings is 1, at most 0 is required");
}

TEST_F(RunSession, ChecksGatesInOrderOfSteps) {
  write_session_file("gates.yaml",
                     format_gates("mean_mm: 1, dispersion_mm: 1, tilt_deg: 1, rotation_px: 1"));
  const SessionResult result = run();
  EXPECT_EQ(result.verdict, Verdict::pass) << result.reason;
  EXPECT_THAT(list_gates(result.gates),
              ElementsAre("rotation_px", "tilt_deg", "dispersion_mm", "mean_mm"));
  EXPECT_THAT(list_gates(find_step(result, "rotation").result.gates),
              ElementsAre("rotation_px", "tilt_deg"));
  EXPECT_THAT(list_gates(find_step(result, "dispersion").result.gates),
              ElementsAre("dispersion_mm"));
  EXPECT_THAT(list_gates(find_step(result, "evaluate").result.gates), ElementsAre("mean_mm"));
  EXPECT_THAT(find_step(result, "check").result.gates, IsEmpty());
}

TEST_F(RunSession, ReasonOfVerdictListsFailedGates) {
  options.report = true;
  write_session_file("gates.yaml", format_gates("mean_mm: 1.0e-6, tilt_deg: 0.5, rotation_px: 1"));
  const SessionResult result = run();
  EXPECT_EQ(result.verdict, Verdict::fail);
  EXPECT_EQ(result.failure, StepFailure::none);
  EXPECT_THAT(list_gates(result.gates), ElementsAre("rotation_px", "!tilt_deg", "!mean_mm"));
  EXPECT_THAT(result.reason, AllOf(StartsWith("tilt_deg is "), HasSubstr("; mean_mm is "),
                                   Not(HasSubstr("rotation_px"))));
  EXPECT_THAT(read_result("session.json"), HasSubstr("\"verdict\": \"gate\""));
  EXPECT_THAT(read_result("evaluation.json"), HasSubstr("\"mean_mm\""));
  const std::string page = read_result("report.html");
  for (const char* text : {"<strong>FAIL</strong>", "<th scope=\"row\">rotation_px</th>",
                           "<th scope=\"row\">tilt_deg</th>", "<th scope=\"row\">mean_mm</th>"}) {
    EXPECT_NE(page.find(text), std::string::npos) << text;
  }
  const SessionResult again = run();
  EXPECT_THAT(list_executed_steps(again), IsEmpty());
  EXPECT_EQ(again.reason, result.reason);
  EXPECT_EQ(again.verdict, Verdict::fail);
}

TEST_F(RunSession, ChangedGateRunsOnlyEvaluationAgain) {
  write_session_file("gates.yaml", format_gates("tilt_deg: 0.5"));
  run();
  for (const char* gates : {"tilt_deg: 2", "rotation_px: 2", "rotation_px: 2, mean_mm: 1"}) {
    write_session_file("gates.yaml", format_gates(gates));
    const SessionResult result = run();
    EXPECT_THAT(list_executed_steps(result), ElementsAre("evaluate")) << gates;
    EXPECT_EQ(result.verdict, Verdict::pass) << result.reason;
  }
}

TEST_F(RunSession, GatesFileOfOptionsAppliesOnlyToSessionWithoutGates) {
  options.gates_file = folder.file("gates.yaml", format_gates("tilt_deg: 0.5"));
  EXPECT_THAT(list_gates(run().gates), ElementsAre("!tilt_deg"));
  write_session_file("gates.yaml", format_gates("rotation_px: 1"));
  EXPECT_THAT(list_gates(run().gates), ElementsAre("rotation_px"));
}

TEST_F(RunSession, FailsGatesOfMissingSteps) {
  write_session_file("gates.yaml", format_gates("views: 6, dispersion_mm: 1, mean_mm: 1"));
  fs::remove_all(session_file("dispersion"));
  fs::remove_all(session_file("check"));
  const SessionResult result = run();
  EXPECT_EQ(result.verdict, Verdict::fail);
  EXPECT_THAT(list_gates(result.gates), ElementsAre("!views", "!dispersion_mm", "!mean_mm"));
  for (const CheckedMetric& gate : result.gates) {
    EXPECT_TRUE(is_usual(gate) || !gate.value) << gate.name;
  }
  EXPECT_EQ(find_step(result, "lens").result.gates.size(), 1U);
}

TEST_F(RunSession, DoesNotCheckGatesOfFailedStep) {
  write_session_file("gates.yaml", format_gates("tilt_deg: 0.5, views: 6"));
  keep_captures("rotation", 2);
  const SessionResult result = run();
  EXPECT_EQ(result.verdict, Verdict::invalid) << "the failed step is the reason";
  EXPECT_THAT(list_gates(result.gates), ElementsAre("!views"));
  EXPECT_THAT(result.reason, StartsWith("rotation: "));
}

TEST_F(RunSession, NotesWhyThereIsNoReport) {
  options.report = true;
  fs::remove(session_file("check/truth.csv"));
  const SessionResult without_places = run();
  EXPECT_EQ(without_places.verdict, Verdict::pass) << without_places.reason;
  EXPECT_THAT(find_step(without_places, "evaluate").result.notes,
              ElementsAre("no errors and no report: check has neither truth.csv nor positions in "
                          "captures.csv"));
  EXPECT_TRUE(has_result("check-fixes.csv"));
  fs::remove_all(session_file("check"));
  const SessionResult without_check = run();
  EXPECT_EQ(without_check.verdict, Verdict::pass) << without_check.reason;
  EXPECT_THAT(list_steps(without_check),
              ElementsAre("lens", "rotation", "dispersion", "line-x", "evaluate"));
  EXPECT_THAT(find_step(without_check, "evaluate").result.notes,
              ElementsAre("no errors and no report: there is no check"));
  fs::remove_all(session_file("dispersion"));
  EXPECT_THAT(find_step(run(), "evaluate").result.notes,
              ElementsAre("no errors and no report: there is no check",
                          "no dispersion offset: the session has no folder dispersion"));
  for (const char* name : {"evaluation.json", "report.html", "check-fixes.csv"}) {
    EXPECT_FALSE(has_result(name)) << name;
  }
}

TEST_F(RunSession, GivenCameraTakesPrecedenceOverOptions) {
  const SessionOptions defaults = options;
  for (const auto& [set, ignored] :
       {std::pair(
            +[](SessionOptions&) {}, ""),
        {+[](SessionOptions& changed) { changed.lens_model = LensModel::opencv5; }, "lens model"},
        {+[](SessionOptions& changed) { changed.choose_lens_model = true; }, "lens model"},
        {+[](SessionOptions& changed) { changed.frontend.row_time_s = 4e-5; }, "row time"},
        {+[](SessionOptions& changed) { changed.frontend.max_blur_fraction = 0.001; },
         "limits of board images"},
        {+[](SessionOptions& changed) {
           changed.camera_id = "other";
           changed.frontend.readout = Readout::columns;
           changed.frontend.max_white_fraction = 0.5;
         },
         "name, readout, limits of board images"}}) {
    options = defaults;
    set(options);
    const SessionResult result = run();
    EXPECT_EQ(result.verdict, Verdict::pass) << result.reason;
    const auto& warnings = find_step(result, "lens").result.warnings;
    ASSERT_EQ(warnings.size(), *ignored == '\0' ? 0U : 1U) << ignored;
    if (!warnings.empty()) {
      EXPECT_THAT(warnings[0], testing::EndsWith(std::string("ignored: ") + ignored));
    }
  }
}

TEST_F(RunSession, IgnoresReadoutOptionIfRowTimeIsEstimated) {
  write_camera(std::nullopt);
  options.frontend.readout = Readout::columns;
  const SessionResult result = run();
  EXPECT_EQ(result.verdict, Verdict::pass) << result.reason;
  ASSERT_TRUE(result.calibration);
  EXPECT_EQ(result.calibration->camera.readout, Readout::rows);
}

TEST_F(RunSession, ReportsRmsOfGivenCameraIfItHasViews) {
  Calibration camera = read_calibration(session_file("camera.yaml"));
  camera.intrinsics_report = IntrinsicsReport{40, 4000, 0, 0.125, {}, {}};
  write_calibration(session_file("camera.yaml"), camera);
  const auto metrics = find_step(run(), "lens").result.metrics;
  ASSERT_EQ(metrics.size(), 1U);
  EXPECT_EQ(metrics[0].name, "rms_px");
  EXPECT_EQ(metrics[0].value, 0.125);
  camera.intrinsics_report = IntrinsicsReport{0, 0, 0, 0, {}, {}};
  write_calibration(session_file("camera.yaml"), camera);
  EXPECT_THAT(find_step(run(), "lens").result.metrics, IsEmpty()) << "lens of another program";
}

TEST_F(RunSession, WarnsOfDispersionCapturesWithoutPosition) {
  const std::string warning =
      "captures have no position: add x_m and y_m to captures.csv or truth.csv; ignored";
  EXPECT_THAT(find_step(run(), "dispersion").result.warnings, Not(Contains(HasSubstr(warning))));
  fs::remove(session_file("dispersion/truth.csv"));
  edit_session_file("dispersion/captures.csv", "0003.png", "0004.png");
  const SessionResult result = run();
  EXPECT_EQ(result.verdict, Verdict::pass) << result.reason;
  EXPECT_THAT(find_step(result, "dispersion").result.warnings, Contains("1 of the 4 " + warning));
  ASSERT_TRUE(result.calibration && result.calibration->dispersion);
  EXPECT_EQ(result.calibration->dispersion->captures, 3);
}

TEST_F(RunSession, WarnsOfCheckCaptureAtAnotherPosition) {
  const auto& name = "was not taken at the position in its table";
  EXPECT_THAT(find_step(run(), "evaluate").result.warnings, IsEmpty());
  edit_session_file("check/truth.csv", "0002.png,0.321", "0002.png,0.381");
  EXPECT_THAT(
      find_step(run(), "evaluate").result.warnings,
      Contains(AllOf(StartsWith("0002.png "), HasSubstr(name), HasSubstr("its error is "))));
}

TEST_F(RunSession, DoesNotWarnOfPositionErrorOfFixFromTwoLamps) {
  fs::copy(rendered_capture_of_two_lamps(), session_file("check/0006.png"));
  write_session_file(
      "check/truth.csv",
      TemporaryFolder::read_content(session_file("check/truth.csv")) + "0006.png,1.36,0,0,0\n");
  const SessionResult result = run();
  ASSERT_TRUE(has_result("check-fixes.csv"));
  const auto fixes = read_fixes(results_file("check-fixes.csv"));
  ASSERT_EQ(fixes.size(), 7U);
  ASSERT_TRUE(fixes[6].fix);
  EXPECT_EQ(fixes[6].lamps, 2);
  EXPECT_NEAR(fixes[6].fix->pose.position_m.x(), 1.3, 0.001);
  EXPECT_THAT(find_step(result, "evaluate").result.warnings, IsEmpty());
}

TEST_F(RunSession, ReportsLampOffsetsOfCheckStepOnly) {
  options.report = true;
  const SessionResult result = run();
  const auto& offsets = find_step(result, "check").result.lamp_offsets;
  ASSERT_EQ(offsets.size(), 6U);
  for (const LampOffset& offset : offsets) {
    EXPECT_LT(offset.offset_m.norm(), 5e-4) << offset.lamp;
  }
  for (const char* step : {"rotation", "dispersion", "line-x", "evaluate"}) {
    EXPECT_THAT(find_step(result, step).result.lamp_offsets, IsEmpty()) << step;
  }
}

TEST_F(RunSession, SkipsRepeatedImagesExceptInDrives) {
  options.report = true;
  for (const char* captures : {"rotation", "dispersion", "check", "line-x"}) {
    fs::copy(session_file(std::string(captures) + "/0000.png"),
             session_file(std::string(captures) + "/0009.png"));
  }
  const SessionResult result = run();
  for (const char* step : {"rotation", "dispersion", "check"}) {
    const auto& skipped = find_step(result, step).result.skipped;
    ASSERT_EQ(skipped.size(), 1U) << step;
    EXPECT_EQ(skipped[0].image, "0009.png") << step;
  }
  EXPECT_THAT(find_step(result, "line-x").result.skipped, IsEmpty());
  EXPECT_THAT(read_result("line-x-fixes.csv"), HasSubstr("\n0009.png,ok,"));
}

TEST_F(RunSession, HistoryStatesProgramInputsAndDigestsOfEachStep) {
  const SessionResult result = run();
  ASSERT_TRUE(result.calibration);
  const auto& history = result.calibration->history;
  ASSERT_EQ(history.size(), 2U);
  const auto list_inputs = [](const HistoryEntry& entry) {
    std::vector<std::string> names;
    for (const auto& input : entry.inputs) names.push_back(input.file);
    return names;
  };
  ASSERT_EQ(history[0].inputs.size(), 3U);
  ASSERT_EQ(history[1].inputs.size(), 5U);
  EXPECT_EQ(history[0].part, "rotation_center");
  EXPECT_THAT(list_inputs(history[0]), ElementsAre("rotation", "lamps.yaml", "camera.yaml"));
  EXPECT_EQ(history[1].part, "dispersion");
  EXPECT_THAT(list_inputs(history[1]),
              ElementsAre("dispersion", "lamps.yaml", "rotated.yaml", "captures.csv", "truth.csv"));
  for (const HistoryEntry& entry : history) {
    EXPECT_EQ(entry.program, "test");
    EXPECT_EQ(entry.version, "1.2");
    EXPECT_EQ(entry.options, "");
    EXPECT_EQ(entry.inputs[1].sha256, hash_file(session_file("lamps.yaml")));
  }
  EXPECT_EQ(history[1].inputs[2].sha256, hash_file(results_file("rotated.yaml")));
}

}  // namespace
}  // namespace vlp
