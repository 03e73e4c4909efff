// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "camera/lens.h"
#include "geometry/frames.h"
#include "geometry/types.h"
#include "positioning/correlated_errors.h"
#include "positioning/pose_estimation.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"

namespace vlp {

/// Returns the indices in the map of the lamps that are fully visible to a camera with its level
/// frame at `level`. Such a lamp has its center, and its outline if the size is known, above the
/// camera and within the image. `camera_from_level` is the identity for a level camera.
std::vector<std::size_t> list_visible_lamps(const LampMap& map, const Lens& lens,
                                            const std::array<int, 2>& imager_px,
                                            const Eigen::Matrix3d& camera_from_level,
                                            const Pose& level);

/// Predicted covariances of the fix (X, Y, Z, yaw) of a calibrated camera, one per error source, in
/// m and rad. `noise` is independent between images. `lens`, `zenith`, `offset` and `lamp_map` are
/// common to all fixes of a camera (CommonErrors::isolate_error_source()).
struct UnitBudget {
  Matrix4 noise, lens, zenith, offset, lamp_map;
  /// Increase of `noise` due to unknown motion, and the further increase due to unknown roll and
  /// pitch (BodyPoseBound). Independent between images, too.
  Matrix4 motion = Matrix4::Zero(), roll_pitch = Matrix4::Zero();

  Matrix4 common_covariance() const { return lens + zenith + offset + lamp_map; }
  Matrix4 total_pose_covariance() const {
    return noise + motion + roll_pitch + common_covariance();
  }
};

/// Predicts the covariance of a calibrated camera's fixes from pixel noise and from the reported
/// uncertainties of calibration and lamp map. Uncertainties that are not reported count as zero.
class UnitErrors {
 public:
  /// Applies every correction of the calibration.
  /// @throws std::invalid_argument if the intrinsics do not match the lens model
  UnitErrors(const LampMap& map, const Calibration& calibration);

  const CommonErrors& common_errors() const { return whole_; }
  bool has_offset_errors() const { return has_offset_; }

  /// Returns the indices in the map of the lamps that are fully visible to the camera with its
  /// calibrated tilt. `level` is the pose of its level frame. Such a lamp has its center, and its
  /// rim if the diameter is known, in the image.
  std::vector<std::size_t> list_visible_lamps(const Pose& level) const;

  /// Computes the budget of a fix from these lamps, with noise `noise_px` per axis. The camera may
  /// move and be tilted as in compute_fix_budget(). Agrees with the covariance of
  /// Positioner::compute_position_fix(). Returns std::nullopt as compute_pose_crlb(), and for more
  /// than kMaxSightings lamps.
  /// @pre the calibration has row time and readout direction if the prior leaves the motion free
  std::optional<UnitBudget> compute_budget(const Pose& level, std::span<const std::size_t> lamps,
                                           double noise_px, const BodyPrior& prior = {}) const;

 private:
  LampMap map_;
  Camera camera_;
  Lens lens_;
  Eigen::Matrix3d camera_from_level_;
  CommonErrors whole_;
  std::array<CommonErrors, kCommonErrorSources.size()> parts_;
  bool has_offset_;
};

}  // namespace vlp
