// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "captures/detections_table.h"
#include "detection/image_source.h"
#include "detection/lights_table.h"
#include "lamps/light_detector.h"

namespace vlp {

/// What was found in many captures.
struct CaptureDetections {
  /// Lamps fit for a fix, by image, maybe none.
  std::vector<Frame> frames;
  /// All lights of each frame's image, without outlines.
  std::vector<LightsOfImage> lights;
  /// Images that could not be used, and why, in one line each.
  std::vector<std::string> refused;
  /// All of them, in their order.
  std::vector<std::filesystem::path> images;
  /// Images that were read out the other way than the detector has it.
  int other_readouts = 0;
  /// Of frames of videos, since the video's start, by the name that the frame has in `frames`.
  std::map<std::string, double> times_s;
};

/// level_from_camera of images, by name; nothing: nobody knows (LightDetector::leaning).
using LevelsOfImages = std::map<std::string, std::optional<Eigen::Matrix3d>>;

/// The detector for the image of that name, unless it is the one that all have.
std::optional<LightDetector> leaning_detector(const LightDetector& detector,
                                              const LevelsOfImages& levels,
                                              const std::string& image);

struct DetectRun {
  /// Images at a time.
  int threads;
  /// What the images have to have.
  std::optional<std::array<int, 2>> imager_px = std::nullopt;
  /// A folder that is there, for pictures of what was found in each image, see annotated().
  std::optional<std::filesystem::path> annotate = std::nullopt;
  /// Larger images are refused unread.
  double max_mpx = kUsualMaxMpx;
  /// Whether an image may be read out the other way than the detector has it, see
  /// detect_either_way().
  bool any_readout = false;
  /// Of those whose camera leans otherwise than the detector's.
  LevelsOfImages levels = {};
};

/// Detects in each image. An image that cannot be used is refused and does not end it; a picture
/// that cannot be written does (InputError). The result does not depend on the threads. `progress`
/// gets the images done so far; its calls do not overlap.
CaptureDetections detect_captures(const LightDetector& detector, ImageSource& images,
                                  const DetectRun& run,
                                  const std::function<void(std::size_t done)>& progress);

}  // namespace vlp
