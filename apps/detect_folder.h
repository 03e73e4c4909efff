// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app.h"
#include "detection/detect_captures.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"

namespace vlp {

/// How to find the lamps in a folder of images. Names of files are for messages, too.
struct DetectOptions {
  std::string folder, lamps, calibration, output;
  /// Empty: lamps are told apart by the map's frequencies.
  std::string classifier;
  /// Where pictures of what was found go; empty: none are made.
  std::string annotate;
  std::optional<Readout> readout;
  /// Of a camera without a calibration.
  std::optional<double> row_time_s;
  std::optional<double> exposure_s;
  int threads = all_cores();
};

/// What the result depends on: captures, lamp map, calibration, classifier; an empty name is an
/// input that was not given.
std::vector<std::string> inputs_of(const DetectOptions& options);

/// Throws InputError when no lamp has a frequency.
void check_frequencies(const LampMap& lamps, const std::string& lamps_file);

/// Throws InputError when the map has none of the lamps that the captures show.
void check_lamps(const std::vector<Frame>& frames, const LampMap& lamps,
                 const std::string& lamps_file);

/// Adds --classifier, --annotate, --readout, --exposure-s and --threads.
void add_detect_options(CLI::App& app, DetectOptions& options);

/// The lamps in a folder of images, `threads` at a time, with progress and a warning for each image
/// that is skipped, for each two lamps of the map that are too much alike; `output` must not be one
/// of the images. Throws InputError: no row time, no frequency, no image, a classifier of other
/// lamps or of another row time; Undetermined when no lamp is identified.
CaptureDetections detect_folder(const DetectOptions& options, const LampMap& lamps,
                                const std::optional<Calibration>& calibration);

/// The captures of a detections.csv, or of a folder of images: detect_folder(). Throws
/// std::invalid_argument when options for images are given with a table.
std::vector<Frame> frames_of(const DetectOptions& options, const LampMap& lamps,
                             const Calibration& calibration);

}  // namespace vlp
