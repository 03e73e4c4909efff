// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/board_problem.h"

#include <ceres/ceres.h>
#include <ceres/normal_prior.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "calibration/ceres_solve.h"
#include "calibration/intrinsics/intrinsics.h"
#include "calibration/intrinsics/rotation_vector.h"
#include "camera/lens.h"
#include "camera/spline_grid.h"

namespace vlp {
namespace {

/// Projection of a lattice point and its derivatives with respect to lens, pose and warp.
struct PointProjection {
  Eigen::Vector2d pixel;
  Lens::Projection projection;
  Eigen::Matrix<double, 2, 6> d_pixel_d_pose;
  Eigen::Matrix2d d_pixel_d_warp;
};

/// Point of the lattice, m, and the derivative of its z coordinate with respect to the warp.
struct LatticePoint {
  Eigen::Vector2d in_board_m, d_z_d_warp;

  Eigen::Vector3d apply_warp(const Eigen::Vector2d& warp_m) const {
    return {in_board_m.x(), in_board_m.y(), warp_m.dot(d_z_d_warp)};
  }
};

LatticePoint make_lattice_point(const BoardProblem& problem, std::size_t index) {
  const auto cols = static_cast<std::size_t>(problem.cols);
  const std::size_t col = index % cols, row = index / cols;
  const Eigen::Array2d node(static_cast<double>(col), static_cast<double>(row));
  const Eigen::Array2d last(problem.cols - 1, problem.rows - 1);
  return {problem.spacing_m * node.matrix(), (1 - (2 * node / last - 1).square()).matrix()};
}

std::optional<PointProjection> project_point(const Lens& lens, const LatticePoint& point,
                                             const Eigen::Matrix3d& rotation,
                                             const Eigen::Matrix3d& left, const BoardPose& pose,
                                             const Eigen::Vector2d& warp_m) {
  const Eigen::Vector3d rotated = rotation * point.apply_warp(warp_m);
  const auto projection = lens.project_with_jacobians(rotated + pose.translation_m);
  if (!projection) return {};
  PointProjection result{projection->pixel, *projection, {}, {}};
  result.d_pixel_d_pose << -projection->d_pixel_d_point * skew_symmetric_matrix(rotated) * left,
      projection->d_pixel_d_point;
  result.d_pixel_d_warp =
      projection->d_pixel_d_point * rotation.col(2) * point.d_z_d_warp.transpose();
  return result;
}

/// Lens of the parameters that were evaluated last. All boards have the same, and some models take
/// long to set up. Not for use by several threads.
class EvaluatedLens {
 public:
  explicit EvaluatedLens(LensModel lens_model) : lens_model_(lens_model) {}

  /// Returns the lens; nullptr if the parameters are not those of a lens.
  const Lens* update(std::span<const double> intrinsics) {
    if (std::ranges::equal(intrinsics, intrinsics_)) return lens_ ? &*lens_ : nullptr;
    intrinsics_.assign(intrinsics.begin(), intrinsics.end());
    lens_.reset();
    const bool is_finite =
        std::ranges::all_of(intrinsics, [](double value) { return std::isfinite(value); });
    if (is_finite && intrinsics[0] > 0 && intrinsics[1] > 0) lens_.emplace(lens_model_, intrinsics);
    return lens_ ? &*lens_ : nullptr;
  }

 private:
  LensModel lens_model_;
  std::vector<double> intrinsics_;
  std::optional<Lens> lens_;
};

/// Residuals, projected minus measured, of the points of one board that are not outliers.
/// Parameters: intrinsics, pose, warp.
class BoardCost : public ceres::CostFunction {
 public:
  /// @param lens  lens of the problem, common to all boards
  BoardCost(const BoardProblem& problem, std::size_t pose, EvaluatedLens& lens)
      : problem_(problem), lens_(lens) {
    const std::size_t count = problem.points_per_board();
    for (std::size_t i = 0; i < count; ++i) {
      if (problem.points[pose * count + i].z() > 0) inliers_.push_back(pose * count + i);
    }
    mutable_parameter_block_sizes()->push_back(static_cast<int>(problem.intrinsics.size()));
    mutable_parameter_block_sizes()->push_back(6);
    mutable_parameter_block_sizes()->push_back(2);
    set_num_residuals(static_cast<int>(2 * inliers_.size()));
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const std::span<const double> intrinsics(parameters[0], problem_.intrinsics.size());
    const Lens* const lens = lens_.update(intrinsics);
    if (lens == nullptr) return false;
    const BoardPose pose{Eigen::Vector3d(parameters[1]), Eigen::Vector3d(parameters[1] + 3)};
    const Eigen::Matrix3d rotation = rotation_from_vector(pose.rotation),
                          left = so3_left_jacobian(pose.rotation);
    const Eigen::Vector2d warp_m(parameters[2]);
    const auto columns = static_cast<Eigen::Index>(intrinsics.size());
    const std::size_t count = problem_.points_per_board();
    using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    for (std::size_t k = 0; k < inliers_.size(); ++k) {
      const auto row = static_cast<Eigen::Index>(2 * k);
      const Eigen::Vector3d& measured = problem_.points[inliers_[k]];
      const double weight = measured.z();
      const LatticePoint in_board = make_lattice_point(problem_, inliers_[k] % count);
      Eigen::Map<Eigen::Vector2d> residual(residuals + row);
      if (jacobians == nullptr) {
        const auto pixel =
            lens->project_point(rotation * in_board.apply_warp(warp_m) + pose.translation_m);
        if (!pixel) return false;
        residual = weight * (*pixel - measured.head<2>());
        continue;
      }
      const auto point = project_point(*lens, in_board, rotation, left, pose, warp_m);
      if (!point) return false;
      residual = weight * (point->pixel - measured.head<2>());
      const auto rows = static_cast<Eigen::Index>(2 * inliers_.size());
      if (jacobians[0] != nullptr) {
        Eigen::Map<Rows>(jacobians[0], rows, columns).middleRows<2>(row) =
            weight * point->projection.d_pixel_d_parameters;
      }
      if (jacobians[1] != nullptr) {
        Eigen::Map<Rows>(jacobians[1], rows, 6).middleRows<2>(row) = weight * point->d_pixel_d_pose;
      }
      if (jacobians[2] != nullptr) {
        Eigen::Map<Rows>(jacobians[2], rows, 2).middleRows<2>(row) = weight * point->d_pixel_d_warp;
      }
    }
    return true;
  }

 private:
  const BoardProblem& problem_;
  EvaluatedLens& lens_;
  std::vector<std::size_t> inliers_;
};

/// Returns the regularization of mrcal as the residuals A (intrinsics - target). Each is a multiple
/// of the difference of one parameter from its target.
/// @pre the model is not splined; residuals of splined models have several parameters
std::unique_ptr<ceres::CostFunction> regularize_as_mrcal(const BoardProblem& problem,
                                                         const SolveOptions& solve_options) {
  assert(!is_splined_lens_model(problem.lens_model));
  const Linearization start = linearize_by_mrcal(problem, solve_options);
  Eigen::VectorXd target = Eigen::Map<const Eigen::VectorXd>(
      problem.intrinsics.data(), static_cast<Eigen::Index>(problem.intrinsics.size()));
  Eigen::MatrixXd factors = Eigen::MatrixXd::Zero(start.regularization.size(), target.size());
  for (Eigen::Index row = 0; row < factors.rows(); ++row) {
    using Entry = Eigen::SparseMatrix<double>::InnerIterator;
    for (Entry entry(start.jacobian_transposed, start.residuals_px.size() + row); entry; ++entry) {
      if (entry.value() == 0) continue;
      const Eigen::Index parameter = start.first_intrinsic + entry.row();
      factors(row, parameter) = entry.value() / start.scale[entry.row()];
      target[parameter] -= start.regularization[row] / factors(row, parameter);
    }
  }
  return std::make_unique<ceres::NormalPrior>(factors, target);
}

/// Settings of Ceres: the relative change of the sum of squares at which it stops, and the initial
/// radius of the trust region, the reciprocal of the damping.
struct CeresSettings {
  double function_tolerance, initial_radius;
};
constexpr CeresSettings kFinalSolve{1e-12, 1e4};
/// Damping slows the convergence of the distortions; near the minimum little is needed.
constexpr CeresSettings kIntermediateSolve{1e-8, 1e6};

bool solve_once(BoardProblem& problem, const SolveOptions& solve_options,
                const CeresSettings& settings) {
  std::vector<std::array<double, 6>> poses;
  for (const BoardPose& pose : problem.poses) {
    poses.push_back({pose.rotation.x(), pose.rotation.y(), pose.rotation.z(),
                     pose.translation_m.x(), pose.translation_m.y(), pose.translation_m.z()});
  }
  std::vector<double> intrinsics = problem.intrinsics;
  Eigen::Vector2d warp_m = problem.warp_m;
  EvaluatedLens lens(problem.lens_model);
  ceres::Problem equations;
  auto order = std::make_unique<ceres::ParameterBlockOrdering>();
  std::size_t residuals = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    auto cost = std::make_unique<BoardCost>(problem, i, lens);
    if (cost->num_residuals() == 0) return false;
    residuals += static_cast<std::size_t>(cost->num_residuals());
    equations.AddResidualBlock(cost.release(), nullptr, intrinsics.data(), poses[i].data(),
                               warp_m.data());
    order->AddElementToGroup(poses[i].data(), 0);
  }
  if (residuals < intrinsics.size() + 6 * poses.size()) return false;
  if (solve_options.distortions && can_mrcal_solve(problem.lens_model)) {
    equations.AddResidualBlock(regularize_as_mrcal(problem, solve_options).release(), nullptr,
                               intrinsics.data());
  }
  order->AddElementToGroup(intrinsics.data(), 1);
  order->AddElementToGroup(warp_m.data(), 1);
  if (!solve_options.warp) equations.SetParameterBlockConstant(warp_m.data());
  if (!solve_options.core) {
    equations.SetParameterBlockConstant(intrinsics.data());
  } else if (!solve_options.distortions && intrinsics.size() > 4) {
    std::vector<int> fixed;
    for (int i = 4; i < static_cast<int>(intrinsics.size()); ++i) fixed.push_back(i);
    equations.SetManifold(intrinsics.data(),
                          new ceres::SubsetManifold(static_cast<int>(intrinsics.size()), fixed));
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.linear_solver_ordering.reset(order.release());
  options.max_num_iterations = 100;
  options.initial_trust_region_radius = settings.initial_radius;
  options.function_tolerance = settings.function_tolerance;
  options.parameter_tolerance = 1e-12;
  options.gradient_tolerance = 1e-12;
  if (!solve_with_ceres(options, equations)) return false;
  problem.intrinsics = intrinsics;
  problem.warp_m = warp_m;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    problem.poses[i] = {Eigen::Vector3d(poses[i].data()), Eigen::Vector3d(poses[i].data() + 3)};
  }
  return true;
}

/// Marks corners with a residual beyond 5 sigma on either axis. Returns true if there are any.
bool mark_outliers(BoardProblem& problem) {
  constexpr double sigmas = 5;
  auto residuals = compute_board_residuals(problem);
  double squares = 0, count = 0;
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    if (!(problem.points[i].z() > 0) || !residuals[i].allFinite()) continue;
    residuals[i] *= problem.points[i].z();
    squares += residuals[i].squaredNorm();
    count += 2;
  }
  const double limit_px = sigmas * std::sqrt(squares / std::max(count, 1.0));
  bool any = false;
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    if (!(problem.points[i].z() > 0)) continue;
    if (residuals[i].cwiseAbs().maxCoeff() <= limit_px) continue;
    problem.points[i].z() *= -1;
    any = true;
  }
  return any;
}

bool has_distortions(const BoardProblem& problem) { return problem.intrinsics.size() > 4; }

bool is_valid_lens(const BoardProblem& problem) {
  const auto& intrinsics = problem.intrinsics;
  return intrinsics[0] > 0 && intrinsics[1] > 0 &&
         std::ranges::all_of(intrinsics, [](double value) { return std::isfinite(value); });
}

/// Fit of a lens to the points that are not outliers.
struct InlierFit {
  explicit InlierFit(const BoardProblem& problem) {
    const auto residuals = compute_board_residuals(problem);
    double squares = 0, count = 0;
    for (std::size_t i = 0; i < residuals.size(); ++i) {
      const double weight = problem.points[i].z();
      if (!(weight > 0)) continue;
      if (!residuals[i].allFinite()) {
        projects_all = false;
        continue;
      }
      squares += weight * weight * residuals[i].squaredNorm();
      ++count;
    }
    rms_px = std::sqrt(squares / (2 * count));
  }

  bool projects_all = true;
  double rms_px;  // of the points that it projects
};

}  // namespace

std::vector<Eigen::Vector2d> list_inlier_pixels(const BoardProblem& problem) {
  std::vector<Eigen::Vector2d> pixels;
  for (const Eigen::Vector3d& point : problem.points) {
    if (point.z() > 0) pixels.emplace_back(point.head<2>());
  }
  return pixels;
}

bool can_mrcal_solve(LensModel model) { return lens_model_name(model).starts_with("LENSMODEL_"); }

bool solve_board_problem(BoardProblem& problem, SolveOptions solve_options) {
  solve_options.distortions = solve_options.distortions && has_distortions(problem);
  if (!can_mrcal_solve(problem.lens_model))
    return solve_by_ceres(problem, solve_options) && is_valid_lens(problem);
  constexpr double max_rms_ratio = 1.05;
  const BoardProblem start = problem;
  if (!solve_by_mrcal(problem, solve_options) || !is_valid_lens(problem)) return false;
  const InlierFit left(problem);
  if (left.projects_all || is_splined_lens_model(problem.lens_model) ||
      !InlierFit(start).projects_all)
    return true;
  BoardProblem without_poles = start;
  if (solve_by_ceres(without_poles, solve_options) &&
      !(InlierFit(without_poles).rms_px > max_rms_ratio * left.rms_px)) {
    problem = std::move(without_poles);
  }
  return true;
}

bool solve_intermediate_stage(BoardProblem& problem, SolveOptions solve_options) {
  solve_options.distortions = solve_options.distortions && has_distortions(problem);
  solve_options.reject_outliers = false;
  if (!is_splined_lens_model(problem.lens_model) && InlierFit(problem).projects_all &&
      solve_once(problem, solve_options, kIntermediateSolve))
    return true;
  return solve_board_problem(problem, solve_options);
}

Linearization linearize_board_problem(const BoardProblem& problem,
                                      const SolveOptions& solve_options) {
  return can_mrcal_solve(problem.lens_model) ? linearize_by_mrcal(problem, solve_options)
                                             : linearize_analytically(problem, solve_options);
}

bool solve_by_ceres(BoardProblem& problem, const SolveOptions& solve_options) {
  if (!solve_once(problem, solve_options, kFinalSolve)) return false;
  constexpr int max_iterations = 10;
  for (int iteration = 0;
       solve_options.reject_outliers && iteration < max_iterations && mark_outliers(problem);
       ++iteration) {
    if (!solve_once(problem, solve_options, kFinalSolve)) return false;
  }
  return true;
}

Linearization linearize_analytically(const BoardProblem& problem,
                                     const SolveOptions& solve_options) {
  const auto intrinsics = static_cast<Eigen::Index>(problem.intrinsics.size());
  const auto boards = static_cast<Eigen::Index>(problem.poses.size());
  const Eigen::Index warp = intrinsics + 6 * boards, states = warp + (solve_options.warp ? 2 : 0);
  const auto rows = static_cast<Eigen::Index>(2 * problem.points.size());
  const std::size_t count = problem.points_per_board();
  const Lens lens(problem.lens_model, problem.intrinsics);
  Linearization result;
  result.residuals_px = Eigen::VectorXd::Zero(rows);
  result.first_intrinsic = 0;
  result.poses = intrinsics;
  result.scale = Eigen::VectorXd::Zero(states);
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    if (!(problem.points[i].z() > 0)) continue;
    const BoardPose& pose = problem.poses[i / count];
    const auto point = project_point(lens, make_lattice_point(problem, i % count),
                                     rotation_from_vector(pose.rotation),
                                     so3_left_jacobian(pose.rotation), pose, problem.warp_m);
    if (!point) continue;
    const auto row = static_cast<Eigen::Index>(2 * i);
    const double weight = problem.points[i].z();
    result.residuals_px.segment<2>(row) = weight * (point->pixel - problem.points[i].head<2>());
    const auto add = [&](Eigen::Index first, const auto& block) {
      for (Eigen::Index r = 0; r < 2; ++r) {
        for (Eigen::Index c = 0; c < block.cols(); ++c) {
          entries.emplace_back(static_cast<int>(first + c), static_cast<int>(row + r), block(r, c));
          result.scale[first + c] += block(r, c) * block(r, c);
        }
      }
    };
    add(0, (weight * point->projection.d_pixel_d_parameters).eval());
    add(intrinsics + 6 * static_cast<Eigen::Index>(i / count),
        (weight * point->d_pixel_d_pose).eval());
    if (solve_options.warp) add(warp, (weight * point->d_pixel_d_warp).eval());
  }
  for (double& each : result.scale) each = each > 0 ? 1 / std::sqrt(each) : 1;
  result.jacobian_transposed.resize(states, rows);
  result.jacobian_transposed.setFromTriplets(entries.begin(), entries.end());
  result.jacobian_transposed = result.scale.asDiagonal() * result.jacobian_transposed;
  return result;
}

}  // namespace vlp
