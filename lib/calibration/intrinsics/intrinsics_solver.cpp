// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/intrinsics_solver.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace vlp {
namespace {

Eigen::Vector3d normal_of(const BoardPose& pose) {
  return Eigen::AngleAxisd(pose.rotation.norm(), pose.rotation.normalized()) *
         Eigen::Vector3d::UnitZ();
}

}  // namespace

IntrinsicsSolver::IntrinsicsSolver(const IntrinsicsInput& input) : input_(input) {
  for (std::size_t i = 0; i < input.views.size(); ++i) used_.push_back(i);
}

bool IntrinsicsSolver::start(double focal_px) {
  constexpr int rounds = 4;
  constexpr double settled = 1e-3;
  Lens lens = stereographic(input_, focal_px);
  for (int round = 0; round < rounds; ++round) {
    const double before_px = lens.focal_px().x();
    seed(lens);
    if (used_.size() < kLeastViews) return false;
    assemble(lens);
    if (!solve({true, false, false, false})) return false;
    lens = this->lens();
    if (std::abs(lens.focal_px().x() / before_px - 1) < settled) break;
  }
  return true;
}

bool IntrinsicsSolver::refine() {
  constexpr int rounds = 6;
  problem_.lens_model = input_.lens_model;
  // Zero would be a stationary point of some of them.
  constexpr double tiny = 1e-6;
  problem_.intrinsics.resize(parameter_count(input_.lens_model), tiny);
  const bool distortions = problem_.intrinsics.size() > 4;
  for (int round = 0; round < rounds; ++round) {
    if (!solve({true, distortions, false, false})) return false;
    if (!change_poses()) break;
    if (used_.size() < kLeastViews) return false;
    assemble(lens());
  }
  if (!take_back()) return true;
  assemble(lens());
  return solve({true, distortions, false, false});
}

bool IntrinsicsSolver::finish() {
  if (!solve(IntrinsicsSolution::solved_for)) return false;
  // Without noise what is left is the regularization's, and would be taken for outliers.
  constexpr double exact_px = 0.005;
  if (solution().rms_px < exact_px) return true;
  SolveFor without_outliers = IntrinsicsSolution::solved_for;
  without_outliers.without_outliers = true;
  return solve(without_outliers) && std::isfinite(solution().rms_px);
}

IntrinsicsSolution IntrinsicsSolver::solution() const {
  IntrinsicsSolution result{IntrinsicsStatus::ok, problem_, used_, dropped_, 0, 0, 0};
  double squares = 0;
  const auto residuals = residuals_of(problem_);
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    const double weight = problem_.points[i].z();
    if (weight > 0) {
      squares += residuals[i].squaredNorm();
      ++result.corners;
    } else if (weight != BoardProblem::kUnseen) {
      ++result.outliers;
    }
  }
  result.rms_px = std::sqrt(squares / (2 * std::max(1, result.corners)));
  return result;
}

bool IntrinsicsSolver::all_alike() const {
  constexpr double least_rad = 0.09;  // five degrees
  double widest_rad = 0;
  for (const BoardPose& a : problem_.poses) {
    for (const BoardPose& b : problem_.poses) {
      const double cosine = normal_of(a).dot(normal_of(b));
      widest_rad = std::max(widest_rad, std::acos(std::clamp(cosine, -1.0, 1.0)));
    }
  }
  return widest_rad < least_rad;
}

bool IntrinsicsSolver::solve(SolveFor what) {
  what.distortions = what.distortions && problem_.intrinsics.size() > 4;
  return vlp::solve(problem_, what) && problem_.intrinsics[0] > 0 && problem_.intrinsics[1] > 0 &&
         std::all_of(problem_.intrinsics.begin(), problem_.intrinsics.end(),
                     [](double value) { return std::isfinite(value); });
}

}  // namespace vlp
