// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/closed_form.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/plane.h"
#include "geometry/similarity.h"

namespace vlp {

namespace {

/// Computes the real roots of a x^2 + 2 b x + c, a > 0, without cancellation.
struct Roots {
  int count = 0;
  std::array<double, 2> values{};
};

Roots solve_quadratic(double a, double b, double c) {
  const double discriminant = b * b - a * c;
  if (!(discriminant >= 0)) return {};
  const double q = -(b + std::copysign(std::sqrt(discriminant), b));
  if (discriminant == 0) return {1, {q / a}};
  return {2, {q / a, c / q}};
}

}  // namespace

TwoLampPoses solve_for_two_lamps(const Sighting& first, const Sighting& second) {
  const Eigen::Vector2d d = (second.lamp_m - first.lamp_m).head<2>();
  const Eigen::Vector2d difference = second.z - first.z;
  const double h = second.lamp_m.z() - first.lamp_m.z();
  TwoLampPoses fix;
  constexpr double rounding = 4 * std::numeric_limits<double>::epsilon();
  const double a = difference.squaredNorm();
  if (!(a > rounding * rounding * (first.z.squaredNorm() + second.z.squaredNorm()))) return fix;

  const Roots heights = solve_quadratic(a, h * difference.dot(second.z),
                                        h * h * second.z.squaredNorm() - d.squaredNorm());
  for (int i = 0; i < heights.count; ++i) {
    const double height_m = heights.values[static_cast<std::size_t>(i)];
    if (!(height_m > 0) || !(height_m + h > 0)) {
      fix.lamp_below_camera = true;
      continue;
    }
    const Eigen::Vector2d level_d = height_m * difference + h * second.z;
    const Eigen::Vector2d turn = conjugate_product(level_d, d);
    const double length = turn.norm();
    if (!(length > 0)) continue;
    const Eigen::Vector2d heading = turn / length;
    const Eigen::Vector2d s = first.lamp_m.head<2>() - height_m * complex_product(heading, first.z);
    fix.poses[static_cast<std::size_t>(fix.count++)] = {{s.x(), s.y(), first.lamp_m.z() - height_m},
                                                        std::atan2(heading.y(), heading.x())};
  }
  fix.lamp_below_camera = fix.lamp_below_camera && fix.count == 0;
  return fix;
}

namespace {

constexpr double kSameHeight_m = 1e-6;

bool are_at_one_height(std::span<const Sighting> sightings) {
  return std::all_of(sightings.begin(), sightings.end(), [&](const Sighting& sighting) {
    return std::abs(sighting.lamp_m.z() - sightings.front().lamp_m.z()) <= kSameHeight_m;
  });
}

const Sighting& select_farthest_from(const Sighting& from, std::span<const Sighting> sightings) {
  return *std::max_element(sightings.begin(), sightings.end(),
                           [&](const Sighting& a, const Sighting& b) {
                             return (a.z - from.z).squaredNorm() < (b.z - from.z).squaredNorm();
                           });
}

}  // namespace

InitialLevelPoses compute_initial_poses(std::span<const Sighting> sightings) {
  if (sightings.size() > 2 && are_at_one_height(sightings)) {
    const auto pose = solve_for_coplanar_lamps(sightings);
    if (!pose) return {FixStatus::degenerate};
    return {FixStatus::ok, 1, {*pose}};
  }
  const Sighting& first = select_farthest_from(sightings.front(), sightings);
  const TwoLampPoses pair = solve_for_two_lamps(first, select_farthest_from(first, sightings));
  if (pair.count > 0) return {FixStatus::ok, pair.count, pair.poses};
  return {pair.lamp_below_camera ? FixStatus::lamp_below_camera : FixStatus::degenerate};
}

std::optional<Pose> solve_for_coplanar_lamps(std::span<const Sighting> sightings) {
  const auto similarity = fit_similarity_transform(
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

std::optional<Pose> solve_for_one_lamp(const Sighting& sighting, double z_m, double yaw_rad) {
  const double height_m = sighting.lamp_m.z() - z_m;
  if (!(height_m > 0)) return std::nullopt;
  const Eigen::Vector2d s =
      sighting.lamp_m.head<2>() - height_m * (Eigen::Rotation2Dd(yaw_rad) * sighting.z);
  return Pose{{s.x(), s.y(), z_m}, yaw_rad};
}

}  // namespace vlp
