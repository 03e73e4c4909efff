// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/robust_fit.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "geometry/robust_scatter.h"

namespace vlp {
namespace {

/// Residuals below this many sigmas are numeric noise.
constexpr double kRounding = 1e-6;

int free_parameters(const ceres::Problem& problem) {
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

void RobustFit::add(std::unique_ptr<ceres::CostFunction> cost, std::vector<double*> parameters) {
  blocks_.push_back({std::move(cost), std::move(parameters)});
  used_.push_back(true);
}

std::unique_ptr<ceres::Problem> RobustFit::problem(double loss_width,
                                                   const ParameterMap& places) const {
  ceres::Problem::Options options;
  options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  auto problem = std::make_unique<ceres::Problem>(options);
  // One loss for all: Ceres deletes it once.
  ceres::LossFunction* loss = loss_width > 0 ? new ceres::CauchyLoss(loss_width) : nullptr;
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    if (!used_[i]) continue;
    std::vector<double*> parameters = blocks_[i].parameters;
    for (double*& parameter : parameters) parameter = places.address_of(parameter);
    problem->AddResidualBlock(blocks_[i].cost.get(), loss, parameters);
  }
  for (const auto& candidates : fixed_) {
    const auto first =
        std::find_if(candidates.begin(), candidates.end(), [&](const double* parameter) {
          return problem->HasParameterBlock(places.address_of(parameter));
        });
    if (first != candidates.end()) problem->SetParameterBlockConstant(places.address_of(*first));
  }
  return problem;
}

RobustFit::ParameterMap RobustFit::copy_parameters() const {
  ParameterMap places;
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    const auto& sizes = blocks_[i].cost->parameter_block_sizes();
    for (std::size_t j = 0; used_[i] && j < sizes.size(); ++j) {
      const double* parameter = blocks_[i].parameters[j];
      if (!places.begins.emplace(parameter, places.values.size()).second) continue;
      places.values.insert(places.values.end(), parameter, parameter + sizes[j]);
    }
  }
  return places;
}

bool RobustFit::minimize(double loss_width) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.max_num_iterations = 100;
  options.function_tolerance = loss_width > 0 ? 1e-4 : 1e-15;  // the last fits start from the first
  options.gradient_tolerance = 1e-14;
  options.parameter_tolerance = 1e-13;
  options.num_threads = 1;  // keeps the order of sums and so their rounding
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, problem(loss_width).get(), &summary);
  update_lengths();
  return summary.IsSolutionUsable();
}

void RobustFit::update_lengths() {
  lengths_.clear();
  lengths_.reserve(blocks_.size());
  for (const Block& block : blocks_) {
    Eigen::Vector2d residual;
    block.cost->Evaluate(block.parameters.data(), residual.data(), nullptr);
    lengths_.push_back(residual.norm());
  }
}

double RobustFit::estimate_variance() const {
  std::vector<double> squares;
  for (std::size_t i = 0; i < lengths_.size(); ++i) {
    if (used_[i]) squares.push_back(lengths_[i] * lengths_[i]);
  }
  return std::max(robust_planar_variance(std::move(squares), degrees_of_freedom()),
                  kRounding * kRounding);
}

bool RobustFit::solve() {
  used_.assign(blocks_.size(), true);
  update_lengths();
  constexpr int num_loss_iterations = 4;
  for (int iteration = 0; iteration < num_loss_iterations; ++iteration) {
    if (!minimize(2 * std::sqrt(estimate_variance()))) return false;
  }
  return refine();
}

bool RobustFit::refine() {
  update_lengths();
  constexpr int max_iterations = 6;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    constexpr double sigmas = 4.5;
    const double limit = std::max(
        std::sqrt(planar_outlier_bound(sigmas, degrees_of_freedom()) * estimate_variance()),
        noise_is_stated_ ? sigmas : 0);
    const std::vector<bool> before = used_;
    for (std::size_t i = 0; i < used_.size(); ++i) used_[i] = lengths_[i] <= limit;
    if (iteration > 0 && used_ == before) break;
    if (!minimize(0)) return false;
  }
  return true;
}

std::vector<std::size_t> RobustFit::outliers() const {
  std::vector<std::size_t> rejected;
  for (std::size_t i = 0; i < used_.size(); ++i) {
    if (!used_[i]) rejected.push_back(i);
  }
  return rejected;
}

int RobustFit::degrees_of_freedom() const {
  const auto all = problem(0);
  return all->NumResiduals() - free_parameters(*all);
}

std::vector<RobustFit::Jacobians> RobustFit::jacobians() const {
  std::vector<Jacobians> all;
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    if (!used_[i]) continue;
    Jacobians at{i, blocks_[i].parameters, {}};
    for (const int size : blocks_[i].cost->parameter_block_sizes())
      at.d_residual_d_parameter.emplace_back(2, size);
    std::vector<double*> data;
    for (auto& by : at.d_residual_d_parameter) data.push_back(by.data());
    Eigen::Vector2d residual;
    blocks_[i].cost->Evaluate(at.parameters.data(), residual.data(), data.data());
    all.push_back(std::move(at));
  }
  return all;
}

std::vector<const double*> RobustFit::fixed_parameters() const {
  const auto all = problem(0);
  std::vector<double*> parameters;
  all->GetParameterBlocks(&parameters);
  std::vector<const double*> fixed_parameters;
  for (const double* parameter : parameters) {
    if (all->IsParameterBlockConstant(parameter)) fixed_parameters.push_back(parameter);
  }
  return fixed_parameters;
}

std::optional<Matrix2> RobustFit::covariance(const double* parameter, const double* other) const {
  // Ceres orders the parameters by their addresses, and rounding depends on that order.
  const ParameterMap places = copy_parameters();
  parameter = places.address_of(parameter);
  other = places.address_of(other);
  const auto all = problem(0, places);
  for (const double* wanted : {parameter, other}) {
    if (!all->HasParameterBlock(wanted) || all->IsParameterBlockConstant(wanted)) {
      return std::nullopt;
    }
  }
  const int redundancy = all->NumResiduals() - free_parameters(*all);
  if (redundancy <= 0) return std::nullopt;
  double squares = 0;
  for (std::size_t i = 0; i < lengths_.size(); ++i) {
    if (used_[i]) squares += lengths_[i] * lengths_[i];
  }
  ceres::Covariance::Options options;
  options.algorithm_type = ceres::SPARSE_QR;
  options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;  // SuiteSparse uses threads
  options.num_threads = 1;
  ceres::Covariance inverse(options);
  Eigen::Matrix<double, 2, 2, Eigen::RowMajor> block;
  const std::vector<std::pair<const double*, const double*>> wanted{{parameter, other}};
  if (!inverse.Compute(wanted, all.get()) ||
      !inverse.GetCovarianceBlock(parameter, other, block.data())) {
    return std::nullopt;
  }
  if (parameter == other) block = 0.5 * (block + block.transpose()).eval();
  return Matrix2(block * (squares / redundancy));
}

}  // namespace vlp
