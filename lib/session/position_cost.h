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
#include "lamps/signal/row_time.h"
#include "rig/lamp_map.h"

namespace vlp {

/// Light in an image, with the group of equal stripe periods to which it belongs.
struct GroupedLight {
  /// Index in RowTimeCandidates::groups of the lights with this stripe period.
  std::size_t period_group;
  Eigen::Vector2d pixel;
  double sigma_px;
};

/// Lights of one image, at most one of each period group.
struct GroupedLights {
  /// Width and height of the image.
  std::array<int, 2> size_px;
  std::vector<GroupedLight> lights;
};

/// Computes the position cost of each candidate: the mismatch between the positions of the lights
/// in the images and the positions of the lamps that the candidate assigns to them.
///
/// @param images  images with fewer than three lights are ignored
/// @param lens    std::nullopt: a pinhole camera with half of the image's diagonal as focal length
/// @return        cost of each candidate, in the unit of RowTimeCandidate::cost; all 0 if no image
///                has three lights
///
/// In each image the pose of a camera below the lamps is fitted to the lights with a lamp; its roll
/// and pitch have a prior of 0.15 rad (sd). estimate_pose_robustly() rejects a minority of
/// wrong lights if four agree, and rejects a mirrored map. The squared residual of a light is
///
///     r^2 = |pixel - predicted pixel|^2 / sd^2 + (lean / 0.15 rad)^2 / lights,
///     sd^2 = sigma_px^2 + (spread_px max(e, sd_m / spread_m))^2
///
/// with
///
///     lean       tilt by roll and pitch
///     spread_px  root mean squared distance of the lights from their mean
///     spread_m   root mean squared distance of their lamps from their mean
///     sd_m       standard deviation of the lamp positions in the map
///     e          0.03 with a lens: covers a lamp map measured by hand and a moving camera;
///                0.1 without: covers distortion and lamps at several heights as well
///
/// r^2 is limited to kMaxResidualSds^2, the value for lights without a lamp or in an image without
/// a pose. The cost is
///
///     sum over groups of log(1 + median over images of r^2).
///
/// An error of the map or of the lens is the same in all images; therefore images are not summed.
std::vector<double> compute_position_costs(const RowTimeCandidates& found,
                                           std::span<const GroupedLights> images,
                                           const LampMap& lamps, const std::optional<Lens>& lens);

}  // namespace vlp
