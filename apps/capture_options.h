// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "detect_folder.h"

namespace vlp {

/// What --help says of the options that every program has which takes captures of lamps.
struct CaptureTexts {
  const char* images;
  const char* calibration;
  const char* output;
};

/// Adds images, --lamps, --calibration, --output, and those of add_detect_options().
void add_capture_options(CLI::App& app, DetectOptions& options, const CaptureTexts& texts);

/// What such a program reads.
struct CaptureInput {
  LampMap lamps;
  Calibration calibration;
  std::vector<Frame> frames;
};

/// Throws what frames_of() and the files' readers throw.
CaptureInput read_captures_of(const DetectOptions& options);

/// Without rotation centre and dispersion.
Calibration camera_alone(const Calibration& calibration);

}  // namespace vlp
