// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/position_cost.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "geometry/median.h"
#include "positioning/outlier_rejection.h"
#include "rig/find_lamp.h"

namespace vlp {
namespace {

/// A pose needs three lamps. Where lights are left out, three others may agree by chance.
constexpr std::size_t kMinLights = 3, kMinMajority = 4;
/// Standard deviation of roll and pitch of a camera that is mounted, or held, to look up.
/// estimate_pose_robustly() rejects more than five times this value.
constexpr double kLeanSd_rad = 0.15;
constexpr double kMaxSquare = kMaxResidualSds * kMaxResidualSds;

/// Bounds on the residuals of predicted places.
struct Tolerance {
  /// Standard deviation and largest residual of a light, as fractions of the spread of the lights.
  double sd_fraction, max_residual_fraction;
};
// 0.1 is what a positioner allows (PositionerOptions::max_residual_fraction).
constexpr Tolerance kWithLens{0.03, 0.1}, kWithoutLens{0.1, 0.3};

Lens make_nominal_lens(const std::array<int, 2>& size_px) {
  const double width = size_px[0], height = size_px[1], focal_px = std::hypot(width, height) / 2;
  return {LensModel::pinhole, std::array{focal_px, focal_px, (width - 1) / 2, (height - 1) / 2}};
}

/// Root of the mean squared distance of points from their mean.
template <typename Point>
double compute_rms_spread(const std::vector<Point>& points) {
  const double n = static_cast<double>(points.size());
  Point mean = Point::Zero();
  for (const Point& point : points) mean += point / n;
  double squares = 0;
  for (const Point& point : points) squares += (point - mean).squaredNorm();
  return std::sqrt(squares / n);
}

/// Distance on the floor plan from a lamp to the nearest other one.
double nearest_lamp_m(const Lamp& lamp, const LampMap& lamps) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Lamp& other : lamps.lamps) {
    if (other.id == lamp.id) continue;
    nearest = std::min(nearest, (other.position_m - lamp.position_m).head<2>().norm());
  }
  return nearest;
}

/// Light with the lamp that a candidate assigns to it.
struct AssignedLight {
  /// Index into GroupedLights::lights.
  std::size_t index;
  const Lamp* lamp;
};

std::vector<AssignedLight> assigned_lights(const GroupedLights& image,
                                           const RowTimeCandidate& candidate,
                                           const LampMap& lamps) {
  std::vector<AssignedLight> assigned;
  for (std::size_t i = 0; i < image.lights.size(); ++i) {
    const std::vector<int>& ids = candidate.lamps[image.lights[i].period_group];
    if (!ids.empty()) assigned.push_back({i, find_lamp_by_id(lamps.lamps, ids.front())});
  }
  return assigned;
}

/// Makes the frame of the assigned lights, and removes those without a ray from `assigned`.
FrameObservations make_frame(const GroupedLights& image, std::vector<AssignedLight>& assigned,
                             const LampMap& lamps, const Lens& lens, double sd_fraction) {
  std::vector<Eigen::Vector2d> pixels;
  std::vector<Eigen::Vector3d> positions_m;
  pixels.reserve(image.lights.size());
  positions_m.reserve(assigned.size());
  for (const GroupedLight& light : image.lights) pixels.push_back(light.pixel);
  for (const AssignedLight& light : assigned) positions_m.push_back(light.lamp->position_m);
  const double spread_px = compute_rms_spread(pixels), spread_m = compute_rms_spread(positions_m);
  FrameObservations frame;
  std::vector<AssignedLight> kept;
  for (const AssignedLight& light : assigned) {
    const auto& [group, pixel, sigma_px] = image.lights[light.index];
    const Lamp& lamp = *light.lamp;
    const double map_sd_fraction = lamp.sd_m.value_or(0) / spread_m;
    const double sd_px = std::hypot(sigma_px, spread_px * std::max(sd_fraction, map_sd_fraction));
    const auto ray = lens.unproject_pixel(pixel);
    if (!ray) continue;
    const auto whitened = whiten_ray_jacobian(ray->direction, ray->d_direction_d_pixel, sd_px);
    if (!whitened) continue;
    frame.add_current_observation(
        {lamp.position_m, ray->direction.normalized(), *whitened, sd_px, 0}, lamp.id,
        nearest_lamp_m(lamp, lamps));
    kept.push_back(light);
  }
  assigned = std::move(kept);
  return frame;
}

bool has_pose(FixStatus status) {
  return status == FixStatus::ok || status == FixStatus::ambiguous ||
         status == FixStatus::undetermined;
}

/// Squared residuals of the lights of an image from the pose that fits them best, in their order.
std::vector<double> square_light_residuals(const GroupedLights& image,
                                           const RowTimeCandidate& candidate, const LampMap& lamps,
                                           const Lens& lens, const Tolerance& tolerance) {
  std::vector<double> squares(image.lights.size(), kMaxSquare);
  std::vector<AssignedLight> assigned = assigned_lights(image, candidate, lamps);
  if (assigned.size() < kMinLights || assigned.size() > kMaxSightings) return squares;
  const FrameObservations frame = make_frame(image, assigned, lamps, lens, tolerance.sd_fraction);
  if (frame.size < kMinLights) return squares;
  BodyPrior prior;
  prior.set_state_sd(kBodyRoll, kLeanSd_rad);
  FrameObservations agreeing = frame;
  const Eigen::Vector3d no_arm_m = Eigen::Vector3d::Zero();
  const auto found =
      estimate_pose_robustly(agreeing, {no_arm_m, prior}, tolerance.max_residual_fraction);
  if (!has_pose(found.status) || agreeing.size < std::min(frame.size, kMinMajority)) return squares;
  const auto& [roll_rad, pitch_rad] = found.fix.state.motion.inclination;
  const double lean_square = (roll_rad * roll_rad + pitch_rad * pitch_rad) /
                             (kLeanSd_rad * kLeanSd_rad) / static_cast<double>(agreeing.size);
  const EvaluatedState body(found.fix.state);
  for (std::size_t i = 0; i < frame.size; ++i) {
    const LampObservation& seen = frame.sightings[i];
    const Eigen::Vector3d lamp_in_body = body.lamp_position_in_body(seen.lamp_m, 0);
    const double depth_m = seen.ray.dot(lamp_in_body);
    if (!(depth_m > 0)) continue;
    const double square = (seen.whitened_pixel_from_ray * lamp_in_body / depth_m).squaredNorm();
    squares[assigned[i].index] = std::min(square + lean_square, kMaxSquare);
  }
  return squares;
}

/// Returns the groups that can be one lamp at most for every candidate.
std::vector<bool> flag_unique_lamps(const RowTimeCandidates& found) {
  std::vector<bool> unique(found.groups.size(), true);
  for (const RowTimeCandidate& candidate : found.candidates) {
    for (std::size_t i = 0; i < unique.size(); ++i) {
      unique[i] = unique[i] && candidate.lamps[i].size() <= 1;
    }
  }
  return unique;
}

}  // namespace

std::vector<double> compute_position_costs(const RowTimeCandidates& found,
                                           std::span<const GroupedLights> images,
                                           const LampMap& lamps, const std::optional<Lens>& lens) {
  const std::vector<bool> unique = flag_unique_lamps(found);
  const Tolerance& tolerance = lens ? kWithLens : kWithoutLens;
  // Squared residuals of the images by candidate and group.
  std::vector<std::vector<std::vector<double>>> squares(
      found.candidates.size(), std::vector<std::vector<double>>(found.groups.size()));
  for (GroupedLights image : images) {
    std::erase_if(image.lights,
                  [&](const GroupedLight& light) { return !unique[light.period_group]; });
    if (image.lights.size() < kMinLights) continue;
    const Lens lens_of_image = lens ? *lens : make_nominal_lens(image.size_px);
    for (std::size_t i = 0; i < squares.size(); ++i) {
      const auto of_lights =
          square_light_residuals(image, found.candidates[i], lamps, lens_of_image, tolerance);
      for (std::size_t k = 0; k < of_lights.size(); ++k) {
        squares[i][image.lights[k].period_group].push_back(of_lights[k]);
      }
    }
  }
  std::vector<double> costs(found.candidates.size(), 0);
  for (std::size_t i = 0; i < costs.size(); ++i) {
    for (std::vector<double>& of_group : squares[i]) {
      if (!of_group.empty()) costs[i] += std::log1p(upper_median(std::move(of_group)));
    }
  }
  return costs;
}

}  // namespace vlp
