// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/projection_difference.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "calibration/intrinsics/rotation_vector.h"
#include "geometry/polygon.h"

namespace vlp {
namespace {

struct Pair {
  Eigen::Vector2d pixel;
  Eigen::Vector3d a, b;
  double weight;
};

/// Fits the rotation of a to b by weighted least squares (Kabsch, 1976).
Eigen::Matrix3d fit_lens_rotation(const std::vector<Pair>& pairs) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const Pair& pair : pairs) sum += pair.weight * pair.b * pair.a.transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant());
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

}  // namespace

std::optional<Eigen::Matrix3d> fit_lens_rotation(const Lens& a, const Lens& b,
                                                 std::span<const Eigen::Vector2d> pixels) {
  std::vector<Pair> pairs;
  for (const Eigen::Vector2d& pixel : pixels) {
    const auto from_a = a.unproject_pixel(pixel), from_b = b.unproject_pixel(pixel);
    if (!from_a || !from_b) continue;
    pairs.push_back({pixel, from_a->direction.normalized(), from_b->direction.normalized(), 1});
  }
  if (pairs.size() < 3) return {};
  return fit_lens_rotation(pairs);
}

std::vector<Eigen::Vector2d> make_pixel_grid(const std::array<int, 2>& imager_px, int cols) {
  const int rows =
      std::max(2, static_cast<int>(std::lround(cols * double(imager_px[1]) / imager_px[0])));
  std::vector<Eigen::Vector2d> pixels;
  for (int row = 0; row < rows; ++row) {
    for (int col = 0; col < cols; ++col) {
      pixels.emplace_back((imager_px[0] - 1) * double(col) / (cols - 1),
                          (imager_px[1] - 1) * double(row) / (rows - 1));
    }
  }
  return pixels;
}

std::optional<ProjectionDifference> compare_projections(
    const Lens& a, const Lens& b, const std::array<int, 2>& imager_px,
    const std::function<double(const Eigen::Vector2d&)>& sigma_px) {
  std::vector<Pair> pairs;
  for (const Eigen::Vector2d& pixel : make_pixel_grid(imager_px)) {
    const auto from_a = a.unproject_pixel(pixel), from_b = b.unproject_pixel(pixel);
    const double sigma = sigma_px(pixel);
    if (!from_a || !from_b || !(sigma > 0) || !std::isfinite(sigma)) continue;
    pairs.push_back({pixel, from_a->direction.normalized(), from_b->direction.normalized(),
                     1 / (sigma * sigma)});
  }
  if (pairs.size() < 3) return {};
  const Eigen::Matrix3d rotation = fit_lens_rotation(pairs);
  ProjectionDifference difference{0, 0, 0};
  double count = 0;
  for (const Pair& pair : pairs) {
    const auto pixel = b.project_point(rotation * pair.a);
    if (!pixel) continue;
    const double distance_px = (*pixel - pair.pixel).norm();
    difference.mean_px += distance_px;
    difference.rms_px += distance_px * distance_px;
    difference.worst_px = std::max(difference.worst_px, distance_px);
    ++count;
  }
  if (count == 0) return {};
  difference.mean_px /= count;
  difference.rms_px = std::sqrt(difference.rms_px / count / 2);
  return difference;
}

namespace {

/// Derivatives of the pixel of a ray.
struct PixelDerivatives {
  Eigen::Matrix<double, 2, 3> d_pixel_d_rotation;
  Lens::SparseJacobian d_pixel_d_intrinsics;
};

std::vector<PixelDerivatives> list_derivatives(const Lens& lens,
                                               const std::array<int, 2>& imager_px,
                                               const ImageRegion& region) {
  std::vector<PixelDerivatives> derivatives;
  for (const Eigen::Vector2d& pixel : make_pixel_grid(imager_px)) {
    if (!region.empty() && !polygon_contains(region, pixel)) continue;
    const auto seen = lens.unproject_pixel(pixel);
    if (!seen) continue;
    const Eigen::Vector3d ray = seen->direction.normalized();
    const auto projection = lens.project_with_jacobians(ray);
    if (!projection) continue;
    derivatives.push_back({-projection->d_pixel_d_point * skew_symmetric_matrix(ray),
                           *lens.differentiate_intrinsics(ray)});
  }
  return derivatives;
}

/// Returns the derivatives of the pixels with respect to the intrinsics. Each change of the
/// intrinsics is combined with the rotation that removes most of it.
std::vector<Eigen::MatrixXd> align_derivatives(const std::vector<PixelDerivatives>& derivatives,
                                               Eigen::Index intrinsics) {
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

ExpectedDifference predict_difference(const Lens& lens, const std::array<int, 2>& imager_px,
                                      const Eigen::MatrixXd& covariance,
                                      const ImageRegion& region) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  if (!covariance.allFinite()) return {inf, 1};
  const auto derivatives = list_derivatives(lens, imager_px, region);
  Eigen::MatrixXd squares = Eigen::MatrixXd::Zero(covariance.rows(), covariance.rows());
  for (const Eigen::MatrixXd& change : align_derivatives(derivatives, covariance.rows())) {
    squares += change.transpose() * change;
  }
  const Eigen::MatrixXd terms =
      squares * covariance / (2 * static_cast<double>(derivatives.size()));
  const double mean = terms.trace();
  return {std::sqrt(mean), mean * mean / (terms * terms).trace()};
}

double predict_max_difference_px(const Lens& lens, const std::array<int, 2>& imager_px,
                                 const Eigen::MatrixXd& covariance, const ImageRegion& region) {
  if (!covariance.allFinite()) return std::numeric_limits<double>::infinity();
  const Eigen::MatrixXd samples = draw_samples(covariance);
  Eigen::RowVectorXd largest = Eigen::RowVectorXd::Zero(samples.cols());
  const auto derivatives = list_derivatives(lens, imager_px, region);
  for (const Eigen::MatrixXd& change : align_derivatives(derivatives, covariance.rows())) {
    largest = largest.cwiseMax((change * samples).colwise().squaredNorm());
  }
  return std::sqrt(largest.mean());
}

}  // namespace vlp
