// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/error_budget.h"

#include <limits>

#include "geometry/symmetric.h"
#include "positioning/outlier_rejection.h"
#include "positioning/sighting.h"

namespace vlp {

namespace {

const Eigen::Vector3d kNoArm = Eigen::Vector3d::Zero();

std::optional<BodyObservation> make_noise_free_observation(
    const Eigen::Vector3d& lamp_m, const Lens& lens, const Eigen::Matrix3d& camera_from_level,
    const Pose& level, double noise_px, const std::optional<RowClock>& row_clock) {
  const auto pixel = lens.project_point(camera_from_level * level_point_from_world(level, lamp_m));
  if (!pixel) return std::nullopt;
  const auto ray = lens.unproject_pixel(*pixel);
  if (!ray) return std::nullopt;
  const Eigen::Matrix3d level_from_camera = camera_from_level.transpose();
  const Eigen::Vector3d direction = level_from_camera * ray->direction;
  const auto whitened = compute_whitened_pixel_jacobian_wrt_ray(
      direction, level_from_camera * ray->d_direction_d_pixel, noise_px);
  if (!whitened) return std::nullopt;
  return BodyObservation{lamp_m, direction.normalized(), *whitened, noise_px,
                         row_clock ? row_clock->compute_pixel_readout_time_s(*pixel) : 0};
}

std::optional<Matrix4> compute_pose_covariance(const BodyPoseBound& limit, const BodyPrior& prior) {
  const auto fix =
      estimate_body_state(limit.frame.observations_span(), kNoArm, prior, limit.fix.state);
  if (!fix) return std::nullopt;
  return Matrix4(fix->covariance.topLeftCorner<4, 4>());
}

}  // namespace

bool is_motion_estimated(const BodyPrior& prior) {
  return prior.velocity_sd_m_per_s > 0 || prior.yaw_rate_sd_rad_per_s > 0;
}

bool is_motion_or_tilt_estimated(const BodyPrior& prior) {
  return is_motion_estimated(prior) || prior.inclination_sd_rad > 0;
}

std::optional<BodyPoseBound> compute_pose_crlb(std::span<const Eigen::Vector3d> lamps_m,
                                               const Lens& lens,
                                               const Eigen::Matrix3d& camera_from_level,
                                               const Pose& level, double noise_px,
                                               const BodyPrior& prior,
                                               const std::optional<RowClock>& row_clock) {
  if (lamps_m.size() < 2 || lamps_m.size() > kMaxSightings) return std::nullopt;
  // Exact observations neither contradict the fix nor fit a mirrored map: the limit has no effect.
  constexpr double residual_limit = 0.1;
  BodyPoseBound limit;
  BodyObservations& frame = limit.frame;
  for (const Eigen::Vector3d& lamp_m : lamps_m) {
    const auto seen =
        make_noise_free_observation(lamp_m, lens, camera_from_level, level, noise_px, row_clock);
    if (!seen) return std::nullopt;
    frame.sightings[frame.size] = *seen;
    frame.nearest_m[frame.size] = std::numeric_limits<double>::infinity();
    frame.ids[frame.size] = static_cast<int>(frame.size);
    frame.num_current = ++frame.size;
  }
  const auto [status, fix] = estimate_body_state_robust(frame, kNoArm, prior, residual_limit);
  if (status != FixStatus::ok) return std::nullopt;
  limit.fix = fix;
  // The fix is at rest and level to rounding.
  limit.fix.state.motion = prior.mean;
  BodyPrior level_prior = prior;
  level_prior.inclination_sd_rad = 0;
  BodyPrior standing = level_prior;
  standing.velocity_sd_m_per_s = standing.yaw_rate_sd_rad_per_s = 0;
  const auto noise = compute_pose_covariance(limit, standing),
             moving = compute_pose_covariance(limit, level_prior);
  if (!noise || !moving) return std::nullopt;
  limit.noise = *noise;
  limit.motion = *moving - *noise;
  limit.roll_pitch = fix.covariance.topLeftCorner<4, 4>() - *moving;
  return limit;
}

namespace {

using Matrix24 = Eigen::Matrix<double, 2, 4>;
using Matrix42 = Eigen::Matrix<double, 4, 2>;
using Matrix43 = Eigen::Matrix<double, 4, 3>;

/// Derivatives of a lamp's pixel in the least-squares fix.
struct Row {
  Eigen::Matrix2d d_pixel_d_z;
  Matrix24 d_pixel_d_state;
  Eigen::Vector2d z;
};

std::optional<Row> linearize_lamp(const Eigen::Vector3d& lamp_m, const Lens& lens,
                                  const LevelPose& camera) {
  if (!(lamp_height_above_camera_m(camera, lamp_m) > 0)) return std::nullopt;
  const Prediction prediction = project_lamp_with_jacobian(camera, lamp_m);
  const auto projection =
      lens.project_point_with_jacobians({prediction.z.x(), prediction.z.y(), 1});
  if (!projection) return std::nullopt;
  // On the plane z = 1, where the sightings are.
  const Eigen::Matrix2d d_pixel_d_z = projection->d_pixel_d_point.leftCols<2>();
  return Row{d_pixel_d_z, d_pixel_d_z * prediction.d_z_d_state, prediction.z};
}

/// Returns the derivative by the lamp's position: minus the derivative by the camera's position.
Eigen::Matrix<double, 2, 3> d_pixel_d_lamp_position(const Row& row) {
  return -row.d_pixel_d_state.leftCols<3>();
}

}  // namespace

std::optional<ErrorBudget> compute_fix_error_budget(std::span<const Eigen::Vector3d> lamps_m,
                                                    const Lens& lens, const Pose& level,
                                                    const ErrorSources& sources) {
  if (lamps_m.size() < 2) return std::nullopt;
  const LevelPose camera(level);
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  Matrix42 center_gradient = Matrix42::Zero(), tilt_gradient = Matrix42::Zero();
  Eigen::Matrix4d lamp_map_gradient = Eigen::Matrix4d::Zero();
  for (const Eigen::Vector3d& lamp_m : lamps_m) {
    const auto row = linearize_lamp(lamp_m, lens, camera);
    if (!row) return std::nullopt;
    const Matrix42 transposed = row->d_pixel_d_state.transpose();
    information += transposed * row->d_pixel_d_state;
    center_gradient += transposed;
    tilt_gradient +=
        transposed * row->d_pixel_d_z * compute_normalized_point_jacobian_wrt_tilt(row->z);
    const Matrix43 lamp_gradient = transposed * d_pixel_d_lamp_position(*row);
    lamp_map_gradient += lamp_gradient * lamp_gradient.transpose();
  }
  const auto inverse = invert_positive_definite_matrix(information);
  if (!inverse) return std::nullopt;
  const Matrix42 by_center = sources.center_px * *inverse * center_gradient;
  const Matrix42 by_tilt = sources.tilt_rad * *inverse * tilt_gradient;
  return ErrorBudget{
      sources.noise_px * sources.noise_px * *inverse, by_center * by_center.transpose(),
      by_tilt * by_tilt.transpose(),
      sources.lamp_map_m * sources.lamp_map_m * *inverse * lamp_map_gradient * *inverse};
}

std::optional<ErrorBudget> compute_fix_error_budget(std::span<const Eigen::Vector3d> lamps_m,
                                                    const Lens& lens, const Pose& level,
                                                    const ErrorSources& sources,
                                                    const BodyPrior& prior,
                                                    const std::optional<RowClock>& row_clock) {
  const auto limit = compute_pose_crlb(lamps_m, lens, Eigen::Matrix3d::Identity(), level,
                                       sources.noise_px, prior, row_clock);
  if (!limit) return std::nullopt;
  const EvaluatedState body(limit->fix.state);
  const Eigen::Matrix<double, 4, kBodyStates> covariance = limit->fix.covariance.topRows<4>();
  Matrix42 by_center = Matrix42::Zero(), by_tilt = Matrix42::Zero();
  Eigen::Matrix4d of_lamps = Eigen::Matrix4d::Zero();
  for (const BodyObservation& seen : limit->frame.observations_span()) {
    const Eigen::Vector3d in_body = body.lamp_position_in_body(seen.lamp_m, seen.time_s);
    const Eigen::Matrix<double, 2, kBodyStates> d_pixel_d_state =
        d_whitened_pixel_d_lamp_position(seen, in_body) *
        body.d_lamp_position_in_body_d_state(seen.lamp_m, seen.time_s);
    const Matrix42 gain = covariance * d_pixel_d_state.transpose();
    by_center += gain / sources.noise_px;
    Eigen::Matrix<double, 3, 2> d_ray_d_tilt;
    const Eigen::Vector3d& ray = seen.ray;
    d_ray_d_tilt << 0, ray.z(), -ray.z(), 0, ray.y(), -ray.x();
    by_tilt += gain * seen.whitened_pixel_from_ray * d_ray_d_tilt;
    const Matrix43 by_lamp = gain * d_pixel_d_state.leftCols<3>();
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
