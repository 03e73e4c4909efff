// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "../camera/lens.h"
#include "../geometry/frames.h"
#include "../geometry/types.h"
#include "../rig/calibration.h"
#include "../rig/lamp_map.h"
#include "body_fix.h"
#include "common_errors.h"

namespace vlp {

/// Covariances of (X, Y, Z, yaw) in metres and radians: what of a fix's error is of each image
/// alone, and each part of what all fixes of the unit have in common (CommonErrors::only).
struct UnitBudget {
  Matrix4 noise, lens, zenith, offset, lamp_map;
  /// Of each image, too: what comes on top of `noise` because the camera may move, and then because
  /// it may lean (BodyLimit).
  Matrix4 motion = Matrix4::Zero(), lean = Matrix4::Zero();

  Matrix4 common() const { return lens + zenith + offset + lamp_map; }
  Matrix4 total() const { return noise + motion + lean + common(); }
};

/// What a calibrated camera's fixes are worth before it takes one: the pixels' noise, and what
/// calibration and lamp map state of their own errors. What is not stated counts as exact.
class UnitErrors {
 public:
  /// With every correction that the calibration has. Throws std::invalid_argument when the
  /// intrinsics are not the lens model's.
  UnitErrors(const LampMap& map, const Calibration& calibration);

  const CommonErrors& common() const { return whole_; }
  bool has_offset() const { return has_offset_; }

  /// Indices in the map of the lamps that the camera, which leans as it does, sees whole from
  /// `level`, the pose of its level frame: centre, and rim where the diameter is known.
  std::vector<std::size_t> lamps_seen_from(const Pose& level) const;

  /// Of a fix from these lamps, each with this noise per axis: what Positioner::locate() states
  /// there. Nothing for fewer than two lamps or more than kMaxSightings, lamps that the lens does
  /// not see, or lamps that do not determine a fix.
  std::optional<UnitBudget> budget(const Pose& level, std::span<const std::size_t> lamps,
                                   double noise_px) const;
  /// The same of a camera that may move and lean, as error_budget() has it. Precondition: the
  /// calibration knows its row clock, where the prior lets it move.
  std::optional<UnitBudget> budget(const Pose& level, std::span<const std::size_t> lamps,
                                   double noise_px, const BodyPrior& prior) const;

 private:
  LampMap map_;
  Camera camera_;
  Lens lens_;
  Eigen::Matrix3d camera_from_level_;
  CommonErrors whole_;
  std::array<CommonErrors, kCommonParts.size()> parts_;
  bool has_offset_;
};

}  // namespace vlp
