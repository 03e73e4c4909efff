// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/expected_difference.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <vector>

#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/rotation_vector.h"

namespace vlp {
namespace {

/// How the pixel that shows a ray changes.
struct Place {
  Eigen::Matrix<double, 2, 3> by_turn;
  Lens::ByParameters by_intrinsics;
};

std::vector<Place> places_of(const Lens& lens, const std::array<int, 2>& imager_px,
                             const ImageRegion& region) {
  std::vector<Place> places;
  for (const Eigen::Vector2d& pixel : pixel_grid(imager_px)) {
    if (!region.empty() && !lies_in(region, pixel)) continue;
    const auto seen = lens.unproject(pixel);
    if (!seen) continue;
    const Eigen::Vector3d ray = seen->direction.normalized();
    const auto projection = lens.project_with_jacobians(ray);
    if (!projection) continue;
    places.push_back({-projection->d_pixel_d_point * cross_matrix(ray), *lens.by_parameters(ray)});
  }
  return places;
}

}  // namespace

ExpectedDifference expected_difference(const Lens& lens, const std::array<int, 2>& imager_px,
                                       const Eigen::MatrixXd& covariance,
                                       const ImageRegion& region) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  if (!covariance.allFinite()) return {inf, 1};
  const auto places = places_of(lens, imager_px, region);
  // Every change of the intrinsics goes with the turn that takes most of it away.
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(3, covariance.rows());
  for (const auto& [by_turn, by_intrinsics] : places) {
    normal += by_turn.transpose() * by_turn;
    right(Eigen::all, by_intrinsics.parameters) += by_turn.transpose() * by_intrinsics.d_pixel;
  }
  const Eigen::MatrixXd turn = normal.inverse() * right;
  Eigen::MatrixXd squares = Eigen::MatrixXd::Zero(covariance.rows(), covariance.rows());
  for (const auto& [by_turn, by_intrinsics] : places) {
    Eigen::MatrixXd left = -by_turn * turn;
    left(Eigen::all, by_intrinsics.parameters) += by_intrinsics.d_pixel;
    squares += left.transpose() * left;
  }
  const Eigen::MatrixXd terms = squares * covariance / (2 * static_cast<double>(places.size()));
  const double mean = terms.trace();
  return {std::sqrt(mean), mean * mean / (terms * terms).trace()};
}

}  // namespace vlp
