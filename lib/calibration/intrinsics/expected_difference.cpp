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
struct Place {
  Eigen::Matrix<double, 2, 3> by_turn;
  Lens::ByParameters by_intrinsics;
};

std::vector<Place> places_of(const Lens& lens, const std::array<int, 2>& imager_px,
                             const ImageRegion& region) {
  std::vector<Place> places;
  for (const Eigen::Vector2d& pixel : pixel_grid(imager_px)) {
    if (!region.empty() && !polygon_contains(region, pixel)) continue;
    const auto seen = lens.unproject(pixel);
    if (!seen) continue;
    const Eigen::Vector3d ray = seen->direction.normalized();
    const auto projection = lens.project_with_jacobians(ray);
    if (!projection) continue;
    places.push_back({-projection->d_pixel_d_point * cross_matrix(ray), *lens.by_parameters(ray)});
  }
  return places;
}

/// Returns the derivatives of the pixels with respect to the intrinsics. Each change of the
/// intrinsics is combined with the rotation that removes most of it.
std::vector<Eigen::MatrixXd> by_intrinsics_turned(const std::vector<Place>& places,
                                                  Eigen::Index intrinsics) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(3, intrinsics);
  for (const auto& [by_turn, by_intrinsics] : places) {
    normal += by_turn.transpose() * by_turn;
    right(Eigen::all, by_intrinsics.parameters) += by_turn.transpose() * by_intrinsics.d_pixel;
  }
  const Eigen::MatrixXd turn = normal.inverse() * right;
  std::vector<Eigen::MatrixXd> changes;
  for (const auto& [by_turn, by_intrinsics] : places) {
    Eigen::MatrixXd change = -by_turn * turn;
    change(Eigen::all, by_intrinsics.parameters) += by_intrinsics.d_pixel;
    changes.push_back(std::move(change));
  }
  return changes;
}

Eigen::MatrixXd draws_of(const Eigen::MatrixXd& covariance) {
  constexpr Eigen::Index count = 200;
  std::mt19937_64 engine(1);
  const auto share = [&] { return static_cast<double>(engine() >> 11) * 0x1p-53; };
  Eigen::MatrixXd normal(covariance.rows(), count);
  for (double& value : normal.reshaped()) {  // Box and Muller
    const double radius = std::sqrt(-2 * std::log(1 - share()));
    value = radius * std::cos(2 * std::numbers::pi * share());
  }
  // The magnitudes of the parameters differ widely.
  const Eigen::VectorXd scale = covariance.diagonal().cwiseMax(0).cwiseSqrt();
  const Eigen::VectorXd inverse = (scale.array() > 0).select(scale.cwiseInverse(), 0);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> of_unit_size(
      inverse.asDiagonal() * covariance * inverse.asDiagonal());
  return scale.asDiagonal() * of_unit_size.eigenvectors() *
         of_unit_size.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal() * normal;
}

}  // namespace

ExpectedDifference expected_difference(const Lens& lens, const std::array<int, 2>& imager_px,
                                       const Eigen::MatrixXd& covariance,
                                       const ImageRegion& region) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  if (!covariance.allFinite()) return {inf, 1};
  const auto places = places_of(lens, imager_px, region);
  Eigen::MatrixXd squares = Eigen::MatrixXd::Zero(covariance.rows(), covariance.rows());
  for (const Eigen::MatrixXd& change : by_intrinsics_turned(places, covariance.rows())) {
    squares += change.transpose() * change;
  }
  const Eigen::MatrixXd terms = squares * covariance / (2 * static_cast<double>(places.size()));
  const double mean = terms.trace();
  return {std::sqrt(mean), mean * mean / (terms * terms).trace()};
}

double expected_worst_px(const Lens& lens, const std::array<int, 2>& imager_px,
                         const Eigen::MatrixXd& covariance, const ImageRegion& region) {
  if (!covariance.allFinite()) return std::numeric_limits<double>::infinity();
  const Eigen::MatrixXd draws = draws_of(covariance);
  Eigen::RowVectorXd largest = Eigen::RowVectorXd::Zero(draws.cols());
  const auto places = places_of(lens, imager_px, region);
  for (const Eigen::MatrixXd& change : by_intrinsics_turned(places, covariance.rows())) {
    largest = largest.cwiseMax((change * draws).colwise().squaredNorm());
  }
  return std::sqrt(largest.mean());
}

}  // namespace vlp
