// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/error_budget.h"

#include <limits>

#include "positioning/outlier_rejection.h"

namespace vlp {

namespace {

const Eigen::Vector3d kNoArm = Eigen::Vector3d::Zero();

std::optional<LampObservation> make_observation(const Eigen::Vector3d& lamp_m, const Lens& lens,
                                                const Eigen::Matrix3d& camera_from_level,
                                                const Pose& level, double noise_px,
                                                const std::optional<RowClock>& row_clock) {
  const auto pixel = lens.project_point(camera_from_level * level_point_from_world(level, lamp_m));
  if (!pixel) return std::nullopt;
  const auto ray = lens.unproject_pixel(*pixel);
  if (!ray) return std::nullopt;
  const Eigen::Matrix3d level_from_camera = camera_from_level.transpose();
  const Eigen::Vector3d direction = level_from_camera * ray->direction;
  const auto whitened =
      whiten_ray_jacobian(direction, level_from_camera * ray->d_direction_d_pixel, noise_px);
  if (!whitened) return std::nullopt;
  return LampObservation{lamp_m, direction.normalized(), *whitened, noise_px,
                         row_clock ? row_clock->compute_readout_time_s(*pixel) : 0};
}

std::optional<Matrix4> compute_pose_covariance(const FrameObservations& frame,
                                               const BodyPrior& prior, const BodyState& state) {
  const auto fix = estimate_body_state(frame.observations_span(), {kNoArm, prior}, state);
  if (!fix) return std::nullopt;
  return Matrix4(fix->covariance.topLeftCorner<4, 4>());
}

/// Returns the fix of exact observations; with unknown motion or tilt, only if it is unique.
std::optional<BodyFix> find_exact_fix(FrameObservations& frame, const BodyPrior& prior,
                                      const Pose& level) {
  const BodyProblem problem{kNoArm, prior};
  if (!prior.is_motion_or_tilt_free())
    return estimate_body_state(frame.observations_span(), problem, {level, prior.mean.motion});
  // Exact observations neither contradict the fix nor fit a mirrored map: the limit has no effect.
  constexpr double residual_limit = 0.1;
  const BodySolution found = estimate_pose_robustly(frame, problem, residual_limit);
  return found.status == FixStatus::ok ? std::optional(found.fix) : std::nullopt;
}

}  // namespace

std::optional<BodyPoseBound> compute_pose_crlb(std::span<const Eigen::Vector3d> lamps_m,
                                               const Lens& lens,
                                               const Eigen::Matrix3d& camera_from_level,
                                               const Pose& level, double noise_px,
                                               const BodyPrior& prior,
                                               const std::optional<RowClock>& row_clock) {
  if (lamps_m.size() < 2 || lamps_m.size() > kMaxSightings) return std::nullopt;
  BodyPoseBound limit;
  FrameObservations& frame = limit.frame;
  for (const Eigen::Vector3d& lamp_m : lamps_m) {
    const auto seen = make_observation(lamp_m, lens, camera_from_level, level, noise_px, row_clock);
    if (!seen || !(lamp_m.z() > level.position_m.z())) return std::nullopt;
    frame.add_current_observation(*seen, static_cast<int>(frame.size),
                                  std::numeric_limits<double>::infinity());
  }
  const auto fix = find_exact_fix(frame, prior, level);
  if (!fix) return std::nullopt;
  limit.fix = *fix;
  limit.noise = fix->covariance.topLeftCorner<4, 4>();
  limit.motion = limit.roll_pitch = Matrix4::Zero();
  if (!prior.is_motion_or_tilt_free()) return limit;
  // The fix is at rest and level to rounding.
  limit.fix.state.motion = prior.mean.motion;
  BodyPrior level_prior = prior;
  level_prior.set_state_sd(kBodyRoll, 0);
  BodyPrior standing = level_prior;
  standing.set_state_sd(kBodyVelocity, 0);
  standing.set_state_sd(kBodyYawRate, 0);
  const auto noise = compute_pose_covariance(frame, standing, limit.fix.state),
             moving = compute_pose_covariance(frame, level_prior, limit.fix.state);
  if (!noise || !moving) return std::nullopt;
  limit.noise = *noise;
  limit.motion = *moving - *noise;
  limit.roll_pitch = fix->covariance.topLeftCorner<4, 4>() - *moving;
  return limit;
}

std::optional<ErrorBudget> compute_fix_budget(std::span<const Eigen::Vector3d> lamps_m,
                                              const Lens& lens, const Pose& level,
                                              const ErrorSources& sources, const BodyPrior& prior,
                                              const std::optional<RowClock>& row_clock) {
  const auto limit = compute_pose_crlb(lamps_m, lens, Eigen::Matrix3d::Identity(), level,
                                       sources.noise_px, prior, row_clock);
  if (!limit) return std::nullopt;
  const EvaluatedState body(limit->fix.state);
  const Eigen::Matrix<double, 4, kBodyStates> covariance = limit->fix.covariance.topRows<4>();
  Eigen::Matrix<double, 4, 2> by_center = Eigen::Matrix<double, 4, 2>::Zero(), by_tilt = by_center;
  Eigen::Matrix4d of_lamps = Eigen::Matrix4d::Zero();
  for (const LampObservation& seen : limit->frame.observations_span()) {
    const auto d_pixel_d_state = linearize_observation(seen, body, kNoArm).jacobian;
    const Eigen::Matrix<double, 4, 2> gain = covariance * d_pixel_d_state.transpose();
    by_center += gain / sources.noise_px;
    Eigen::Matrix<double, 3, 2> d_ray_d_tilt;
    const Eigen::Vector3d& ray = seen.ray;
    d_ray_d_tilt << 0, ray.z(), -ray.z(), 0, ray.y(), -ray.x();
    by_tilt += gain * seen.whitened_pixel_from_ray * d_ray_d_tilt;
    const Eigen::Matrix<double, 4, 3> by_lamp = gain * d_pixel_d_state.leftCols<3>();
    of_lamps += by_lamp * by_lamp.transpose();
  }
  by_center *= sources.center_px;
  by_tilt *= sources.tilt_rad;
  return ErrorBudget{limit->noise,
                     by_center * by_center.transpose(),
                     by_tilt * by_tilt.transpose(),
                     sources.lamp_map_m * sources.lamp_map_m * of_lamps,
                     limit->motion,
                     limit->roll_pitch};
}

}  // namespace vlp
