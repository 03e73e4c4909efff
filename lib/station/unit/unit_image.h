// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <functional>
#include <string>

#include "frontend/observation.h"

namespace vlp {

/// An image of a unit: what was detected in it, and whether the station uses it.
struct UnitImage {
  Observation seen;
  std::string sha256;
  /// The file no longer exists: a frame of a camera or a video that was rejected.
  bool discarded = false;
  /// level_from_camera that the lamps were detected with; zero: the calibrated one.
  Eigen::Matrix3d level = Eigen::Matrix3d::Zero();

  bool is_used() const { return seen.is_kept(); }
  /// Returns true for an image without a fault that others make unnecessary.
  bool is_redundant() const { return !is_used() && vlp::is_redundant(seen.rejection->reason); }
  /// Reason for the rejection, in one line; empty if the image is used.
  std::string refusal() const { return is_used() ? "" : seen.rejection->message; }
};

/// Applies the intake of a step to an image file. A file that cannot be read is rejected.
UnitImage observe_unit_image(const std::filesystem::path& file,
                             const std::function<Observation(const SourceImage&)>& observe);

}  // namespace vlp
