// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "rig/detection.h"

namespace vlp {

/// The lamps detected in one image.
struct Frame {
  std::string image;
  std::vector<Detection> detections;
};

/// Reads `detections.csv`: the lamps detected in each image, one row per lamp. Columns: image, lamp
/// (id), u_px, v_px and, optionally, sigma_px, whose fields may be empty.
/// @return one frame per image, in the order in which the images first appear
/// @throws InputError as CsvTable; if an image name is empty; if a sigma_px is not within
///     kMinSigma_px and kMaxSigma_px; if a lamp occurs twice in an image; if there are no rows
std::vector<Frame> read_detections(const std::filesystem::path& file);

/// Writes a file for read_detections(), atomically. Throws InputError if it cannot be written.
void write_detections(const std::filesystem::path& file, const std::vector<Frame>& frames);

}  // namespace vlp
