// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// run_session(): sessions whose lens is estimated from images of a board.
#include <gmock/gmock.h>

#include "captures/digest.h"
#include "rendered_session.h"
#include "session/session.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class RunSessionWithBoards : public RenderedSession {
 protected:
  RunSessionWithBoards() {
    add_boards_in_place_of_camera();
    options.camera_id = "unit-8";
    options.lens_model = LensModel::opencv4;
    options.frontend.row_time_s = 3e-5;
  }
  Calibration read_lens() const { return read_calibration(results_file("lens.yaml")); }
  std::string read_lens_options() const {
    const Calibration lens = read_lens();
    return lens.history.empty() ? "no history" : lens.history[0].options;
  }
};

/// Returns the names of gates, without the default ones of steps with lamps.
std::vector<std::string> list_gate_names(const std::vector<CheckedMetric>& gates) {
  std::vector<std::string> names;
  for (const CheckedMetric& gate : gates) {
    if (make_step_gates({{gate.name, 0}}).empty()) names.push_back(gate.name);
  }
  return names;
}

TEST_F(RunSessionWithBoards, EstimatesLensWithNameModelAndRowTimeOfOptions) {
  options.frontend.readout = Readout::rows;
  options.frontend.max_blur_fraction = 0.004;
  options.frontend.max_white_fraction = 0.5;
  const SessionResult result = run();
  EXPECT_EQ(result.verdict, Verdict::pass) << result.reason;
  EXPECT_THAT(list_steps(result),
              ElementsAre("lens", "rotation", "dispersion", "check", "evaluate"));
  ASSERT_TRUE(has_result("lens.yaml"));
  const Calibration lens = read_lens();
  EXPECT_EQ(lens.camera.id, "unit-8");
  EXPECT_EQ(lens.camera.lens_model, LensModel::opencv4);
  EXPECT_EQ(lens.camera.row_time_s, 3e-5);
  EXPECT_EQ(lens.camera.readout, Readout::rows);
  EXPECT_LT((lens.camera.focal_px() - truth().camera.focal_px()).norm(), 0.1);
  EXPECT_TRUE(has_result("lens.cameramodel"));
  EXPECT_FALSE(has_result("lens.svg"));
  EXPECT_FALSE(has_result("camera.yaml"));
  EXPECT_FALSE(fs::is_empty(results_file("steps/corners")));
  ASSERT_EQ(lens.history.size(), 1U);
  EXPECT_EQ(lens.history[0].part, "camera");
  EXPECT_EQ(lens.history[0].options,
            "--camera-id unit-8 --row-time-s 3e-05 --readout rows --max-blur-fraction 0.004 "
            "--max-white-fraction 0.5 --lens LENSMODEL_OPENCV4");
  ASSERT_EQ(lens.history[0].inputs.size(), 2U);
  EXPECT_EQ(lens.history[0].inputs[0].file, "board.yaml");
  EXPECT_EQ(lens.history[0].inputs[0].sha256, hash_file(session_file("board.yaml")));
  EXPECT_EQ(lens.history[0].inputs[1].file, "boards");
  EXPECT_THAT(find_step(result, "rotation").result.notes, IsEmpty()) << "the readout is stated";
  EXPECT_TRUE(find_metric_value(find_step(result, "rotation").result.metrics, "row_time_us"));
}

TEST_F(RunSessionWithBoards, ChecksDefaultGatesOfLens) {
  options.frontend.row_time_s.reset();
  options.report = true;
  const SessionResult result = run();
  EXPECT_EQ(result.verdict, Verdict::pass) << result.reason;
  EXPECT_THAT(list_steps(result), ElementsAre("lens", "row-time", "rotation", "dispersion", "check",
                                              "line-x", "evaluate"));
  EXPECT_THAT(list_gate_names(result.gates),
              ElementsAre("rms_px", "expected_max_error_px", "split_half_px", "coverage", "views",
                          "board_tilt_deg"));
  EXPECT_EQ(list_gate_names(find_step(result, "lens").result.gates), list_gate_names(result.gates));
  EXPECT_TRUE(has_result("lens.svg"));
  EXPECT_EQ(read_lens_options(), "--camera-id unit-8 --lens LENSMODEL_OPENCV4");
  ASSERT_TRUE(result.calibration);
  EXPECT_EQ(result.calibration->camera.readout, Readout::rows) << "estimated with the row time";
  const std::string page = read_result("report.html");
  for (const char* text : {"Accuracy report: unit-8", "corners of the board in all views",
                           "<th scope=\"row\">split_half_px</th>"}) {
    EXPECT_NE(page.find(text), std::string::npos) << text;
  }
  EXPECT_FALSE(find_metric_value(find_step(result, "rotation").result.metrics, "row_time_us"))
      << "the step row-time has measured it";
  write_session_file("gates.yaml", "format: vlp-gates/1\ngates: {rms_px: 1.0e-6, tilt_deg: 2}\n");
  const SessionResult changed = run();
  EXPECT_THAT(list_executed_steps(changed), ElementsAre("evaluate"));
  EXPECT_EQ(changed.verdict, Verdict::fail);
  EXPECT_THAT(list_gate_names(changed.gates),
              ElementsAre("rms_px", "expected_max_error_px", "split_half_px", "coverage", "views",
                          "board_tilt_deg", "tilt_deg"));
  ASSERT_FALSE(changed.gates.empty());
  EXPECT_EQ(changed.gates[0].limit, 1e-6);
  EXPECT_THAT(changed.reason, testing::StartsWith("rms_px is "));
  // A camera that is given has neither the default gates nor the outputs of the lens.
  write_camera();
  const SessionResult given = run();
  EXPECT_THAT(list_gate_names(given.gates), ElementsAre("rms_px", "tilt_deg"));
  for (const char* name : {"lens.yaml", "lens.cameramodel", "lens.svg", "camera.yaml"}) {
    EXPECT_FALSE(has_result(name)) << name;
  }
}

TEST_F(RunSessionWithBoards, NotesSelectedLensModel) {
  options.choose_lens_model = true;
  options.frontend.readout = Readout::columns;
  const SessionResult result = run();
  const auto& notes = find_step(result, "lens").result.notes;
  EXPECT_THAT(notes, Contains(testing::StartsWith("lens model: LENSMODEL_OPENCV")));
  ASSERT_TRUE(has_result("lens.yaml"));
  EXPECT_EQ(read_lens_options(),
            "--camera-id unit-8 --row-time-s 3e-05 --readout columns --lens auto");
  EXPECT_TRUE(has_result("lens.cameramodel"));
}

}  // namespace
}  // namespace vlp
