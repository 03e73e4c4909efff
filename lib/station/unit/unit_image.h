// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <functional>
#include <string>

#include "frontend/observation.h"

namespace vlp {

/// Image of a unit, with its observation.
struct UnitImage {
  Observation seen;
  std::string sha256;
  /// The file no longer exists: a frame of a camera or a video that was rejected.
  bool discarded = false;
  /// Rotation level_from_camera with which the lamps were detected; zero for the calibrated one.
  Eigen::Matrix3d level = Eigen::Matrix3d::Zero();

  bool is_used() const { return seen.is_kept(); }
  /// Returns true for an image without a fault that is redundant because of others.
  bool is_redundant() const { return !is_used() && vlp::is_redundant(seen.rejection->reason); }
  /// Reason for the rejection, in one line; empty if the image is used.
  std::string refusal() const { return is_used() ? "" : seen.rejection->message; }
};

/// Observes an image file by `observe`, the intake of a step. A file that cannot be read is
/// rejected.
UnitImage observe_unit_image(const std::filesystem::path& file,
                             const std::function<Observation(const SourceImage&)>& observe);

}  // namespace vlp
