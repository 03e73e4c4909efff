// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/rotation_model.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "geometry/median.h"
#include "geometry/plane.h"

namespace vlp {

RotationModelFit fit_rotation_model(std::span<const RotationFix> fixes, std::size_t num_pivots,
                                    bool lever_arm) {
  const auto rows = static_cast<Eigen::Index>(2 * fixes.size());
  const auto tilt_column = static_cast<Eigen::Index>(2 * num_pivots);
  Eigen::MatrixXd design = Eigen::MatrixXd::Zero(rows, tilt_column + (lever_arm ? 4 : 2));
  Eigen::VectorXd positions_m(rows);
  for (std::size_t k = 0; k < fixes.size(); ++k) {
    const auto& [pose, height_m, pivot] = fixes[k];
    const auto row = static_cast<Eigen::Index>(2 * k);
    const Eigen::Matrix2d turn =
        complex_product_matrix({std::cos(pose.yaw_rad), std::sin(pose.yaw_rad)});
    design.block<2, 2>(row, static_cast<Eigen::Index>(2 * pivot)).setIdentity();
    design.block<2, 2>(row, tilt_column) = height_m * turn;
    if (lever_arm) design.block<2, 2>(row, tilt_column + 2) = turn;
    positions_m.segment<2>(row) = pose.position_m.head<2>();
  }
  RotationModelFit model_fit;
  model_fit.residuals_m.resize(fixes.size());
  Eigen::VectorXd sqrt_weights = Eigen::VectorXd::Ones(rows), solution;
  constexpr int max_iterations = 15;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    const Eigen::MatrixXd weighted = sqrt_weights.asDiagonal() * design;
    solution = weighted.completeOrthogonalDecomposition().solve(
        sqrt_weights.cwiseProduct(positions_m).eval());
    const Eigen::VectorXd errors = positions_m - design * solution;
    for (std::size_t k = 0; k < fixes.size(); ++k) {
      model_fit.residuals_m[k] = errors.segment<2>(static_cast<Eigen::Index>(2 * k)).norm();
    }
    const double scale_m = std::max(2 * upper_median(model_fit.residuals_m), 1e-9);
    for (std::size_t k = 0; k < fixes.size(); ++k) {
      sqrt_weights.segment<2>(static_cast<Eigen::Index>(2 * k))
          .setConstant(1 / std::hypot(1, model_fit.residuals_m[k] / scale_m));
    }
  }
  for (std::size_t pivot = 0; pivot < num_pivots; ++pivot) {
    model_fit.axes_m.emplace_back(solution.segment<2>(static_cast<Eigen::Index>(2 * pivot)));
  }
  model_fit.delta = solution.segment<2>(tilt_column);
  model_fit.lever_arm_m = Eigen::Vector2d::Zero();
  if (lever_arm) model_fit.lever_arm_m = solution.segment<2>(tilt_column + 2);
  return model_fit;
}

double measure_arc(std::vector<double> angles_rad) {
  if (angles_rad.size() < 2) return 0;
  constexpr double turn = 2 * std::numbers::pi;
  for (double& angle : angles_rad) angle -= turn * std::floor(angle / turn);
  std::sort(angles_rad.begin(), angles_rad.end());
  double widest = angles_rad.front() + turn - angles_rad.back();
  for (std::size_t i = 1; i < angles_rad.size(); ++i) {
    widest = std::max(widest, angles_rad[i] - angles_rad[i - 1]);
  }
  return turn - widest;
}

}  // namespace vlp
