// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/consistent_fix.h"

#include <algorithm>
#include <cmath>

#include "positioning/initial_pose.h"

namespace vlp {
namespace {

bool agree(std::span<const Sighting> sightings, const Pose& pose, double max_residual) {
  const LevelPose camera(pose);
  return std::all_of(sightings.begin(), sightings.end(), [&](const Sighting& sighting) {
    return (sighting.z - predicted_z(camera, sighting.lamp_m)).norm() <= max_residual;
  });
}

}  // namespace

ConsistentFix fix_consistent(std::span<const Sighting> sightings, double max_residual) {
  const InitialPose start = initial_pose(sightings);
  if (start.status != FixStatus::ok) return {start.status, {}};
  const auto fix = fix_weighted(sightings, start.pose);
  if (!fix) return {FixStatus::degenerate, {}};
  const double height_m = sightings.front().lamp_m.z() - fix->pose.position_m.z();
  if (!(fix->covariance(2, 2) < height_m * height_m)) return {FixStatus::degenerate, *fix};
  if (sightings.size() > 2 && !agree(sightings, fix->pose, max_residual)) {
    return {FixStatus::inconsistent, *fix};
  }
  return {FixStatus::ok, *fix};
}

double spread_of(std::span<const Sighting> sightings) {
  const double n = static_cast<double>(sightings.size());
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Sighting& sighting : sightings) mean += sighting.z / n;
  double sum = 0;
  for (const Sighting& sighting : sightings) sum += (sighting.z - mean).squaredNorm();
  return std::sqrt(sum / n);
}

}  // namespace vlp
