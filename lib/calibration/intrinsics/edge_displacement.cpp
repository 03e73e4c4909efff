// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/edge_displacement.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "calibration/intrinsics/rotation_vector.h"
#include "calibration/intrinsics/view_pose.h"
#include "geometry/median.h"
#include "geometry/symmetric.h"

namespace vlp {
namespace {

constexpr int kPose = 6, kUnknowns = kPose + 4;
using Square = Eigen::Matrix<double, kUnknowns, kUnknowns>;
using Column = Eigen::Matrix<double, kUnknowns, 1>;

/// Normal equations of the pose and the shift of a view, for corners of variance 1 / weight^2.
struct DisplacementEquations {
  Square normal = Square::Zero();
  Column right = Column::Zero();
  EdgeDisplacement shift;
  bool is_valid = false;

  /// Solves with priors: the terms of the shift are `prior`, with the given weights.
  EdgeDisplacement solve_with_prior(const Eigen::Vector4d& prior,
                                    const Eigen::Vector4d& weights) const {
    Square all = normal;
    Column sum = right;
    all.diagonal().tail<4>() += weights;
    sum.tail<4>() += weights.cwiseProduct(prior);
    const Column solution = solve_symmetric(all, sum);
    EdgeDisplacement result = shift;
    if (solution.allFinite()) result.coefficients = solution.tail<4>();
    return result;
  }
};

DisplacementEquations make_displacement_equations(const std::vector<BoardLattice::Corner>& corners,
                                                  const Lens& lens) {
  constexpr std::size_t min_corners = 12;
  if (corners.size() < min_corners || corners.front().inward.isZero(0)) return {};
  const auto pose = estimate_board_view_pose(corners, lens);
  if (!pose) return {};
  DisplacementEquations equations;
  const auto count = static_cast<double>(corners.size());
  double squares = 0;
  for (const auto& corner : corners) equations.shift.middle += corner.pixel / count;
  for (const auto& corner : corners) {
    squares += (corner.pixel - equations.shift.middle).squaredNorm() / count;
  }
  equations.shift.radius_px = std::max(1.0, std::sqrt(squares));
  const auto& [rotation, translation_m] = pose->camera_from_board;
  const Eigen::Matrix3d rotation_matrix = rotation_matrix_from_vector(rotation);
  for (const auto& corner : corners) {
    const Eigen::Vector3d rotated = rotation_matrix * corner.in_board_m;
    const auto projection = lens.project_with_jacobians(rotated + translation_m);
    if (!projection) return {};
    const Eigen::Vector2d x = (corner.pixel - equations.shift.middle) / equations.shift.radius_px;
    Eigen::Matrix<double, 2, kUnknowns> jacobian;
    jacobian << -projection->d_pixel_d_point * skew_symmetric_matrix(rotated),
        projection->d_pixel_d_point,
        corner.inward * Eigen::RowVector4d(1, x.x(), x.y(), x.squaredNorm());
    jacobian *= corner.weight;
    equations.normal += jacobian.transpose() * jacobian;
    equations.right += jacobian.transpose() * (corner.weight * (corner.pixel - projection->pixel));
  }
  equations.is_valid = true;
  return equations;
}

}  // namespace

std::vector<EdgeDisplacement> estimate_tag_edge_displacements(
    std::span<const std::vector<BoardLattice::Corner>> views, const Lens& lens,
    DisplacementForm form) {
  // Corner noise of 0.05 px; shifts differ by 0.1 px from view to view and within a view.
  constexpr double weight = 0.25, none = 1e-6, all = 1e9;
  const double uneven = form == DisplacementForm::constant ? all : weight;
  const Eigen::Vector4d weak_weights(none, uneven, uneven, uneven),
      prior_weights(weight, uneven, uneven, uneven);
  std::vector<DisplacementEquations> equations;
  std::vector<double> alone_px;
  for (const auto& corners : views) {
    equations.push_back(make_displacement_equations(corners, lens));
    if (equations.back().is_valid) {
      alone_px.push_back(
          equations.back().solve_with_prior(Eigen::Vector4d::Zero(), weak_weights).coefficients[0]);
    }
  }
  std::vector<EdgeDisplacement> shifts(views.size());
  if (alone_px.empty()) return shifts;
  const Eigen::Vector4d prior(upper_median(alone_px), 0, 0, 0);
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (equations[i].is_valid) {
      shifts[i] = equations[i].solve_with_prior(prior, prior_weights);
    } else if (!views[i].empty() && !views[i].front().inward.isZero(0)) {
      shifts[i].coefficients = prior;
    }
  }
  return shifts;
}

double correct_edge_displacement(std::vector<BoardLattice::Corner>& corners,
                                 const EdgeDisplacement& shift) {
  double sum_px = 0;
  for (auto& corner : corners) {
    const double shift_px = shift.at(corner.pixel);
    corner.pixel -= shift_px * corner.inward;
    sum_px += shift_px;
  }
  return corners.empty() ? 0 : sum_px / static_cast<double>(corners.size());
}

}  // namespace vlp
