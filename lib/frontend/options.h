// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "rig/calibration.h"

namespace vlp {

/// Options for reading images, for detection and for rejection, shared by programs, sessions and
/// the station.
struct FrontendOptions {
  /// Maximum number of threads, each of which processes one image at a time. At least 1.
  int threads = 1;
  /// Images of more megapixels are rejected before they are decoded.
  double max_mpx = 200;
  /// Step between the frames of a video that are used: every n-th frame, beginning with the first.
  int every = 1;

  /// Board images: largest sigma of the blur of the sharpest edges (measure_image_blur()), as a
  /// fraction of the longer side of the image.
  double max_blur_fraction = 0.003;
  /// Board images: fraction of the board's pixels at full scale above which an image is used only
  /// if the reported standard deviations of its corners are small.
  double max_white_fraction = 0.25;
  /// Board images: level that 1 % of the pixels exceed, as a fraction of the full scale. An image
  /// below it with too few corners is too dark.
  double min_bright_fraction = 0.1;
  /// Largest RMS distance of the corners or lamps of two images that show the same view, as a
  /// fraction of the image width.
  double same_view_fraction = 0.01;

  /// Folder of corners that were detected before (CornerCache); empty: none.
  std::filesystem::path corner_cache = {};
  /// Folder for annotated images of the detected lights; created if missing. Empty: none.
  std::filesystem::path annotate = {};
  /// Lamp classifier by vlp-train; empty: lamps are identified by the map's frequencies.
  std::filesystem::path classifier = {};
  /// Readout direction; overrides that of the calibration. Without either it is estimated from the
  /// images.
  std::optional<Readout> readout = {};
  /// Time from the readout of a row to that of the next, for a camera without a calibration.
  std::optional<double> row_time_s = {};
  /// Room of the lamp map whose lamps are identified (read_lamps_of_room()); empty: all.
  std::string room = {};
  /// Exposure of the images for the check of the lamp map; short if unknown.
  std::optional<double> exposure_s = {};
};

}  // namespace vlp
