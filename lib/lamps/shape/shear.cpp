// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/shear.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>

namespace vlp {
namespace {

/// Relative deviation of an oval from that predicted by the motion.
constexpr double kModelDeviation = 0.15;

/// Returns the derivative of the oval with respect to the motion (v, w) / 2.
Eigen::Matrix<double, 2, 3> compute_d_oval_d_motion(const OutlineEquations& light) {
  const Eigen::Vector2d &slope = light.scanline_gradient, &at = light.circle.center;
  const Eigen::Matrix2d times_slope{{slope.x(), -slope.y()}, {slope.y(), slope.x()}};
  Eigen::Matrix<double, 2, 3> result;
  result << times_slope, times_slope * Eigen::Vector2d(-at.y(), at.x());
  return result;
}

Matrix2 compute_model_covariance(const Eigen::Vector2d& oval) {
  return kModelDeviation * kModelDeviation * oval.squaredNorm() * Matrix2::Identity();
}

struct MeasuredOval {
  Eigen::Matrix<double, 2, 3> from_motion;
  Eigen::Vector2d oval;
  Matrix2 information;

  double compute_chi_square(const Eigen::Vector3d& motion) const {
    const Eigen::Vector2d left = oval - from_motion * motion;
    return left.dot(information * left);
  }
};

struct Motion {
  Eigen::Vector3d value;
  Eigen::Matrix3d information;
};

/// Returns the ratio of the scatter of the ovals about the motion and their stated variances, from
/// 0.5 to 1: the variance of a sheared outline includes a part of the shear, which a circle does
/// not fit.
double estimate_variance_ratio(const std::vector<MeasuredOval>& lights, const Motion& motion) {
  constexpr double min_ratio = 0.5;
  double chi_square = 0;
  for (const MeasuredOval& light : lights) chi_square += light.compute_chi_square(motion.value);
  const double degrees_of_freedom = std::max(1.0, 2.0 * double(lights.size()) - 3);
  return std::clamp(chi_square / degrees_of_freedom, min_ratio, 1.0);
}

Motion estimate_motion(const std::vector<MeasuredOval>& lights) {
  // Prior of the rotation: a camera that observes lamps rotates by less than a radian or two in
  // 10,000 scanlines.
  constexpr double max_turn = 1e-4;
  Motion motion{Eigen::Vector3d::Zero(), Eigen::Matrix3d::Zero()};
  motion.information(2, 2) = 1 / (max_turn * max_turn);
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const MeasuredOval& light : lights) {
    const Eigen::Matrix<double, 3, 2> weighed = light.from_motion.transpose() * light.information;
    motion.information += weighed * light.from_motion;
    right += weighed * light.oval;
  }
  motion.value = motion.information.ldlt().solve(right);
  return motion;
}

}  // namespace

std::optional<OutlineEquations::Estimate> OutlineEquations::solve_with_oval_prior(
    const std::optional<Oval>& known) const {
  Matrix5 information = matrix;
  Vector5 right = gradient;
  if (known) {
    const Matrix2 prior = known->covariance.inverse();
    information.bottomRightCorner<2, 2>() += prior;
    right.tail<2>() += prior * known->oval;
  }
  const Eigen::LDLT<Matrix5> solver(information);
  if (!(solver.vectorD().minCoeff() > 1e-9 * solver.vectorD().maxCoeff())) return std::nullopt;
  return Estimate{solver.solve(right), solver.solve(Matrix5::Identity())};
}

std::optional<Shear> Shear::estimate_shear(std::span<const OutlineEquations> lights) {
  constexpr double max_sd = 0.01;      // of the radius; of lights that are used
  constexpr double beyond_doubt = 30;  // a chi-square of 2
  constexpr double contradicts = 14;   // a chi-square of 2
  std::vector<MeasuredOval> ovals;
  for (const OutlineEquations& light : lights) {
    const auto estimate = light.solve_with_oval_prior(std::nullopt);
    if (!estimate) continue;
    const Matrix2 covariance = estimate->covariance.bottomRightCorner<2, 2>();
    if (covariance.trace() > 2 * max_sd * max_sd) continue;
    const Eigen::Vector2d oval = estimate->p.tail<2>();
    ovals.push_back({compute_d_oval_d_motion(light), oval,
                     (covariance + compute_model_covariance(oval)).inverse()});
  }
  const std::size_t all = ovals.size();
  while (!ovals.empty() && 2 * ovals.size() >= all) {
    const Motion motion = estimate_motion(ovals);
    const auto worst = std::max_element(
        ovals.begin(), ovals.end(), [&](const MeasuredOval& a, const MeasuredOval& b) {
          return a.compute_chi_square(motion.value) < b.compute_chi_square(motion.value);
        });
    if (worst->compute_chi_square(motion.value) > contradicts) {
      ovals.erase(worst);
      continue;
    }
    if (motion.value.dot(motion.information * motion.value) <
        beyond_doubt * estimate_variance_ratio(ovals, motion)) {
      break;
    }
    return Shear(motion.value, motion.information.inverse());
  }
  return std::nullopt;
}

Oval Shear::predict_oval(const OutlineEquations& light) const {
  const auto from_motion = compute_d_oval_d_motion(light);
  const Eigen::Vector2d oval = from_motion * motion_;
  return {oval,
          from_motion * covariance_ * from_motion.transpose() + compute_model_covariance(oval)};
}

Eigen::Vector2d Shear::motion_per_line(const OutlineEquations& light) const {
  const Eigen::Vector2d& at = light.circle.center;
  return 2 * (motion_.head<2>() + motion_[2] * Eigen::Vector2d(-at.y(), at.x()));
}

}  // namespace vlp
