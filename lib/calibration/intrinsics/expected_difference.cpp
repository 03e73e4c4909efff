// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/expected_difference.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/rotation_vector.h"
#include "geometry/polygon.h"

namespace vlp {
namespace {

/// Derivatives of the pixel of a ray.
struct PixelDerivatives {
  Eigen::Matrix<double, 2, 3> d_pixel_d_rotation;
  Lens::SparseJacobian d_pixel_d_intrinsics;
};

std::vector<PixelDerivatives> compute_pixel_derivatives(const Lens& lens,
                                                        const std::array<int, 2>& imager_px,
                                                        const ImageRegion& region) {
  std::vector<PixelDerivatives> derivatives;
  for (const Eigen::Vector2d& pixel : make_regular_pixel_grid(imager_px)) {
    if (!region.empty() && !polygon_contains(region, pixel)) continue;
    const auto seen = lens.unproject(pixel);
    if (!seen) continue;
    const Eigen::Vector3d ray = seen->direction.normalized();
    const auto projection = lens.project_with_jacobians(ray);
    if (!projection) continue;
    derivatives.push_back({-projection->d_pixel_d_point * skew_symmetric_matrix(ray),
                           *lens.compute_intrinsics_jacobian(ray)});
  }
  return derivatives;
}

/// Returns the derivatives of the pixels with respect to the intrinsics. Each change of the
/// intrinsics is combined with the rotation that removes most of it.
std::vector<Eigen::MatrixXd> compute_aligned_derivatives(
    const std::vector<PixelDerivatives>& derivatives, Eigen::Index intrinsics) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(3, intrinsics);
  for (const auto& [d_pixel_d_rotation, d_pixel_d_intrinsics] : derivatives) {
    normal += d_pixel_d_rotation.transpose() * d_pixel_d_rotation;
    right(Eigen::all, d_pixel_d_intrinsics.parameters) +=
        d_pixel_d_rotation.transpose() * d_pixel_d_intrinsics.d_pixel;
  }
  const Eigen::MatrixXd rotation = normal.inverse() * right;
  std::vector<Eigen::MatrixXd> changes;
  for (const auto& [d_pixel_d_rotation, d_pixel_d_intrinsics] : derivatives) {
    Eigen::MatrixXd change = -d_pixel_d_rotation * rotation;
    change(Eigen::all, d_pixel_d_intrinsics.parameters) += d_pixel_d_intrinsics.d_pixel;
    changes.push_back(std::move(change));
  }
  return changes;
}

Eigen::MatrixXd draw_samples(const Eigen::MatrixXd& covariance) {
  constexpr Eigen::Index count = 200;
  std::mt19937_64 engine(1);
  const auto draw_uniform = [&] { return static_cast<double>(engine() >> 11) * 0x1p-53; };
  Eigen::MatrixXd normal(covariance.rows(), count);
  for (double& value : normal.reshaped()) {  // Box and Muller
    const double radius = std::sqrt(-2 * std::log(1 - draw_uniform()));
    value = radius * std::cos(2 * std::numbers::pi * draw_uniform());
  }
  // The magnitudes of the parameters differ widely.
  const Eigen::VectorXd scale = covariance.diagonal().cwiseMax(0).cwiseSqrt();
  const Eigen::VectorXd inverse = (scale.array() > 0).select(scale.cwiseInverse(), 0);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigensolver(
      inverse.asDiagonal() * covariance * inverse.asDiagonal());
  return scale.asDiagonal() * eigensolver.eigenvectors() *
         eigensolver.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal() * normal;
}

}  // namespace

ExpectedDifference compute_expected_projection_difference(const Lens& lens,
                                                          const std::array<int, 2>& imager_px,
                                                          const Eigen::MatrixXd& covariance,
                                                          const ImageRegion& region) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  if (!covariance.allFinite()) return {inf, 1};
  const auto derivatives = compute_pixel_derivatives(lens, imager_px, region);
  Eigen::MatrixXd squares = Eigen::MatrixXd::Zero(covariance.rows(), covariance.rows());
  for (const Eigen::MatrixXd& change :
       compute_aligned_derivatives(derivatives, covariance.rows())) {
    squares += change.transpose() * change;
  }
  const Eigen::MatrixXd terms =
      squares * covariance / (2 * static_cast<double>(derivatives.size()));
  const double mean = terms.trace();
  return {std::sqrt(mean), mean * mean / (terms * terms).trace()};
}

double estimate_max_expected_difference_px(const Lens& lens, const std::array<int, 2>& imager_px,
                                           const Eigen::MatrixXd& covariance,
                                           const ImageRegion& region) {
  if (!covariance.allFinite()) return std::numeric_limits<double>::infinity();
  const Eigen::MatrixXd samples = draw_samples(covariance);
  Eigen::RowVectorXd largest = Eigen::RowVectorXd::Zero(samples.cols());
  const auto derivatives = compute_pixel_derivatives(lens, imager_px, region);
  for (const Eigen::MatrixXd& change :
       compute_aligned_derivatives(derivatives, covariance.rows())) {
    largest = largest.cwiseMax((change * samples).colwise().squaredNorm());
  }
  return std::sqrt(largest.mean());
}

}  // namespace vlp
