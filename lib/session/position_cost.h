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

/// Light of a period group in an image.
struct GroupedLight {
  /// Index into RowTimeCandidates::groups.
  std::size_t group;
  Eigen::Vector2d pixel;
  double sigma_px;
};

/// Lights of one image, at most one of each period group.
struct GroupedLights {
  /// Width and height.
  std::array<int, 2> size_px;
  std::vector<GroupedLight> lights;
};

/// Computes how badly the places of the lights in the images fit those of the lamps that each
/// candidate assigns to them.
///
/// @param images  only those with three lights or more count
/// @param lens    std::nullopt: a pinhole camera with half of the image's diagonal as focal length
/// @return        cost of each candidate, in the unit of RowTimeCandidate::cost; all 0 where no
///                image counts
///
/// In each image the pose of a camera below the lamps, which leans by 0.15 rad (sd), is fitted to
/// the lights with a lamp. fix_body_frame() leaves a minority of wrong ones out, where four agree,
/// and refuses a mirrored map. The squared residual of a light is
///
///     r^2 = |pixel - predicted pixel|^2 / sd^2 + (lean / 0.15 rad)^2 / lights,
///     sd^2 = sigma_px^2 + (spread_px max(e, sd_m / spread_m))^2,
///
/// spread_px and spread_m the root mean squared distances of the lights and of their lamps from
/// their mean, sd_m the one that the map states, and e = 0.03 with a lens (what a lamp map that was
/// measured by hand, and a camera that drives, change), 0.1 without (distortion and lamps at
/// several heights as well). It is kMaxResidualSds^2 at most, and of lights without a lamp or in an
/// image without a pose. The cost is
///
///     sum over groups of log(1 + median over images of r^2):
///
/// an error of the map or of the lens is the same in all images, so that images do not add up.
std::vector<double> compute_position_costs(const RowTimeCandidates& found,
                                           std::span<const GroupedLights> images,
                                           const LampMap& lamps, const std::optional<Lens>& lens);

}  // namespace vlp
