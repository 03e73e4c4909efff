// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "geometry/angles.h"
#include "positioning/fix.h"

namespace vlp {

/// Statistics of errors of fixes against their covariances: the mean of e' cov^-1 e per state, and
/// the fraction within the 95 % quantile. The quantile is that of chi-squared with four degrees of
/// freedom.
struct NeesStatistics {
  double sum = 0;
  int count = 0, inside = 0;

  void add(const Eigen::Vector4d& error, const Eigen::Matrix4d& covariance) {
    constexpr double chi_squared_95 = 9.4877;
    const double d = error.dot(covariance.ldlt().solve(error));
    sum += d / 4;
    ++count;
    inside += d <= chi_squared_95 ? 1 : 0;
  }
  double mean() const { return sum / count; }
  double fraction() const { return static_cast<double>(inside) / count; }
};

/// Returns the error of X, Y, Z in meters and of the yaw in radians.
inline Eigen::Vector4d compute_pose_error(const Fix& fix, const Pose& truth) {
  Eigen::Vector4d error;
  error << fix.state.pose.position_m - truth.position_m,
      wrap_angle_rad(fix.state.pose.yaw_rad - truth.yaw_rad);
  return error;
}

}  // namespace vlp
