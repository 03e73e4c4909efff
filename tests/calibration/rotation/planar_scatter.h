// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace vlp {

/// Scatter of estimates of a point in the plane, compared with the covariance that each estimate
/// reports.
class PlanarScatter {
 public:
  /// @param expected  true value of the estimates
  explicit PlanarScatter(const Eigen::Vector2d& expected) : expected_(expected) {}

  void add(const Eigen::Vector2d& estimate, const Eigen::Matrix2d& covariance) {
    const Eigen::Vector2d error = estimate - expected_;
    sum_ += error;
    squares_ += error * error.transpose();
    reported_ += covariance;
    // 95 % quantile of chi-square with two degrees of freedom.
    beyond_95_ += error.dot(covariance.ldlt().solve(error)) > 5.9915 ? 1 : 0;
    ++count_;
  }

  /// Returns the ratios of observed to reported standard deviations minus one, along the axes in
  /// which the reported covariance is the unit matrix. If both are near zero, the covariances agree
  /// in size and direction.
  Eigen::Vector2d relative_sd_error() const {
    const Eigen::Matrix2d found = squares_ / count_ - mean() * mean().transpose();
    const Eigen::Matrix2d root = Eigen::LLT<Eigen::Matrix2d>(reported_ / count_).matrixL();
    const Eigen::Matrix2d white = root.inverse() * found * root.inverse().transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(white);
    return axes.eigenvalues().cwiseSqrt() - Eigen::Vector2d::Ones();
  }
  /// Returns the mean errors divided by the standard deviations of the mean.
  Eigen::Vector2d bias() const {
    return mean().array() / (reported_.diagonal().array() / count_ / count_).sqrt();
  }
  /// Returns the fraction of the estimates outside the 95 % region.
  double fraction_beyond_95() const { return beyond_95_ / count_; }

 private:
  Eigen::Vector2d mean() const { return sum_ / count_; }

  Eigen::Vector2d expected_, sum_ = Eigen::Vector2d::Zero();
  Eigen::Matrix2d squares_ = Eigen::Matrix2d::Zero(), reported_ = Eigen::Matrix2d::Zero();
  double beyond_95_ = 0, count_ = 0;
};

}  // namespace vlp
