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
    if (!options.plot.empty()) throw std::invalid_argument("--plot is of a turn on the spot");
    return run_rotation_by_lamps(app, options.images, options.level);
  }
  for (const char* of_lamps : {"--refine-map", "--captures", "--max-speed-m-per-s",
                               "--max-yaw-rate-deg-per-s", "--yaw-rate-sd-deg-per-s"}) {
    if (app.count(of_lamps) == 0) continue;
    throw std::invalid_argument(std::string(of_lamps) + " needs --method lamps");
  }
  run_rotation_in_place(app, options.images, options.method, options.plot);
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  CLI::App app(
      "Finds the rotation center of a camera, and so its tilt, from captures while it turns on "
      "the\n"
      "spot about a vertical axis: at least three over 90 degrees, better twelve over a full "
      "turn,\n"
      "by angles that need not be known. At one height, under lamps at one height, a camera that\n"
      "sits beside the axis cannot be told from one that leans; captures at two heights or more,\n"
      "in the same folder, tell both.\n\n"
      "Example, from the project's folder:\n"
      "  build/bin/vlp-rotation datasets/example/turning.csv \\\n"
      "    --lamps datasets/example/lamps.yaml \\\n"
      "    --calibration datasets/example/calibration.yaml -o rotated.yaml \\\n"
      "    --plot rotation.png\n",
      "vlp-rotation");
  vlp::Options options;
  vlp::add_capture_options(
      app, options.images,
      {"detections.csv: image, lamp, u_px, v_px [, sigma_px]; or a folder of images",
       "Calibration of the camera; a rotation center in it is replaced",
       "Where to write the calibration with its rotation center"});
  app.add_option(
         "--method", options.method,
         "axis (default): the direction about which all lamp rays turn, exact with tilt and "
         "lens; joint: one center in the undistorted image for all lamps; circle: the mean "
         "of a circle per lamp; lamps: level the camera from captures taken anywhere, while "
         "driving, that see three lamps or more")
      ->check(CLI::IsMember({"axis", "joint", "circle", "lamps"}))
      ->option_text("axis|joint|circle|lamps");
  app.add_option(
         "--refine-map", options.level.refined_map,
         "With --method lamps: correct the lamp map, too, and write it to this file; place, "
         "turn about the vertical and size of the map as a whole stay")
      ->option_text("FILE");
  app.add_option("--captures", options.level.captures,
                 "With --method lamps: captures.csv: image, vx_m_per_s, vy_m_per_s, "
                 "yaw_rate_rad_per_s, velocity_sd_m_per_s (odometry, in the level camera); "
                 "default: captures.csv in the folder");
  vlp::add_motion_options(
      app, options.level.motion,
      "With --method lamps: the camera drives, so fast at most: its velocity is estimated from "
      "each image (default: as captures.csv says, or else it stands)");
  vlp::add_yaw_rate_sd_option(app, options.level.yaw_rate_sd_deg_per_s);
  app.add_option("--plot", options.plot,
                 "Where to draw lamps, circles, rotation center and principal point, .png or .svg");
  return vlp::run_app(app, argc, argv, [&] { vlp::run(app, options); });
}
