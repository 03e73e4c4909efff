// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-locate: estimates camera positions from identified lamps in images.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "geometry/angles.h"
#include "program/app.h"
#include "program/progress.h"
#include "program/steps/capture_options.h"
#include "program/steps/print_fixes.h"
#include "program/steps/step_outcome.h"
#include "rig/detection.h"
#include "session/locate_step.h"
#include "session/session_folder.h"

namespace vlp {
namespace {

const std::map<std::string, Correction> kCorrections{{"none", Correction::none},
                                                     {"rotation", Correction::rotation},
                                                     {"dispersion", Correction::dispersion},
                                                     {"all", Correction::all}};

struct Options {
  CaptureOptions images;
  /// File captures.csv; empty: the one in the folder, if it exists.
  std::string captures;
  std::string poses;
  std::string correction = "all";
  std::optional<double> sigma_px;
  std::optional<double> inclination_sigma_deg;
  std::optional<std::array<double, 4>> camera_on_robot;
  bool one_lamp = false;
  MotionOptions motion;
  std::optional<double> yaw_rate_sd_deg_per_s;
  std::optional<double> roll_pitch_sd_deg, height_sd_m, yaw_sd_deg;
  int window_size = 1;
};

/// Reads the table of the captures: the named file, or the one in the folder of images.
CapturesTable read_captures(const Options& options) {
  if (!options.captures.empty()) return read_captures_csv(options.captures);
  const bool folder = std::filesystem::is_directory(options.images.images);
  CapturesTable captures = folder ? read_folder_captures(options.images.images) : CapturesTable{};
  if (captures.empty() &&
      (options.one_lamp || options.inclination_sigma_deg || options.height_sd_m ||
       options.yaw_rate_sd_deg_per_s || options.window_size > 1)) {
    throw std::invalid_argument(
        "--one-lamp, --inclination-sigma-deg, --height-sd-m, --yaw-rate-sd-deg-per-s and --window "
        "need captures.csv; give --captures");
  }
  const auto any_capture = [&](const auto& has) {
    return std::any_of(captures.begin(), captures.end(),
                       [&](const auto& capture) { return has(capture.second); });
  };
  if (options.window_size > 1) {
    if (!options.motion.max_speed_m_per_s &&
        !any_capture([](const Capture& capture) { return capture.velocity_m_per_s.has_value(); })) {
      throw std::invalid_argument(
          "--window needs --max-speed-m-per-s, or velocities in captures.csv");
    }
    if (!any_capture([](const Capture& capture) { return capture.time_s.has_value(); })) {
      throw std::invalid_argument("--window needs time_s in captures.csv");
    }
  }
  if (options.yaw_sd_deg &&
      !any_capture([](const Capture& capture) { return capture.yaw_rad.has_value(); })) {
    throw std::invalid_argument("--yaw-sd-deg needs yaw_rad in captures.csv");
  }
  if (options.height_sd_m &&
      !any_capture([](const Capture& capture) { return capture.z_m.has_value(); })) {
    throw std::invalid_argument("--height-sd-m needs z_m in captures.csv");
  }
  return captures;
}

/// Returns the input from the options, without the frames.
LocateInput make_input(const Options& options, const CapturesTable& captures) {
  LocateInput input{{},
                    read_lamps_of_room(options.images.lamps, options.images.frontend.room),
                    read_calibration(options.images.calibration),
                    captures};
  if (const auto& readout = options.images.frontend.readout) {
    input.calibration.camera.readout = readout;
  }
  input.sigma_px = options.sigma_px;
  input.positioner_options.correction = kCorrections.at(options.correction);
  if (const auto& mount = options.camera_on_robot) {
    input.positioner_options.mount =
        CameraMount{{(*mount)[0], (*mount)[1], (*mount)[2]}, rad_from_deg((*mount)[3])};
  }
  input.inclination_sigma_rad = rad_from_deg(options.inclination_sigma_deg.value_or(0));
  input.allow_single_lamp = options.one_lamp;
  input.yaw_sd_rad = rad_from_deg(options.yaw_sd_deg.value_or(0));
  input.motion = options.motion.make_motion_prior();
  input.yaw_rate_sd_rad_per_s = rad_from_deg(options.yaw_rate_sd_deg_per_s.value_or(0));
  input.roll_pitch_sd_rad = rad_from_deg(options.roll_pitch_sd_deg.value_or(0));
  input.height_sd_m = options.height_sd_m;
  input.window_size = options.window_size;
  return input;
}

LocateResult locate_in_images(const Options& options, LocateInput input) {
  check_outputs(options.images);
  const LampImages images = make_lamp_images(options.images, input.lamps, input.calibration);
  LocateResult found;
  {
    Progress progress("images");
    found = locate_from_images(
        images, ImageUse::fixes, std::move(input), options.images.frontend,
        [&](std::size_t done, std::size_t total) { progress.update(done, total); });
  }
  print_lights(found.observations);
  return found;
}

void run(Options options) {
  std::vector<std::string> inputs = list_capture_files(options.images);
  inputs.push_back(options.captures);
  check_outputs_distinct({{"--output", options.images.output}, {"--poses", options.poses}}, inputs);
  if (!options.poses.empty() && !options.roll_pitch_sd_deg && !options.inclination_sigma_deg) {
    throw std::invalid_argument(
        "--poses needs estimated roll and pitch; give --roll-pitch-sd-deg or "
        "--inclination-sigma-deg");
  }
  const CapturesTable captures = read_captures(options);
  options.images.captures = captures;
  if (const auto& mount = options.camera_on_robot) {
    options.images.yaw_in_robot_rad = rad_from_deg((*mount)[3]);
  }
  LocateInput input = make_input(options, captures);
  LocateResult found;
  if (std::filesystem::is_directory(options.images.images)) {
    found = locate_in_images(options, std::move(input));
  } else {
    input.frames = read_detected_captures(options.images);
    found = locate_from_detections(input);
  }
  print_step_remarks(found);
  if (found.rows.empty()) require_success(found);
  write_fixes(options.images.output, found.rows);
  if (!options.poses.empty()) write_poses(options.poses, found.poses);
  print_fix_summary(found.summary);
  require_success(found);
}

/// Adds the options of motion, roll and pitch, mount, and of the values in captures.csv.
void add_sensor_options(CLI::App& app, Options& options) {
  app.add_option("--inclination-sigma-deg", options.inclination_sigma_deg,
                 "Standard deviation of each angle of the inclination sensor, in degrees. Roll and "
                 "pitch are then estimated together with the position (default: 0, exact)")
      ->check(make_non_negative_validator());
  app.add_option("--camera-on-robot", options.camera_on_robot,
                 "Position and yaw of the camera in the frame of the robot, in m and degrees. "
                 "Fixes and poses are then of the robot center")
      ->check(make_finite_validator())
      ->option_text("X_M Y_M Z_M YAW_DEG");
  CLI::Option* const one_lamp =
      app.add_flag("--one-lamp", options.one_lamp,
                   "Use z_m and yaw_rad of captures.csv for captures with one visible lamp");
  app.add_option("--yaw-sd-deg", options.yaw_sd_deg,
                 "Standard deviation of yaw_rad in captures.csv for --one-lamp, in degrees "
                 "(default: 0, exact). For z_m use --height-sd-m")
      ->check(make_non_negative_validator())
      ->needs(one_lamp);
  add_motion_options(app, options.motion,
                     "Maximum speed of the camera or robot, in m/s. Estimates the motion of each "
                     "capture unless captures.csv has it (default: motion of captures.csv, or 0)");
  add_yaw_rate_sd(app, options.yaw_rate_sd_deg_per_s);
  app.add_option("--roll-pitch-sd-deg", options.roll_pitch_sd_deg,
                 "Standard deviation of roll and pitch about level, in degrees, for captures "
                 "without inclination. Estimates both from each image; 90: unknown, needs three "
                 "lamps or more (default: 0, level)")
      ->check(make_non_negative_validator());
  app.add_option("--height-sd-m", options.height_sd_m,
                 "Standard deviation of z_m in captures.csv, in m. All fixes then use z_m, which "
                 "also selects among several solutions for three lamps (default: only --one-lamp "
                 "uses z_m, as exact)")
      ->check(make_positive_validator());
  app.add_option("--window", options.window_size,
                 "Number of captures in a joint fix with one velocity (default: 1). 2 includes the "
                 "previous capture if its time_s in captures.csv is within 0.2 s")
      ->check(CLI::Range(1, 2));
}

void add_options(CLI::App& app, Options& options) {
  add_capture_options(
      app, options.images,
      {"Detections, detections.csv: image, lamp, u_px, v_px [, sigma_px]; or a folder of images",
       "Calibration of the camera", "Output file of fixes, CSV"});
  app.add_option("--correction", options.correction,
                 "Parts of the calibration to apply (default: all existing parts)")
      ->check(CLI::IsMember({"none", "rotation", "dispersion", "all"}))
      ->option_text("none|rotation|dispersion|all");
  app.add_option("--sigma-px", options.sigma_px,
                 "Standard deviation of lamp positions in the image, per axis, in px. Overrides "
                 "the column sigma_px (default: sigma_px, or estimated from the residuals). Larger "
                 "residuals increase it")
      ->check(CLI::Range(kMinSigma_px, kMaxSigma_px));
  app.add_option(
      "--captures", options.captures,
      "Table of captures, captures.csv: image, time_s; roll_rad, pitch_rad (inclination); "
      "vx_m_per_s, vy_m_per_s, yaw_rate_rad_per_s, velocity_sd_m_per_s (odometry); z_m, yaw_rad. "
      "Inclination and odometry are those of the robot with --camera-on-robot, otherwise of the "
      "camera (default: captures.csv in the folder)");
  app.add_option("--poses", options.poses,
                 "Output file of poses: position and orientation (quaternion) with covariance of "
                 "each fix with estimated roll and pitch, CSV");
  add_sensor_options(app, options);
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  const auto parser = vlp::make_app(
      "Estimates camera positions from the lamps in images. Reads detections.csv or a folder of "
      "images, and writes fixes.csv.\n\n"
      "Example, from the project's folder:\n"
      "  build/bin/vlp-locate datasets/example/detections.csv \\\n"
      "    --lamps datasets/example/lamps.yaml \\\n"
      "    --calibration datasets/example/calibration.yaml -o fixes.csv\n",
      "vlp-locate");
  CLI::App& app = *parser;
  vlp::Options options;
  vlp::add_options(app, options);
  return vlp::parse_and_run(app, argc, argv, [&] { vlp::run(options); });
}
