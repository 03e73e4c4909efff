// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/calibration_error.h"

#include <Eigen/Geometry>
#include <iterator>

#include "camera/spline_grid.h"

namespace vlp {
namespace {

/// Updates center_px to the pixel of the zenith in the undistorted image.
void update_center_pixel_from_zenith(Calibration& calibration) {
  if (!calibration.rotation_center) return;
  RotationCenter& center = *calibration.rotation_center;
  center.center_px =
      compute_normalized_zenith_point(center).cwiseProduct(calibration.camera.focal_px()) +
      calibration.camera.principal_point_px();
}

}  // namespace

Eigen::Index count_intrinsics_with_covariance(const Camera& camera) {
  constexpr Eigen::Index core = 4;
  return is_splined_lens_model(camera.lens_model) ? core : std::ssize(camera.intrinsics);
}

Eigen::Vector2d compute_normalized_zenith_point(const RotationCenter& center) {
  return center.zenith_in_camera.hnormalized();
}

Calibration add_error_to_calibrated_intrinsics(Calibration calibration,
                                               const Eigen::VectorXd& error) {
  auto& intrinsics = calibration.camera.intrinsics;
  Eigen::Map<Eigen::VectorXd>(intrinsics.data(), error.size()) += error;
  if (auto& center = calibration.rotation_center;
      center && center->lever_arm_jacobian_wrt_intrinsics) {
    *center->lever_arm_m += *center->lever_arm_jacobian_wrt_intrinsics * error;
    if (center->lever_arm_jacobian_wrt_zenith && center->jacobian_wrt_intrinsics) {
      *center->lever_arm_m -=
          *center->lever_arm_jacobian_wrt_zenith * (*center->jacobian_wrt_intrinsics * error);
    }
  }
  update_center_pixel_from_zenith(calibration);
  return calibration;
}

Calibration add_error_to_calibrated_zenith(Calibration calibration, const Eigen::Vector2d& error) {
  RotationCenter& center = *calibration.rotation_center;
  center.zenith_in_camera =
      (compute_normalized_zenith_point(center) + error).homogeneous().normalized();
  if (center.lever_arm_jacobian_wrt_zenith)
    *center.lever_arm_m += *center.lever_arm_jacobian_wrt_zenith * error;
  update_center_pixel_from_zenith(calibration);
  return calibration;
}

Calibration add_error_to_calibrated_dispersion_offset(Calibration calibration,
                                                      const Eigen::Vector2d& error) {
  calibration.dispersion->offset_px += error.cwiseProduct(calibration.camera.focal_px());
  return calibration;
}

std::optional<Matrix2> compute_dispersion_offset_covariance_with_map_errors(
    const Dispersion& dispersion, const Eigen::Vector2d& focal_px) {
  if (!dispersion.covariance) return std::nullopt;
  Eigen::Matrix2d covariance = *dispersion.covariance;
  for (const Dispersion::UncertainLamp& lamp : dispersion.uncertain_lamps) {
    const Eigen::Matrix<double, 2, 3> move_px =
        lamp.sd_m * (focal_px.asDiagonal() * lamp.jacobian_wrt_position);
    covariance += move_px * move_px.transpose();
  }
  return Matrix2(covariance);
}

}  // namespace vlp
