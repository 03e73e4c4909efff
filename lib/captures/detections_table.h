// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "rig/detection.h"

namespace vlp {

/// The lamps seen in one image.
struct Frame {
  std::string image;
  std::vector<Detection> detections;
};

/// Reads `detections.csv`: columns image, lamp, u_px, v_px and, optionally, sigma_px, a field of
/// which may be empty. Frames are in the order in which their images first appear. Throws
/// InputError: see CsvTable; an empty image name; a sigma out of range; one lamp twice in
/// an image; no rows.
std::vector<Frame> read_detections(const std::filesystem::path& file);

/// Writes what read_detections() reads, whole or not at all. Throws InputError.
void write_detections(const std::filesystem::path& file, const std::vector<Frame>& frames);

}  // namespace vlp
