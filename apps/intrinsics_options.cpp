// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "intrinsics_options.h"

#include "app.h"
#include "readout_option.h"

namespace vlp {
namespace {

/// NAME=VALUE of a gate.
std::string gate_problem(const std::string& text) {
  const std::size_t sign = text.find('=');
  const std::string name = text.substr(0, sign);
  if (name != "rms_px" && name != "uncertainty_px" && name != "halves_px") {
    return "the gates are rms_px, uncertainty_px and halves_px, not '" + name + "'";
  }
  if (sign == std::string::npos) return "a gate is NAME=VALUE";
  std::string value = text.substr(sign + 1);
  return finite_positive()(value);
}

/// Of a text without a problem.
void set_gate(IntrinsicsGates& gates, const std::string& text) {
  const std::size_t sign = text.find('=');
  const std::string name = text.substr(0, sign);
  const double value = std::stod(text.substr(sign + 1));
  if (name == "rms_px") gates.rms_px = value;
  if (name == "uncertainty_px") gates.uncertainty_px = value;
  if (name == "halves_px") gates.halves_px = value;
}

}  // namespace

void add_intrinsics_options(CLI::App& app, IntrinsicsOptions& options) {
  app.add_option("images", options.images, "Images of the board, or folders of them")->required();
  app.add_option("--board", options.board, "The board, board.yaml")->required();
  app.add_option("-o,--output", options.output,
                 "Where to write the calibration with its camera part; mrcal's .cameramodel and "
                 ".corners.vnl go beside it")
      ->required();
  app.add_option("--camera-id", options.camera_id, "Name of the camera (default: camera)");
  app.add_option("--lens", options.lens, "Lens model (default: LENSMODEL_OPENCV8)")
      ->check([](const std::string& name) {
        return lens_model_from_name(name) ? std::string() : "the models are: " + lens_model_names();
      });
  app.add_option("--row-time-s", options.row_time_s,
                 "Time from one row of the read-out to the next, which every program that finds "
                 "lamps needs; vlp-train --row-time finds it, too")
      ->check(CLI::Range(1e-8, 1e-3));
  add_readout_option(app, options.readout);
  app.add_option("--pixel-pitch-m", options.pixel_pitch_m, "Width of a pixel")
      ->check(CLI::Range(1e-7, 1e-4));
  app.add_option("--held-out", options.held_out,
                 "Keep every Nth view out of the solve, and say how well the lens fits it")
      ->check(CLI::Range(2, 1000))
      ->option_text("N");
  app.add_option_function<std::vector<std::string>>(
         "--gate",
         [&options](const std::vector<std::string>& gates) {
           for (const std::string& gate : gates) set_gate(options.gates, gate);
         },
         "Change a gate: rms_px=1, uncertainty_px=2 (worst over the image), halves_px=1 (rms, "
         "between the lenses of two halves of the views)")
      ->check([](const std::string& text) { return gate_problem(text); })
      ->option_text("NAME=VALUE ...");
  app.add_option("--ros", options.ros, "Write the camera for ROS, too (camera_info)");
  app.add_option("--kalibr", options.kalibr, "Write the camera for Kalibr, too (camchain)");
  app.add_option("--opencv", options.opencv, "Write the camera for OpenCV, too (FileStorage)");
  app.add_option("--plot", options.plot,
                 "Draw the corners, their residuals and the uncertainty over the image, .png or "
                 ".svg")
      ->check([](const std::string& name) {
        const bool known = name.ends_with(".png") || name.ends_with(".svg");
        return known ? std::string() : "a picture's name should end in .png or .svg";
      });
  app.add_option("--cache", options.cache,
                 "Folder to keep the corners of each image in, for the next time");
  app.add_option("--threads", options.threads, "Images at a time (default: one a core)")
      ->check(CLI::Range(1, 1024));
}

}  // namespace vlp
