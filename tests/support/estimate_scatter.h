// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace vlp {

/// Errors of repeated estimates of one vector, compared with the covariance
/// that each estimate reports.
class EstimateScatter {
 public:
  void add(const Eigen::VectorXd& error, const Eigen::MatrixXd& covariance) {
    if (count_ == 0) {
      squares_ = reported_ = Eigen::MatrixXd::Zero(error.size(), error.size());
    }
    squares_ += error * error.transpose();
    reported_ += covariance;
    const Eigen::ArrayXd normalized = error.array() / covariance.diagonal().array().sqrt();
    normalized_squares_ += normalized.square().mean();
    beyond_95_ += (normalized.abs() > 1.96).cast<double>().mean();
    mahalanobis_squares_ += error.dot(covariance.ldlt().solve(error)) / double(error.size());
    ++count_;
  }

  int count() const { return count_; }
  /// Returns the RMS errors divided by the RMS reported standard deviations, by
  /// component. They do not depend on the scatter of the reported variances.
  Eigen::VectorXd sd_ratios() const {
    return (squares_.diagonal().array() / reported_.diagonal().array()).sqrt();
  }
  /// Returns the difference between the correlations of the errors and the
  /// reported ones.
  Eigen::MatrixXd correlation_difference() const {
    return correlations(squares_) - correlations(reported_);
  }
  /// Returns the RMS of all components' errors in standard deviations.
  double normalized_rms() const { return std::sqrt(normalized_squares_ / count_); }
  /// Returns the mean of e' C^-1 e per component.
  double mean_mahalanobis_square() const { return mahalanobis_squares_ / count_; }
  /// Returns the fraction of the components beyond their 95 % interval.
  double fraction_beyond_95() const { return beyond_95_ / count_; }

 private:
  static Eigen::MatrixXd correlations(const Eigen::MatrixXd& covariance) {
    const Eigen::VectorXd scale = covariance.diagonal().cwiseSqrt().cwiseInverse();
    return scale.asDiagonal() * covariance * scale.asDiagonal();
  }

  Eigen::MatrixXd squares_, reported_;
  double normalized_squares_ = 0, mahalanobis_squares_ = 0, beyond_95_ = 0;
  int count_ = 0;
};

}  // namespace vlp
