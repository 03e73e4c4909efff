// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/intrinsics_solver.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "calibration/intrinsics/edge_shift.h"
#include "camera/spline_grid.h"

namespace vlp {
namespace {

Eigen::Vector3d normal_of(const BoardPose& pose) {
  return Eigen::AngleAxisd(pose.rotation.norm(), pose.rotation.normalized()) *
         Eigen::Vector3d::UnitZ();
}

}  // namespace

IntrinsicsSolver::IntrinsicsSolver(const IntrinsicsInput& input) : input_(input) {
  for (std::size_t i = 0; i < input.views.size(); ++i) used_.push_back(i);
  edge_shifts_px_.assign(input.views.size(), 0);
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
  // Of a splined lens the core would move against all control points at once; mrcal keeps it, too.
  if (is_splined(input_.lens_model)) solved_for_.core = false;
  if (input_.lens_model == LensModel::fisheye) {
    // 2 tan(a / 2) = a (1 + a^2 / 12 + ...): the same lens.
    problem_.intrinsics.insert(problem_.intrinsics.end(),
                               {1 / 12.0, 1 / 120.0, 17 / 20160.0, 31 / 362880.0});
  }
  // Zero would be a stationary point of some of them.
  const double tiny = is_splined(input_.lens_model) ? 0 : 1e-6;
  problem_.intrinsics.resize(parameter_count(input_.lens_model), tiny);
  bool settled = false;
  for (int round = 0; round < rounds; ++round) {
    if (!solve(solved_for_)) return false;
    settled = !change_poses();
    if (settled) break;
    if (used_.size() < kLeastViews) return false;
    assemble(lens());
  }
  if (take_back()) {
    assemble(lens());
  } else if (settled) {
    return true;
  }
  return solve(solved_for_);
}

bool IntrinsicsSolver::weigh_regularization() {
  constexpr int rounds = 3;
  constexpr double least_px = 0.01, settled = 0.1;
  if (!is_splined(problem_.lens_model)) return true;
  for (int round = 0; round < rounds; ++round) {
    const double noise_px = std::clamp(solution().rms_px, least_px, 1.0);
    if (std::abs(noise_px / problem_.noise_px - 1) < settled) break;
    problem_.noise_px = noise_px;
    if (!solve(solved_for_)) return false;
  }
  return true;
}

bool IntrinsicsSolver::take_out_shifts() {
  constexpr int rounds = 2;
  constexpr double settled_px = 0.002;
  const std::size_t count = input_.lattice.points(), parts = input_.lattice.parts();
  for (int round = 0; round < rounds; ++round) {
    auto views = input_.views;
    for (auto& view : views) view = input_.lattice.bent(std::move(view), problem_.warp_m);
    const auto shifts = edge_shifts(views, lens());
    if (std::all_of(shifts.begin(), shifts.end(), [](const EdgeShift& shift) {
          return shift.by.lpNorm<Eigen::Infinity>() < settled_px;
        })) {
      return true;
    }
    for (std::size_t view = 0; view < input_.views.size(); ++view) {
      edge_shifts_px_[view] += take_out_shift(input_.views[view], shifts[view]);
    }
    for (std::size_t i = 0; i < used_.size(); ++i) {
      for (const auto& corner : input_.views[used_[i]]) {
        problem_.points[(i * parts + corner.part) * count + corner.point].head<2>() = corner.pixel;
      }
    }
    if (!solve(solved_for_)) return false;
  }
  return true;
}

bool IntrinsicsSolver::bend() {
  constexpr double much = 20;
  if (input_.warp == WarpChoice::off) return true;
  const auto squares = [](const IntrinsicsSolution& solution) {
    return solution.rms_px * solution.rms_px * 2 * solution.corners;
  };
  const IntrinsicsSolution flat = solution();
  solved_for_.warp = true;
  if (!solve(solved_for_)) return false;
  const IntrinsicsSolution bent = solution();
  if (input_.warp == WarpChoice::automatic &&
      squares(flat) - squares(bent) <= much * bent.rms_px * bent.rms_px) {
    problem_ = flat.problem;
    solved_for_.warp = false;
    return true;
  }
  return take_out_shifts();  // the first shifts were those of a flat board
}

bool IntrinsicsSolver::leave_out_outliers() {
  // Without noise what is left is the regularization's, and would be taken for outliers.
  constexpr double exact_px = 0.005;
  if (solution().rms_px < exact_px) return true;
  SolveFor without_outliers = solved_for_;
  without_outliers.without_outliers = true;
  return solve(without_outliers) && std::isfinite(solution().rms_px);
}

IntrinsicsSolution IntrinsicsSolver::solution() const {
  IntrinsicsSolution result{IntrinsicsStatus::ok, problem_, used_, dropped_, {}, 0, 0, 0};
  double squares = 0;
  result.solved_for = solved_for_;
  for (const std::size_t view : used_) result.edge_shifts_px.push_back(edge_shifts_px_[view]);
  const auto residuals = residuals_of(problem_);
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    const double weight = problem_.points[i].z();
    if (weight > 0) {
      squares += weight * weight * residuals[i].squaredNorm();
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
