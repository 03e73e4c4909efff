// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/least_squares_fix.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

#include "geometry/plane.h"

namespace vlp {
namespace {

struct NormalEquations {
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  Eigen::Vector4d gradient = Eigen::Vector4d::Zero();
  double chi_squared = 0;
  bool lamps_above = true;
};

NormalEquations make_pose_normal_equations(std::span<const Sighting> sightings,
                                           const LevelPose& camera) {
  NormalEquations normal;
  for (const Sighting& sighting : sightings) {
    if (!(lamp_height_above_camera_m(camera, sighting.lamp_m) > 0)) return {.lamps_above = false};
    const Prediction prediction = project_lamp_with_jacobian(camera, sighting.lamp_m);
    const Eigen::Matrix2d whitening = sighting.d_pixel_d_z / sighting.sigma_px;
    const Eigen::Matrix<double, 2, 4> jacobian = whitening * prediction.d_z_d_state;
    const Eigen::Vector2d residual = whitening * (sighting.z - prediction.z);
    normal.information.noalias() += jacobian.transpose() * jacobian;
    normal.gradient.noalias() += jacobian.transpose() * residual;
    normal.chi_squared += residual.squaredNorm();
  }
  return normal;
}

/// Rotates along the tangent, which equals the angle for small steps.
LevelPose apply_pose_step(const LevelPose& pose, const Eigen::Vector4d& step) {
  return {pose.position_m + step.head<3>(),
          complex_product(pose.heading, {1, step[3]}).normalized()};
}

double compute_residual_rms_px(std::span<const Sighting> sightings, const LevelPose& camera) {
  double sum = 0;
  for (const Sighting& sighting : sightings) {
    sum += (sighting.d_pixel_d_z *
            (sighting.z - project_lamp_to_normalized_point(camera, sighting.lamp_m)))
               .squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(sightings.size()));
}

}  // namespace

std::optional<LeastSquaresFix> estimate_pose_least_squares(std::span<const Sighting> sightings,
                                                           const Pose& start) {
  constexpr int max_iterations = 50;
  // Relative to the distance and to 1 rad: far below any noise, far above rounding.
  constexpr double small_step = 1e-10;
  // Near the minimum the sum of squares changes by less than it can be computed.
  constexpr double rounding = 1e-12;
  LevelPose camera(start);
  NormalEquations normal = make_pose_normal_equations(sightings, camera);
  if (!normal.lamps_above) return std::nullopt;
  const double scale_m = lamp_height_above_camera_m(camera, sightings.front().lamp_m);
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    const Eigen::LLT<Eigen::Matrix4d> factor(normal.information);
    if (factor.info() != Eigen::Success) return std::nullopt;
    Eigen::Vector4d step = factor.solve(normal.gradient);
    if (!step.allFinite()) return std::nullopt;
    for (;; step /= 2) {
      const LevelPose next = apply_pose_step(camera, step);
      if (step.head<3>().norm() <= small_step * scale_m && std::abs(step[3]) <= small_step) {
        const Eigen::Matrix4d covariance = normal.information.inverse();
        if (!covariance.allFinite()) return std::nullopt;
        return LeastSquaresFix{next.convert_to_yaw_pose(), covariance, normal.chi_squared,
                               compute_residual_rms_px(sightings, next)};
      }
      const NormalEquations next_normal = make_pose_normal_equations(sightings, next);
      if (next_normal.lamps_above &&
          next_normal.chi_squared <= normal.chi_squared * (1 + rounding)) {
        camera = next, normal = next_normal;
        break;
      }
    }
  }
  return std::nullopt;
}

}  // namespace vlp
