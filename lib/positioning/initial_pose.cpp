// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/initial_pose.h"

#include <algorithm>
#include <cmath>

#include "geometry/similarity.h"
#include "positioning/two_lamp_fix.h"

namespace vlp {

namespace {

constexpr double kSameHeight_m = 1e-6;

bool at_one_height(std::span<const Sighting> sightings) {
  return std::all_of(sightings.begin(), sightings.end(), [&](const Sighting& sighting) {
    return std::abs(sighting.lamp_m.z() - sightings.front().lamp_m.z()) <= kSameHeight_m;
  });
}

const Sighting& farthest_from(const Sighting& from, std::span<const Sighting> sightings) {
  return *std::max_element(sightings.begin(), sightings.end(),
                           [&](const Sighting& a, const Sighting& b) {
                             return (a.z - from.z).squaredNorm() < (b.z - from.z).squaredNorm();
                           });
}

/// Returns the sum of the squared residuals in z. A lamp that is not above the pose adds 1e6.
double disagreement(const Pose& pose, std::span<const Sighting> sightings) {
  const LevelPose camera(pose);
  double sum = 0;
  for (const Sighting& sighting : sightings) {
    sum += height_above(camera, sighting.lamp_m) > 0
               ? (sighting.z - predict_z(camera, sighting.lamp_m)).squaredNorm()
               : 1e6;
  }
  return sum;
}

}  // namespace

InitialPose compute_initial_pose(std::span<const Sighting> sightings) {
  if (sightings.size() > 2 && at_one_height(sightings)) {
    const auto pose = compute_coplanar_pose(sightings);
    if (!pose) return {FixStatus::degenerate, {}};
    return {FixStatus::ok, *pose};
  }
  const Sighting& first = farthest_from(sightings.front(), sightings);
  const TwoLampPoses pair = compute_two_lamp_poses(first, farthest_from(first, sightings));
  if (pair.count == 0) {
    return {pair.lamp_below_camera ? FixStatus::lamp_below_camera : FixStatus::degenerate, {}};
  }
  if (pair.count == 1) return {FixStatus::ok, pair.poses[0]};
  if (sightings.size() == 2) return {FixStatus::ambiguous, {}};
  const bool second =
      disagreement(pair.poses[1], sightings) < disagreement(pair.poses[0], sightings);
  return {FixStatus::ok, pair.poses[second ? 1 : 0]};
}

std::optional<Pose> compute_coplanar_pose(std::span<const Sighting> sightings) {
  const auto similarity = fit_similarity(
      sightings.size(), [&](std::size_t i) { return sightings[i].z; },
      [&](std::size_t i) -> Eigen::Vector2d { return sightings[i].lamp_m.head<2>(); });
  if (!similarity) return std::nullopt;
  double ceiling_m = 0;
  for (const Sighting& sighting : sightings) ceiling_m += sighting.lamp_m.z();
  ceiling_m /= static_cast<double>(sightings.size());
  const Eigen::Vector2d& c = similarity->factor;
  return Pose{{similarity->offset.x(), similarity->offset.y(), ceiling_m - c.norm()},
              std::atan2(c.y(), c.x())};
}

}  // namespace vlp
