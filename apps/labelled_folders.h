// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "captures/detections_table.h"
#include "detection/detect_lights.h"

namespace vlp {

struct LabelledFolder {
  std::string folder;
  std::vector<std::filesystem::path> images;
  /// Empty without a table.
  std::vector<Frame> labels;
};

/// Folders of images with the table beside them: of that name, or, when it is empty and labels are
/// `needed`, detections.csv or true_detections.csv, the first that is there. Throws InputError.
std::vector<LabelledFolder> labelled_folders(const std::vector<std::string>& folders,
                                             const std::string& table, bool needed);

/// The lights of each folder's images, with progress, and a warning for each image that cannot be
/// used or is not of this size, when there is one; such images have no lights. Throws InputError
/// when none can be used.
std::vector<std::vector<ImageLights>> lights_of(const LampDetector& detector,
                                                const std::vector<LabelledFolder>& folders,
                                                const std::optional<std::array<int, 2>>& imager_px,
                                                int threads);

}  // namespace vlp
