// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <vector>

#include "geometry/angles.h"
#include "positioning/inclination_rotation.h"

namespace vlp {

/// Statistics of many estimates of one pose against their covariance.
class Scatter {
 public:
  Scatter(const Pose& truth, const Eigen::Matrix4d& covariance)
      : truth_(truth), covariance_(covariance), factor_(covariance) {}

  void add(const Pose& pose) {
    Eigen::Vector4d error;
    error << pose.position_m - truth_.position_m, wrap_angle_rad(pose.yaw_rad - truth_.yaw_rad);
    sum_ += error;
    squares_ += error.cwiseAbs2();
    // 95 % quantile of chi-square with four degrees of freedom.
    beyond_95_ += error.dot(factor_.solve(error)) > 9.4877 ? 1 : 0;
    ++count_;
  }

  /// Returns found over expected standard deviations, minus one: X, Y, Z, yaw.
  Eigen::Vector4d excess() const {
    const Eigen::Vector4d variance = squares_ / count_ - mean().cwiseAbs2();
    return (variance.array() / covariance_.diagonal().array()).sqrt() - 1;
  }
  /// Returns the mean errors over the standard deviations of the mean.
  Eigen::Vector4d bias() const {
    return mean().array() / (covariance_.diagonal().array() / count_).sqrt();
  }
  /// Returns the fraction of the errors outside the 95 % ellipsoid.
  double share_beyond_95() const { return beyond_95_ / count_; }

 private:
  Eigen::Vector4d mean() const { return sum_ / count_; }

  Pose truth_;
  Eigen::Matrix4d covariance_;
  Eigen::LDLT<Eigen::Matrix4d> factor_;
  Eigen::Vector4d sum_ = Eigen::Vector4d::Zero(), squares_ = Eigen::Vector4d::Zero();
  double beyond_95_ = 0, count_ = 0;
};

}  // namespace vlp
