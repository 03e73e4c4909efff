// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/steps/rotation_methods.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>

#include "captures/captures_table.h"
#include "geometry/angles.h"
#include "program/app.h"
#include "program/steps/capture_options.h"
#include "program/steps/print_calibration.h"
#include "program/steps/step_outcome.h"
#include "report/plots/gnuplot.h"
#include "session/lamp_captures.h"
#include "session/rotation_step.h"

namespace vlp {

namespace {

namespace fs = std::filesystem;

/// Returns the file captures.csv of the captures; empty if there is none.
fs::path select_captures_file(const CaptureOptions& images, const TiltOptions& options) {
  if (!options.captures.empty()) return options.captures;
  const fs::path beside = fs::path(images.images) / "captures.csv";
  return fs::is_directory(images.images) && fs::exists(beside) ? beside : fs::path();
}

void print_tilt(const TiltCalibration& result, const Calibration& calibration) {
  fmt::print("captures    {} used, {} of fewer than three lamps, {} rejected\n", result.captures,
             result.captures_of_few_lamps, result.captures_rejected);
  fmt::print("detections  {} used, {} rejected\n", result.detections, result.detections_rejected);
  print_center(calibration);
  fmt::print(
      "residual    {:.4f} px per axis; for a level camera{} {:.4f} px in the undistorted image\n",
      result.residual_px, result.corrections.empty() ? "" : " and the original map",
      result.residual_before_px);
  if (result.corrections.empty()) return;
  print_lamp_header();
  for (const auto& [id, correction_m, sd_m, moved] : result.corrections) {
    print_lamp_row(id, correction_m, sd_m);
  }
}

}  // namespace

void run_tilt_program(const CLI::App& app, CaptureOptions images, const TiltOptions& options) {
  const std::string& refined_map = options.refined_map;
  const fs::path captures = select_captures_file(images, options);
  std::vector<std::string> inputs = list_capture_files(images);
  inputs.push_back(captures.string());
  check_outputs_distinct({{"--output", images.output}, {"--refine-map", refined_map}}, inputs);
  images.captures.emplace();  // inclinations are ignored: the level direction is estimated
  LampCaptures input = read_lamp_captures(images, ImageUse::fixes);
  check_map_has_lamps(input.frames, input.lamps, input.lamps_file);
  input.motions = list_capture_motions(
      input.frames, captures.empty() ? CapturesTable() : read_captures_csv(captures),
      options.motion.make_motion_prior(), rad_from_deg(options.yaw_rate_sd_deg_per_s.value_or(0)));
  // A table without motion does not affect the result and is not recorded.
  if (input.motions.empty()) inputs.pop_back();
  const TiltResult result =
      run_tilt_step(input, !refined_map.empty(), make_command_entry(app, inputs));
  print_step_remarks(result);
  require_success(result);
  if (!refined_map.empty()) {
    write_refined_map(refined_map, result.tilt.map, images.frontend.room);
  }
  write_calibration(images.output, result.calibration);
  print_tilt(result.tilt, result.calibration);
}

void run_rotation_program(const CLI::App& app, CaptureOptions images, const std::string& method,
                          const std::string& plot) {
  const std::vector<std::string> inputs = list_capture_files(images);
  check_outputs_distinct({{"--output", images.output}, {"--plot", plot}}, inputs);
  images.captures.emplace();  // inclinations are ignored: the axis defines the level direction
  const LampCaptures input = read_lamp_captures(images, ImageUse::rotation);
  const auto* const named = std::ranges::find(kRotationMethods, method,
                                              &std::pair<std::string_view, RotationMethod>::first);
  const RotationResult found =
      run_rotation_step(input, named->second, make_command_entry(app, inputs));
  print_step_remarks(found);
  require_success(found);
  if (!plot.empty()) write_plot(plot, found.drawing());
  write_calibration(images.output, found.calibration);
  print_rotation(found.fit, found.rotation, found.circles, found.calibration);
}

}  // namespace vlp
