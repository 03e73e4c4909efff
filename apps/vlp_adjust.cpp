// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-adjust: jointly adjusts calibration and lamp map to any sets of captures.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "geometry/angles.h"
#include "program/app.h"
#include "program/steps/capture_options.h"
#include "program/steps/print_calibration.h"
#include "program/steps/step_outcome.h"
#include "rig/input_error.h"
#include "rig/lamp_map_file.h"
#include "session/adjust_step.h"
#include "session/session_folder.h"
#include "session/step_history.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

struct Options {
  CaptureOptions images;  // without the sets
  std::vector<std::string> sets, turns;
  std::string refined_map;
  std::optional<double> map_sd_m, position_sd_m, lens_sd_px;
  MotionOptions motion;
  std::optional<double> yaw_rate_sd_deg_per_s;
};

/// Reads a set: a folder of images or a table of detections, and the captures.csv in its folder.
AdjustSet read_set(const Options& options, const std::string& set, bool is_in_place_rotation,
                   const LampMap& lamps, const Calibration& calibration) {
  const fs::path path(set);
  const bool folder = fs::is_directory(path);
  AdjustSet read{
      last_component(path), {}, {}, is_in_place_rotation || last_component(path) == "rotation"};
  if (folder) {
    CaptureOptions images = options.images;
    images.images = set;
    read.frames = collect_lamp_frames(
        detect_captured_lamps(images, ImageUse::fixes, lamps, calibration).images);
    read.captures =
        options.position_sd_m ? read_captures_with_truth(path) : read_folder_captures(path);
  } else {
    read.frames = read_detections(path);
    read.captures = read_folder_captures(path.parent_path());
  }
  return read;
}

void run(const CLI::App& app, const Options& options) {
  const CaptureOptions& images = options.images;
  std::vector<std::string> inputs{images.lamps, images.calibration,
                                  images.frontend.classifier.string()};
  for (const auto* sets : {&options.sets, &options.turns}) {
    for (const std::string& set : *sets) {
      inputs.push_back(set);
      const fs::path folder = fs::is_directory(set) ? fs::path(set) : fs::path(set).parent_path();
      for (const char* table : {"captures.csv", "truth.csv"}) {
        const fs::path beside = folder / table;
        const bool fresh = std::find(inputs.begin(), inputs.end(), beside) == inputs.end();
        if (fresh && fs::exists(beside)) inputs.push_back(beside);
      }
    }
  }
  check_outputs_distinct({{"--output", images.output}, {"--refine-map", options.refined_map}},
                         inputs);
  AdjustStepInput input;
  input.lamps = read_overhead_lamps(images.lamps, images.frontend.room);
  input.lamps_file = images.lamps;
  input.calibration = read_calibration(images.calibration);
  input.calibration_file = images.calibration;
  if (images.frontend.readout) input.calibration.camera.readout = images.frontend.readout;
  input.map_sd_m = options.map_sd_m;
  input.position_sd_m = options.position_sd_m;
  input.lens_sd_px = options.lens_sd_px;
  input.motion = options.motion.make_motion_prior();
  input.yaw_rate_sd_rad_per_s = rad_from_deg(options.yaw_rate_sd_deg_per_s.value_or(0));
  input.refine_map = !options.refined_map.empty();
  for (const std::string& set : options.sets) {
    input.sets.push_back(read_set(options, set, false, input.lamps, input.calibration));
  }
  for (const std::string& set : options.turns) {
    input.sets.push_back(read_set(options, set, true, input.lamps, input.calibration));
  }
  std::vector<std::string> paths = options.sets;
  paths.insert(paths.end(), options.turns.begin(), options.turns.end());
  make_set_names_unique(input.sets, paths);
  for (const AdjustSet& set : input.sets)
    check_map_has_lamps(set.frames, input.lamps, input.lamps_file);
  const AdjustStepResult result = run_adjust_step(input, make_command_entry(app, inputs));
  print_step_remarks(result);
  require_success(result);
  if (input.refine_map) {
    write_refined_map(options.refined_map, result.adjustment.refined_map, images.frontend.room);
  }
  write_calibration(images.output, result.calibration);
  const auto& report = input.calibration.intrinsics_report;
  const bool lens_stated = input.lens_sd_px || (report && report->covariance);
  print_adjustment(result.adjustment, input.calibration, lens_stated);
}

void add_options(CLI::App& app, Options& options) {
  app.add_option("sets", options.sets,
                 "Folders of images, or tables with columns image, lamp, u_px, v_px [, sigma_px]")
      ->option_text("SET...");
  app.add_option("--turn", options.turns, "Further sets, each a rotation in place")
      ->option_text("SET...");
  app.add_option("--lamps", options.images.lamps,
                 "Lamp map, lamps.yaml. Without sd_m it needs --map-sd-m")
      ->required();
  app.add_option("--calibration", options.images.calibration,
                 "Calibration of the camera. Its rotation center, if any, is the initial value")
      ->required();
  app.add_option("-o,--output", options.images.output,
                 "Output file of the calibration with its adjustment, YAML")
      ->required();
  app.add_option("--refine-map", options.refined_map,
                 "Output file of the lamp map with the estimated positions, YAML. The covariance "
                 "of the output calibration then refers to this map")
      ->option_text("FILE");
  app.add_option("--map-sd-m", options.map_sd_m,
                 "Standard deviation per axis of lamp positions without sd_m, in m")
      ->check(make_non_negative_validator());
  app.add_option("--position-sd-m", options.position_sd_m,
                 "Standard deviation per axis of known positions without position_sd_m, in m. Also "
                 "uses truth.csv in folders of images (default: such positions are ignored)")
      ->check(make_positive_validator());
  app.add_option(
         "--lens-sd-px", options.lens_sd_px,
         "Standard deviation of each lens parameter, as RMS displacement of the image, in px. For "
         "calibrations without lens covariance; the lens is then estimated (default: exact lens)")
      ->check(make_positive_validator())
      ->check(CLI::Range(1e-3, 1e3));  // px; smaller: exact lens, larger: unusable lens
  add_motion_options(
      app, options.motion,
      "Maximum speed of the camera, in m/s. Estimates the motion of each capture unless "
      "captures.csv has it (default: motion of captures.csv, or 0)");
  add_yaw_rate_sd(app, options.yaw_rate_sd_deg_per_s);
  add_lamp_options(app, options.images);
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  const auto parser = vlp::make_app(
      "Estimates tilt and lever arm of a camera, lamp positions and lens jointly from sets of "
      "captures, with their joint covariance. A set may be a rotation in place, a drive, or "
      "captures at known positions or several heights. The lens is corrected within the covariance "
      "of its calibration.\n\n"
      "The file captures.csv in the folder of a set may have these columns:\n"
      "  pivot                 rotation in place to which the capture belongs\n"
      "  x_m, y_m, z_m         known position, with reference_point (camera or axis)\n"
      "                        and position_sd_m\n"
      "  vx_m_per_s, vy_m_per_s, yaw_rate_rad_per_s\n"
      "                        motion in the level frame of the camera, with\n"
      "                        velocity_sd_m_per_s\n"
      "  roll_rad, pitch_rad   inclination\n\n"
      "A set named rotation is a rotation in place.\n\n"
      "Example, from the project's folder:\n"
      "  build/bin/vlp-adjust datasets/example/detections.csv \\\n"
      "    --turn datasets/example/turning.csv \\\n"
      "    --lamps datasets/example/lamps.yaml --map-sd-m 0.002 \\\n"
      "    --calibration datasets/example/calibration.yaml -o adjusted.yaml \\\n"
      "    --refine-map refined.yaml\n",
      "vlp-adjust");
  CLI::App& app = *parser;
  vlp::Options options;
  vlp::add_options(app, options);
  return vlp::parse_and_run(app, argc, argv, [&] {
    if (options.sets.empty() && options.turns.empty()) {
      throw std::invalid_argument("SET: missing; give a folder of images or a table of detections");
    }
    vlp::run(app, options);
  });
}
