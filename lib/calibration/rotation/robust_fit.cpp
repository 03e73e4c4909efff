// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/robust_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "calibration/ceres_solve.h"
#include "geometry/robust_scatter.h"

namespace vlp {
namespace {

/// Residuals below this many sigmas are numeric noise.
constexpr double kRounding = 1e-6;

int count_free_parameters(const ceres::Problem& problem) {
  std::vector<double*> parameters;
  problem.GetParameterBlocks(&parameters);
  int count = 0;
  for (double* parameter : parameters) {
    if (!problem.IsParameterBlockConstant(parameter)) {
      count += problem.ParameterBlockSize(parameter);
    }
  }
  return count;
}

}  // namespace

void RobustFit::add_residual_block(std::unique_ptr<ceres::CostFunction> cost,
                                   std::vector<double*> parameters) {
  blocks_.push_back({std::move(cost), std::move(parameters)});
  used_.push_back(true);
}

std::unique_ptr<ceres::Problem> RobustFit::make_ceres_problem(double loss_width) const {
  ceres::Problem::Options options;
  options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  auto problem = std::make_unique<ceres::Problem>(options);
  // One loss for all: Ceres deletes it once.
  ceres::LossFunction* loss = loss_width > 0 ? new ceres::CauchyLoss(loss_width) : nullptr;
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    if (!used_[i]) continue;
    problem->AddResidualBlock(blocks_[i].cost.get(), loss, blocks_[i].parameters);
  }
  for (const auto& candidates : fixed_) {
    const auto first = std::ranges::find_if(
        candidates, [&](const double* parameter) { return problem->HasParameterBlock(parameter); });
    if (first != candidates.end()) problem->SetParameterBlockConstant(*first);
  }
  return problem;
}

bool RobustFit::minimize_residuals_with_cauchy_loss(double loss_width) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.max_num_iterations = 100;
  options.function_tolerance = loss_width > 0 ? 1e-4 : 1e-15;  // the last fits start from the first
  options.gradient_tolerance = 1e-14;
  options.parameter_tolerance = 1e-13;
  const bool is_usable = solve_with_ceres(options, *make_ceres_problem(loss_width));
  update_residual_norms();
  return is_usable;
}

void RobustFit::update_residual_norms() {
  lengths_.clear();
  lengths_.reserve(blocks_.size());
  for (const Block& block : blocks_) {
    Eigen::Vector2d residual;
    block.cost->Evaluate(block.parameters.data(), residual.data(), nullptr);
    lengths_.push_back(residual.norm());
  }
}

double RobustFit::estimate_residual_variance() const {
  std::vector<double> squares;
  for (std::size_t i = 0; i < lengths_.size(); ++i) {
    if (used_[i]) squares.push_back(lengths_[i] * lengths_[i]);
  }
  return std::max(estimate_robust_variance_2d(std::move(squares), degrees_of_freedom()),
                  kRounding * kRounding);
}

bool RobustFit::solve_robust_fit() {
  used_.assign(blocks_.size(), true);
  update_residual_norms();
  constexpr int num_loss_iterations = 4;
  for (int iteration = 0; iteration < num_loss_iterations; ++iteration) {
    if (!minimize_residuals_with_cauchy_loss(2 * std::sqrt(estimate_residual_variance())))
      return false;
  }
  return refine_fit_without_outliers();
}

bool RobustFit::refine_fit_without_outliers() {
  update_residual_norms();
  constexpr int max_iterations = 6;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    constexpr double sigmas = 4.5;
    const double limit =
        std::max(std::sqrt(compute_squared_outlier_bound_2d(sigmas, degrees_of_freedom()) *
                           estimate_residual_variance()),
                 noise_is_stated_ ? sigmas : 0);
    const std::vector<bool> before = used_;
    for (std::size_t i = 0; i < used_.size(); ++i) used_[i] = lengths_[i] <= limit;
    if (iteration > 0 && used_ == before) break;
    if (!minimize_residuals_with_cauchy_loss(0)) return false;
  }
  return true;
}

int RobustFit::degrees_of_freedom() const {
  const auto all = make_ceres_problem(0);
  return all->NumResiduals() - count_free_parameters(*all);
}

std::optional<RobustFit::Linearization> RobustFit::linearize_used_residuals() const {
  Linearization at;
  const int redundancy = degrees_of_freedom();
  if (redundancy <= 0) return std::nullopt;
  Eigen::Index num_unknowns = 0;
  double squares = 0;
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    if (!used_[i]) continue;
    squares += lengths_[i] * lengths_[i];
    const auto& [cost, parameters] = blocks_[i];
    std::vector<Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::RowMajor>> jacobians;
    std::vector<double*> data;
    auto& residual = at.residuals.emplace_back(Linearization::Residual{i, {}, {}});
    for (std::size_t k = 0; k < parameters.size(); ++k) {
      const int size = cost->parameter_block_sizes()[k];
      const auto [entry, is_new] = at.first_unknown.emplace(parameters[k], num_unknowns);
      if (is_new) num_unknowns += size;
      for (int j = 0; j < size; ++j) residual.unknowns.push_back(entry->second + j);
      data.push_back(jacobians.emplace_back(2, size).data());
    }
    Eigen::Vector2d value;
    cost->Evaluate(parameters.data(), value.data(), data.data());
    residual.jacobian.resize(2, std::ssize(residual.unknowns));
    for (Eigen::Index column = 0; const auto& jacobian : jacobians) {
      residual.jacobian.middleCols(column, jacobian.cols()) = jacobian;
      column += jacobian.cols();
    }
  }
  at.variance = squares / redundancy;
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(num_unknowns, num_unknowns);
  for (const auto& [index, unknowns, jacobian] : at.residuals) {
    normal(unknowns, unknowns) += jacobian.transpose() * jacobian;
  }
  // A fixed unknown is replaced by one that nothing depends on.
  const auto all = make_ceres_problem(0);
  Eigen::VectorXd is_free = Eigen::VectorXd::Ones(num_unknowns);
  for (const auto& [parameter, first] : at.first_unknown) {
    if (!all->IsParameterBlockConstant(parameter)) continue;
    is_free.segment(first, all->ParameterBlockSize(parameter)).setZero();
  }
  normal = (is_free.asDiagonal() * normal * is_free.asDiagonal()).eval();
  normal.diagonal() += Eigen::VectorXd::Ones(num_unknowns) - is_free;
  const Eigen::VectorXd scale = normal.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::LLT<Eigen::MatrixXd> factor(scale.asDiagonal() * normal * scale.asDiagonal());
  constexpr double rounding = 1e-14;
  if (factor.info() != Eigen::Success || !(factor.rcond() > rounding)) return std::nullopt;
  at.inverse = factor.solve(Eigen::MatrixXd((scale.cwiseProduct(is_free)).asDiagonal()));
  at.inverse = (scale.asDiagonal() * at.inverse).eval();
  at.inverse = 0.5 * (at.inverse + at.inverse.transpose()).eval();
  return at;
}

}  // namespace vlp
