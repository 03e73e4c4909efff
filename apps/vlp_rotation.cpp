// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-rotation: estimates rotation center and tilt of the camera from captures of a rotation in
/// place or of a drive.
#include <CLI/CLI.hpp>
#include <stdexcept>
#include <string>

#include "program/app.h"
#include "program/steps/capture_options.h"
#include "program/steps/rotation_methods.h"

namespace vlp {
namespace {

struct Options {
  CaptureOptions images;
  std::string plot;
  TiltOptions level;
  std::string method = "axis";
};

void run(const CLI::App& app, const Options& options) {
  if (options.method == "lamps") {
    if (!options.plot.empty())
      throw std::invalid_argument("--plot: not available with --method lamps; leave it out");
    return run_tilt_program(app, options.images, options.level);
  }
  for (const char* of_lamps : {"--refine-map", "--captures", "--max-speed-m-per-s",
                               "--max-yaw-rate-deg-per-s", "--yaw-rate-sd-deg-per-s"}) {
    if (app.count(of_lamps) == 0) continue;
    throw std::invalid_argument(std::string(of_lamps) + " needs --method lamps");
  }
  run_rotation_program(app, options.images, options.method, options.plot);
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  const auto parser = vlp::make_app(
      "Estimates the rotation center of a camera, and from it the tilt, from captures while it "
      "rotates in place about a vertical axis. Needs at least three captures over 90 degrees, "
      "better twelve over a full turn. The angles may be unknown. With camera and lamps at one "
      "height each, lever arm and tilt cannot be separated. Captures at two heights or more, in "
      "the same folder, separate them.\n\n"
      "Example, from the project's folder:\n"
      "  build/bin/vlp-rotation datasets/example/turning.csv \\\n"
      "    --lamps datasets/example/lamps.yaml \\\n"
      "    --calibration datasets/example/calibration.yaml -o rotated.yaml \\\n"
      "    --plot rotation.png\n",
      "vlp-rotation");
  CLI::App& app = *parser;
  vlp::Options options;
  vlp::add_capture_options(
      app, options.images,
      {"Detections, detections.csv: image, lamp, u_px, v_px [, sigma_px]; or a folder of images",
       "Calibration of the camera. Its rotation center, if any, is replaced",
       "Output file of the calibration with its rotation center, YAML"});
  app.add_option(
         "--method", options.method,
         "Method. axis (default): common rotation axis of all lamp rays, exact for tilt "
         "and lens. circle: mean center of one circle per lamp in the undistorted image. "
         "lamps: tilt from captures at any position, also while driving, with three visible "
         "lamps or more")
      ->check(CLI::IsMember({"axis", "circle", "lamps"}))
      ->option_text("axis|circle|lamps");
  app.add_option("--refine-map", options.level.refined_map,
                 "Output file of the corrected lamp map, YAML. Position, yaw and scale of the map "
                 "as a whole stay fixed. Only with --method lamps")
      ->option_text("FILE");
  app.add_option("--captures", options.level.captures,
                 "Table of captures, captures.csv: image, vx_m_per_s, vy_m_per_s, "
                 "yaw_rate_rad_per_s, velocity_sd_m_per_s (odometry in the level frame of the "
                 "camera). Only with --method lamps (default: captures.csv in the folder)");
  vlp::add_motion_options(
      app, options.level.motion,
      "Maximum speed of the camera, in m/s. Estimates the motion of each capture unless "
      "captures.csv has it. Only with --method lamps (default: motion of captures.csv, or 0)");
  vlp::add_yaw_rate_sd(app, options.level.yaw_rate_sd_deg_per_s);
  app.add_option("--plot", options.plot,
                 "Output file of a plot of lamps, circles, rotation center and principal point, "
                 ".png or .svg. Not with --method lamps");
  return vlp::parse_and_run(app, argc, argv, [&] { vlp::run(app, options); });
}
