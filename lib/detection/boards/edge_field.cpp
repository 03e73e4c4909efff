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

EdgeField::EdgeField(std::span<const EdgeFigure> figures, Terms terms) {
  constexpr std::size_t enough = 32;  // four edges of eight tags
  constexpr int rounds = 6;
  constexpr double median_of_normal = 0.6745, far = 3, least_apart = 0.01;
  terms_ = figures.size() < enough ? 1 : terms == Terms::place ? 6 : kMostTerms;
  const auto count = static_cast<double>(figures.size());
  for (const EdgeFigure& figure : figures) middle_px_ += figure.at_px / count;
  for (const EdgeFigure& figure : figures) {
    reach_px_ = std::max(reach_px_, (figure.at_px - middle_px_).lpNorm<Eigen::Infinity>());
  }
  std::vector<double> logs;
  for (const EdgeFigure& figure : figures) logs.push_back(std::log(figure.value));
  coefficients_[0] = upper_median(logs);
  for (int round = 0; round < rounds; ++round) {
    std::vector<double> off, sizes, variances;
    for (std::size_t i = 0; i < figures.size(); ++i) {
      off.push_back(logs[i] - row(figures[i].at_px, figures[i].along).dot(coefficients_));
      sizes.push_back(std::abs(off.back()));
      variances.push_back(figures[i].sd * figures[i].sd);
    }
    const double spread = upper_median(std::move(sizes)) / median_of_normal;
    const double own = upper_median(variances);
    apart_ = std::sqrt(std::max(spread * spread - own, least_apart * least_apart));
    if (round + 1 == rounds) break;
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(terms_, terms_);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(terms_);
    for (std::size_t i = 0; i < figures.size(); ++i) {
      const double variance = variances[i] + apart_ * apart_;
      const double sigmas = std::abs(off[i]) / std::sqrt(variance);
      const double weight = std::min(1.0, far / std::max(sigmas, far)) / variance;
      const Eigen::VectorXd terms_of =
          row(figures[i].at_px, figures[i].along).head(terms_).transpose();
      normal.noalias() += weight * terms_of * terms_of.transpose();
      right += weight * off[i] * terms_of;
    }
    normal.diagonal().array() *= 1 + 1e-9;
    const Eigen::VectorXd step = solve_symmetric(normal, right);
    if (!step.allFinite()) break;
    coefficients_.head(terms_) += step;
  }
}

EdgeField::Row EdgeField::row(const Eigen::Vector2d& at_px, const Eigen::Vector2d& along) const {
  const Eigen::Vector2d x = (at_px - middle_px_) / reach_px_;
  const double square = along.x() * along.x() - along.y() * along.y();
  Row row;
  row << 1, x.x(), x.y(), x.x() * x.x(), x.x() * x.y(), x.y() * x.y(), square,
      2 * along.x() * along.y();
  row.tail(kMostTerms - terms_).setZero();
  return row;
}

double EdgeField::value(const Eigen::Vector2d& at_px, const Eigen::Vector2d& along) const {
  return std::exp(row(at_px, along).dot(coefficients_));
}

}  // namespace vlp
