// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/passed_on.h"

#include <Eigen/Cholesky>
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

std::optional<MatrixX> jacobian_of(const SolvedWith& solved, const Eigen::Vector2d& exact,
                                   const MatrixX& covariance) {
  const Eigen::LLT<Eigen::MatrixXd> factor(covariance);
  if (factor.info() != Eigen::Success) return {};
  const Eigen::MatrixXd lower = factor.matrixL();
  Eigen::MatrixXd moved(lower.cols(), 2);
  for (Eigen::Index i = 0; i < lower.cols(); ++i) {
    const auto by_one = solved(lower.col(i));
    if (!by_one) return {};
    moved.row(i) = (*by_one - exact).transpose();
  }
  // J L = moved'.
  const MatrixX jacobian = factor.matrixU().solve(moved).transpose();
  if (!jacobian.allFinite()) return {};
  return jacobian;
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

Eigen::Vector2d zenith_point(const RotationCenter& center) {
  return center.zenith_in_camera.hnormalized();
}

Eigen::Vector2d focal_px_of(const Camera& camera) {
  return {camera.intrinsics[0], camera.intrinsics[1]};
}

}  // namespace vlp
