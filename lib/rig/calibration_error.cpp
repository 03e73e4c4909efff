// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/calibration_error.h"

#include <Eigen/Geometry>
#include <iterator>

namespace vlp {
namespace {

/// The pixel of the zenith in the undistorted image.
void recenter(Calibration& calibration) {
  if (!calibration.rotation_center) return;
  const auto& k = calibration.camera.intrinsics;
  RotationCenter& center = *calibration.rotation_center;
  center.center_px = zenith_point(center).cwiseProduct(focal_px_of(calibration.camera)) +
                     Eigen::Vector2d(k[2], k[3]);
}

}  // namespace

Eigen::Vector2d focal_px_of(const Camera& camera) {
  return {camera.intrinsics[0], camera.intrinsics[1]};
}

Eigen::Vector2d zenith_point(const RotationCenter& center) {
  return center.zenith_in_camera.hnormalized();
}

Calibration with_lens_error(Calibration calibration, const Eigen::VectorXd& error) {
  auto& intrinsics = calibration.camera.intrinsics;
  Eigen::Map<Eigen::VectorXd>(intrinsics.data(), std::ssize(intrinsics)) += error;
  recenter(calibration);
  return calibration;
}

Calibration with_zenith_error(Calibration calibration, const Eigen::Vector2d& error) {
  RotationCenter& center = *calibration.rotation_center;
  center.zenith_in_camera = (zenith_point(center) + error).homogeneous().normalized();
  recenter(calibration);
  return calibration;
}

Calibration with_offset_error(Calibration calibration, const Eigen::Vector2d& error) {
  calibration.dispersion->offset_px += error.cwiseProduct(focal_px_of(calibration.camera));
  return calibration;
}

std::optional<Matrix2> whole_zenith_covariance(const Calibration& calibration) {
  const auto& center = calibration.rotation_center;
  const auto& lens = calibration.intrinsics_report;
  if (!center->covariance) return std::nullopt;
  const Eigen::Vector2d per_px = focal_px_of(calibration.camera).cwiseInverse();
  Matrix2 covariance = per_px.asDiagonal() * *center->covariance * per_px.asDiagonal();
  if (!lens || !lens->covariance) return covariance;
  if (!center->by_intrinsics) return std::nullopt;
  covariance += *center->by_intrinsics * *lens->covariance * center->by_intrinsics->transpose();
  return covariance;
}

std::optional<Matrix2> whole_offset_covariance(const Calibration& calibration) {
  const Dispersion& offset = *calibration.dispersion;
  const auto& center = calibration.rotation_center;
  const auto& lens = calibration.intrinsics_report;
  if (!offset.covariance) return std::nullopt;
  const Eigen::Vector2d focal_px = focal_px_of(calibration.camera);
  const Eigen::Vector2d per_px = focal_px.cwiseInverse();
  Matrix2 covariance = per_px.asDiagonal() * *offset.covariance * per_px.asDiagonal();
  if (center && center->covariance) {
    if (!offset.by_zenith) return std::nullopt;
    const Matrix2 of_zenith = *offset.by_zenith * per_px.asDiagonal();
    covariance += of_zenith * *center->covariance * of_zenith.transpose();
  }
  if (lens && lens->covariance) {
    if (!offset.by_intrinsics || (center && !center->by_intrinsics)) return std::nullopt;
    MatrixX by_lens = *offset.by_intrinsics;
    if (center && offset.by_zenith) by_lens += *offset.by_zenith * *center->by_intrinsics;
    covariance += by_lens * *lens->covariance * by_lens.transpose();
  }
  return Matrix2(focal_px.asDiagonal() * covariance * focal_px.asDiagonal());
}

}  // namespace vlp
