// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "capture_options.h"

namespace vlp {

void add_capture_options(CLI::App& app, DetectOptions& options, const CaptureTexts& texts) {
  app.add_option("images", options.folder, texts.images)->required();
  app.add_option("--lamps", options.lamps, "Lamp map, lamps.yaml")->required();
  app.add_option("--calibration", options.calibration, texts.calibration)->required();
  app.add_option("-o,--output", options.output, texts.output)->required();
  add_detect_options(app, options);
}

CaptureInput read_captures_of(const DetectOptions& options) {
  CaptureInput input{read_lamp_map(options.lamps), read_calibration(options.calibration), {}};
  input.frames = frames_of(options, input.lamps, input.calibration);
  return input;
}

Calibration camera_alone(const Calibration& calibration) {
  Calibration alone;
  alone.camera = calibration.camera;
  return alone;
}

}  // namespace vlp
