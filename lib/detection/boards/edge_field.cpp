// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/edge_field.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "geometry/median.h"
#include "geometry/symmetric.h"

namespace vlp {

EdgeField::EdgeField(std::span<const EdgeSample> samples, Terms terms) {
  constexpr std::size_t min_samples = 32;  // four edges of eight tags
  constexpr int max_iterations = 6;
  constexpr double median_of_normal = 0.6745, huber_threshold = 3, min_excess_sd = 0.01;
  terms_ = samples.size() < min_samples ? 1 : terms == Terms::position ? 6 : kMaxTerms;
  const auto count = static_cast<double>(samples.size());
  for (const EdgeSample& sample : samples) middle_px_ += sample.at_px / count;
  for (const EdgeSample& sample : samples) {
    reach_px_ = std::max(reach_px_, (sample.at_px - middle_px_).lpNorm<Eigen::Infinity>());
  }
  std::vector<double> logs;
  for (const EdgeSample& sample : samples) logs.push_back(std::log(sample.value));
  coefficients_[0] = upper_median(logs);
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    std::vector<double> residuals, magnitudes, variances;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      residuals.push_back(logs[i] -
                          make_design_row(samples[i].at_px, samples[i].along).dot(coefficients_));
      magnitudes.push_back(std::abs(residuals.back()));
      variances.push_back(samples[i].sd * samples[i].sd);
    }
    const double residual_sd = upper_median(std::move(magnitudes)) / median_of_normal;
    const double median_variance = upper_median(variances);
    excess_sd_ = std::sqrt(
        std::max(residual_sd * residual_sd - median_variance, min_excess_sd * min_excess_sd));
    if (iteration + 1 == max_iterations) break;
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(terms_, terms_);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(terms_);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const double variance = variances[i] + excess_sd_ * excess_sd_;
      const double sigmas = std::abs(residuals[i]) / std::sqrt(variance);
      const double weight =
          std::min(1.0, huber_threshold / std::max(sigmas, huber_threshold)) / variance;
      const Eigen::VectorXd terms_row =
          make_design_row(samples[i].at_px, samples[i].along).head(terms_).transpose();
      normal.noalias() += weight * terms_row * terms_row.transpose();
      right += weight * residuals[i] * terms_row;
    }
    normal.diagonal().array() *= 1 + 1e-9;
    const Eigen::VectorXd step = solve_symmetric(normal, right);
    if (!step.allFinite()) break;
    coefficients_.head(terms_) += step;
  }
}

EdgeField::Row EdgeField::make_design_row(const Eigen::Vector2d& at_px,
                                          const Eigen::Vector2d& along) const {
  const Eigen::Vector2d x = (at_px - middle_px_) / reach_px_;
  const double square = along.x() * along.x() - along.y() * along.y();
  Row row;
  row << 1, x.x(), x.y(), x.x() * x.x(), x.x() * x.y(), x.y() * x.y(), square,
      2 * along.x() * along.y();
  row.tail(kMaxTerms - terms_).setZero();
  return row;
}

double EdgeField::evaluate_at_edge(const Eigen::Vector2d& at_px,
                                   const Eigen::Vector2d& along) const {
  return std::exp(make_design_row(at_px, along).dot(coefficients_));
}

}  // namespace vlp
