// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "locate_options.h"

#include "app.h"
#include "capture_options.h"
#include "rig/detection.h"

namespace vlp {

void add_locate_options(CLI::App& app, LocateOptions& options) {
  add_capture_options(
      app, options.detect,
      {"detections.csv: image, lamp, u_px, v_px [, sigma_px]; or a folder of images",
       "Calibration of the camera", "Where to write fixes.csv"});
  app.add_option("--correction", options.correction,
                 "Parts of the calibration to apply (default: all that it has)")
      ->check(CLI::IsMember({"none", "rotation", "dispersion", "all"}))
      ->option_text("none|rotation|dispersion|all");
  app.add_option(
         "--sigma-px", options.sigma_px,
         "Standard deviation of the lamps' pixels; taken from the residuals when neither it "
         "nor a column says it")
      ->check(CLI::Range(kMinSigma_px, kMaxSigma_px));
  auto* captures_option =
      app.add_option("--captures", options.captures,
                     "captures.csv: image, roll_rad, pitch_rad (inclination of the robot, or of "
                     "the camera when there is no --camera-on-robot), z_m, yaw_rad");
  app.add_option("--inclination-sigma-deg", options.inclination_sigma_deg,
                 "Standard deviation of the inclination sensor's angles (default: left out of sd)")
      ->check(finite_not_negative())
      ->needs(captures_option);
  app.add_option(
         "--camera-on-robot", options.camera_on_robot,
         "The camera's place and yaw on the robot: the fixes are then of the robot's centre")
      ->check(finite())
      ->option_text("X_M Y_M Z_M YAW_DEG");
  app.add_flag("--one-lamp", options.one_lamp,
               "Where one lamp is seen, take z_m and yaw_rad from captures.csv")
      ->needs(captures_option);
}

}  // namespace vlp
