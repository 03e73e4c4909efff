// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rotation_by_lamps.h"

#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include "app.h"
#include "calibration/levelling/levelling.h"
#include "capture_options.h"
#include "history.h"
#include "print_rotation.h"
#include "rig/stage.h"
#include "step_outcome.h"

namespace vlp {
namespace {

void print_corrections(const Levelling& result) {
  fmt::print("\n{:>10} {:>28} {:>28}\n", "lamp", "moved by x y z (mm)", "sd (mm)");
  for (const auto& [id, correction_m, sd_m] : result.corrections) {
    fmt::print("{:10} {:10.3f}{:9.3f}{:9.3f} {:10.3f}{:9.3f}{:9.3f}\n", id, 1e3 * correction_m.x(),
               1e3 * correction_m.y(), 1e3 * correction_m.z(), 1e3 * sd_m.x(), 1e3 * sd_m.y(),
               1e3 * sd_m.z());
  }
}

void report(const Levelling& result, const Camera& camera) {
  fmt::print("captures    {} used, {} of fewer than three lamps, {} left out\n", result.captures,
             result.captures_of_few_lamps, result.captures_rejected);
  fmt::print("detections  {} used, {} left out\n", result.detections, result.detections_rejected);
  print_center(result.center, camera);
  fmt::print("residual    {:.4f} px per axis, {:.4f} px for a level camera{}\n", result.residual_px,
             result.residual_before_px, result.corrections.empty() ? "" : " and the map as it was");
  if (!result.corrections.empty()) print_corrections(result);
  constexpr double much = 3;
  if (result.excess > much) {
    spdlog::warn(
        "the residuals are {:.1f} times what sigma_px lets expect: lamp map or lens are a little "
        "wrong, and the tilt, too, may be wrong by more than its sd{}",
        result.excess, result.corrections.empty() ? "; --refine-map may help" : "");
  }
}

}  // namespace

void rotate_by_lamps(const CLI::App& app, const CaptureOptions& images,
                     const std::string& refined_map) {
  const std::vector<std::string> inputs = inputs_of(images);
  check_output(images.output, inputs);
  check_further_output("--refine-map", refined_map, images.output, inputs);
  const LampCaptures input = read_captures_of(images);
  const auto& [frames, lamps, lamps_file, calibration] = input;
  check_lamps(frames, lamps, lamps_file);
  StepResult step;
  if (doubts_map(input, camera_alone(calibration), step)) require(step);
  LevellingOptions options;
  options.refine_map = !refined_map.empty();
  const Levelling result = level_by_lamps(frames, lamps, calibration.camera, options);
  if (!result.undetermined.empty()) {
    step.fail(StepFailure::undetermined, result.undetermined);
    blame_map(input, camera_alone(calibration), step);
    require(step);
  }
  HistoryEntry entry = history_entry(app, inputs);
  if (options.refine_map) write_lamp_map(refined_map, result.map);
  write_calibration(images.output,
                    with_rotation_center(calibration, result.center, std::move(entry)));
  report(result, calibration.camera);
}

}  // namespace vlp
