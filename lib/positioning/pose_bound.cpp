// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/pose_bound.h"

#include <limits>

namespace vlp {
namespace {

const Eigen::Vector3d kNoArm = Eigen::Vector3d::Zero();

std::optional<BodyObservation> exact_sighting(const Eigen::Vector3d& lamp_m, const Lens& lens,
                                              const Eigen::Matrix3d& camera_from_level,
                                              const Pose& level, double noise_px,
                                              const std::optional<RowClock>& row_clock) {
  const auto pixel = lens.project(camera_from_level * level_from_world(level, lamp_m));
  if (!pixel) return std::nullopt;
  const auto ray = lens.unproject(*pixel);
  if (!ray) return std::nullopt;
  const Eigen::Matrix3d level_from_camera = camera_from_level.transpose();
  const Eigen::Vector3d direction = level_from_camera * ray->direction;
  const auto whitened =
      whitened_pixel_from_ray(direction, level_from_camera * ray->d_direction_d_pixel, noise_px);
  if (!whitened) return std::nullopt;
  return BodyObservation{lamp_m, direction.normalized(), *whitened, noise_px,
                         row_clock ? row_clock->time_s(*pixel) : 0};
}

std::optional<Matrix4> pose_covariance(const BodyLimit& limit, const BodyPrior& prior) {
  const auto fix = estimate_body(limit.frame.span(), kNoArm, prior, limit.fix.state);
  if (!fix) return std::nullopt;
  return Matrix4(fix->covariance.topLeftCorner<4, 4>());
}

}  // namespace

bool may_move(const BodyPrior& prior) {
  return prior.velocity_sd_m_per_s > 0 || prior.yaw_rate_sd_rad_per_s > 0;
}

bool is_free(const BodyPrior& prior) { return may_move(prior) || prior.inclination_sd_rad > 0; }

std::optional<BodyLimit> compute_body_limit(std::span<const Eigen::Vector3d> lamps_m,
                                            const Lens& lens,
                                            const Eigen::Matrix3d& camera_from_level,
                                            const Pose& level, double noise_px,
                                            const BodyPrior& prior,
                                            const std::optional<RowClock>& row_clock) {
  if (lamps_m.size() < 2 || lamps_m.size() > kMaxSightings) return std::nullopt;
  // Exact observations neither contradict the fix nor fit a mirrored map: the limit has no effect.
  constexpr double residual_limit = 0.1;
  BodyLimit limit;
  BodyObservations& frame = limit.frame;
  for (const Eigen::Vector3d& lamp_m : lamps_m) {
    const auto seen = exact_sighting(lamp_m, lens, camera_from_level, level, noise_px, row_clock);
    if (!seen) return std::nullopt;
    frame.sightings[frame.size] = *seen;
    frame.nearest_m[frame.size] = std::numeric_limits<double>::infinity();
    frame.ids[frame.size] = static_cast<int>(frame.size);
    frame.num_current = ++frame.size;
  }
  const auto [status, fix] = estimate_body_robust(frame, kNoArm, prior, residual_limit);
  if (status != FixStatus::ok) return std::nullopt;
  limit.fix = fix;
  // The fix is at rest and level to rounding.
  limit.fix.state.motion = prior.mean;
  BodyPrior level_prior = prior;
  level_prior.inclination_sd_rad = 0;
  BodyPrior standing = level_prior;
  standing.velocity_sd_m_per_s = standing.yaw_rate_sd_rad_per_s = 0;
  const auto noise = pose_covariance(limit, standing), moving = pose_covariance(limit, level_prior);
  if (!noise || !moving) return std::nullopt;
  limit.noise = *noise;
  limit.motion = *moving - *noise;
  limit.lean = fix.covariance.topLeftCorner<4, 4>() - *moving;
  return limit;
}

}  // namespace vlp
