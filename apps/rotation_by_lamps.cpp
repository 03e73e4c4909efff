// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rotation_by_lamps.h"

#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include "app.h"
#include "calibration/levelling/levelling.h"
#include "capture_options.h"
#include "check_map.h"
#include "history.h"
#include "print_rotation.h"
#include "rig/stage.h"

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

void rotate_by_lamps(const CLI::App& app, const DetectOptions& detect,
                     const std::string& refined_map) {
  const std::vector<std::string> inputs = inputs_of(detect);
  check_output(detect.output, inputs);
  if (!refined_map.empty()) check_output(refined_map, inputs);
  if (refined_map == detect.output) {
    throw std::invalid_argument("--output and --refine-map name one file");
  }
  const CaptureInput input = read_captures_of(detect);
  const auto& [lamps, calibration, frames] = input;
  check_lamps(frames, lamps, detect.lamps);
  check_map(input, camera_alone(calibration), detect);
  LevellingOptions options;
  options.refine_map = !refined_map.empty();
  const Levelling result = level_by_lamps(frames, lamps, calibration.camera, options);
  if (!result.undetermined.empty()) {
    check_map_of_failure(input, camera_alone(calibration), detect);
    throw Undetermined(result.undetermined);
  }
  HistoryEntry entry = history_entry(app, inputs);
  if (options.refine_map) write_lamp_map(refined_map, result.map);
  write_calibration(detect.output,
                    with_rotation_center(calibration, result.center, std::move(entry)));
  report(result, calibration.camera);
}

}  // namespace vlp
