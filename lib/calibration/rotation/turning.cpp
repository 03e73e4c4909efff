// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/turning.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "geometry/median.h"
#include "geometry/plane.h"

namespace vlp {

Turning fit_turning(std::span<const TurningFix> fixes, std::size_t spots, bool lever_arm) {
  const auto rows = static_cast<Eigen::Index>(2 * fixes.size());
  const auto arm = static_cast<Eigen::Index>(2 * spots);
  Eigen::MatrixXd design = Eigen::MatrixXd::Zero(rows, arm + (lever_arm ? 4 : 2));
  Eigen::VectorXd places(rows);
  for (std::size_t k = 0; k < fixes.size(); ++k) {
    const auto& [pose, height_m, spot] = fixes[k];
    const auto row = static_cast<Eigen::Index>(2 * k);
    const Eigen::Matrix2d turn = product_matrix({std::cos(pose.yaw_rad), std::sin(pose.yaw_rad)});
    design.block<2, 2>(row, static_cast<Eigen::Index>(2 * spot)).setIdentity();
    design.block<2, 2>(row, arm) = height_m * turn;
    if (lever_arm) design.block<2, 2>(row, arm + 2) = turn;
    places.segment<2>(row) = pose.position_m.head<2>();
  }
  Turning turning;
  turning.residuals_m.resize(fixes.size());
  Eigen::VectorXd roots_of_weights = Eigen::VectorXd::Ones(rows), solution;
  constexpr int rounds = 15;
  for (int round = 0; round < rounds; ++round) {
    const Eigen::MatrixXd weighted = roots_of_weights.asDiagonal() * design;
    solution = weighted.completeOrthogonalDecomposition().solve(
        roots_of_weights.cwiseProduct(places).eval());
    const Eigen::VectorXd errors = places - design * solution;
    for (std::size_t k = 0; k < fixes.size(); ++k) {
      turning.residuals_m[k] = errors.segment<2>(static_cast<Eigen::Index>(2 * k)).norm();
    }
    const double scale_m = std::max(2 * upper_median(turning.residuals_m), 1e-9);
    for (std::size_t k = 0; k < fixes.size(); ++k) {
      roots_of_weights.segment<2>(static_cast<Eigen::Index>(2 * k))
          .setConstant(1 / std::hypot(1, turning.residuals_m[k] / scale_m));
    }
  }
  for (std::size_t spot = 0; spot < spots; ++spot) {
    turning.axes_m.emplace_back(solution.segment<2>(static_cast<Eigen::Index>(2 * spot)));
  }
  turning.delta = solution.segment<2>(arm);
  turning.lever_arm_m = Eigen::Vector2d::Zero();
  if (lever_arm) turning.lever_arm_m = solution.segment<2>(arm + 2);
  return turning;
}

double arc_of(std::vector<double> angles_rad) {
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
