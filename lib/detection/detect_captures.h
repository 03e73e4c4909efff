// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "captures/detections_table.h"
#include "detection/lamp_detector.h"

namespace vlp {

/// What was found in many captures.
struct CaptureDetections {
  /// Lamps fit for a fix, by image, maybe none.
  std::vector<Frame> frames;
  /// Lights of each LightKind, in its order.
  std::array<int, 4> lights{};
  /// Images that could not be used, and why, in one line each.
  std::vector<std::string> refused;
  int images = 0;
};

struct DetectRun {
  /// Images at a time.
  int threads;
  /// A folder that is there, for pictures of what was found in each image, see annotated().
  std::optional<std::filesystem::path> annotate = std::nullopt;
};

/// Detects in each image. An image that cannot be read, or that has another size than `imager_px`,
/// is refused and does not end it; a picture that cannot be written does (InputError). The result
/// does not depend on the threads. `progress` gets the images done so far; its calls do not
/// overlap.
CaptureDetections detect_captures(const LampDetector& detector,
                                  const std::vector<std::filesystem::path>& images,
                                  const std::array<int, 2>& imager_px, const DetectRun& run,
                                  const std::function<void(std::size_t done)>& progress);

}  // namespace vlp
