// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/dispersion/offset_separation.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "geometry/enclosing_circle.h"
#include "geometry/plane.h"
#include "geometry/robust_scatter.h"
#include "geometry/symmetric.h"

namespace vlp {

namespace {

using Fixes = std::vector<std::optional<ReferencePointFixes::Estimate>>;

/// Whitened residual of a fix and its derivative with respect to (offset_px, world_m).
struct Equation {
  std::size_t capture;
  Eigen::Vector2d residual;
  Eigen::Matrix<double, 2, 4> jacobian;
  /// Inverse of the lower Cholesky factor of the fix's covariance.
  Eigen::Matrix2d whitening;
};

std::vector<Equation> linearize_fixes(const ReferencePointFixes& fixes,
                                      const OffsetSeparation& at) {
  constexpr double step_px =
      0.25;  // fixes are smooth over this step, which is far above their rounding
  const Eigen::Vector2d along_u(step_px, 0), along_v(0, step_px);
  const Fixes here = fixes.locate_with_offset(at.offset_px);
  const Fixes right = fixes.locate_with_offset(at.offset_px + along_u),
              left = fixes.locate_with_offset(at.offset_px - along_u);
  const Fixes down = fixes.locate_with_offset(at.offset_px + along_v),
              up = fixes.locate_with_offset(at.offset_px - along_v);
  std::vector<Equation> equations;
  equations.reserve(here.size());
  for (std::size_t i = 0; i < here.size(); ++i) {
    if (!here[i] || !right[i] || !left[i] || !down[i] || !up[i]) continue;
    const Eigen::Matrix2d root = here[i]->covariance.llt().matrixL();
    const Eigen::Matrix2d whitening = root.inverse();
    Eigen::Matrix<double, 2, 4> jacobian;
    jacobian << (right[i]->error_m - left[i]->error_m) / (2 * step_px),
        (down[i]->error_m - up[i]->error_m) / (2 * step_px), -Eigen::Matrix2d::Identity();
    equations.push_back(
        {i, whitening * (here[i]->error_m - at.world_m), whitening * jacobian, whitening});
  }
  return equations;
}

std::vector<double> square_residuals(const std::vector<Equation>& equations) {
  std::vector<double> squares;
  squares.reserve(equations.size());
  for (const Equation& equation : equations) squares.push_back(equation.residual.squaredNorm());
  return squares;
}

/// Applies one step of weighted least squares to `at` and returns it. Returns std::nullopt if the
/// equations do not determine it.
std::optional<Eigen::Vector4d> apply_step(const std::vector<Equation>& equations,
                                          const std::vector<double>& weights,
                                          OffsetSeparation& at) {
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  Eigen::Vector4d gradient = Eigen::Vector4d::Zero();
  double chi_squared = 0;
  int count = 0;
  for (std::size_t i = 0; i < equations.size(); ++i) {
    const auto& [capture, residual, jacobian, whitening] = equations[i];
    information += weights[i] * jacobian.transpose() * jacobian;
    gradient -= weights[i] * jacobian.transpose() * residual;
    chi_squared += weights[i] * residual.squaredNorm();
    count += weights[i] > 0 ? 1 : 0;
  }
  const Eigen::LLT<Eigen::Matrix4d> factor(information);
  const Eigen::Vector4d step = factor.solve(gradient);
  if (factor.info() != Eigen::Success || !step.allFinite()) return std::nullopt;
  at.offset_px += step.head<2>();
  at.world_m += step.tail<2>();
  at.covariance = information.inverse();
  at.degrees_of_freedom = 2 * count - 4;
  at.variance_factor = at.degrees_of_freedom > 0 ? chi_squared / at.degrees_of_freedom : 0;
  return step;
}

/// Returns the degrees of freedom of fixes: two rows each, minus the four unknowns.
double count_degrees_of_freedom(const std::vector<double>& squares) {
  return 2 * static_cast<double>(squares.size()) - 4;
}

/// Estimates the variance per axis. Returns a value above zero, so that it can be a divisor.
double estimate_variance(const std::vector<double>& squares) {
  return std::max(estimate_variance_2d(squares, count_degrees_of_freedom(squares)),
                  kFixRoundingVariance);
}

/// Approaches the solution closely enough to recognize outliers. Returns false if the fixes do not
/// determine it.
bool solve_approximately(const ReferencePointFixes& fixes, OffsetSeparation& at) {
  constexpr int iterations = 6;
  constexpr double width_squared = 2.385 * 2.385;  // 95 % efficiency for normal noise
  for (int iteration = 0; iteration < iterations; ++iteration) {
    const auto equations = linearize_fixes(fixes, at);
    if (equations.empty()) return false;
    std::vector<double> weights = square_residuals(equations);
    const double variance = iteration == 0 ? 0 : estimate_variance(weights);
    for (double& one : weights) {
      one = iteration == 0 ? 1 : 1 / (1 + one / (width_squared * variance));
    }
    if (!apply_step(equations, weights, at)) return false;
  }
  return true;
}

/// Solves by least squares without outliers. Returns true if the set of inliers differs from
/// `at.used`, and std::nullopt if the solution does not converge.
std::optional<bool> solve_without_outliers(const ReferencePointFixes& fixes, OffsetSeparation& at) {
  constexpr int max_iterations = 30;
  constexpr double tolerance_px = 1e-7, tolerance_m = 1e-10;
  auto equations = linearize_fixes(fixes, at);
  if (equations.empty()) return std::nullopt;
  const auto squares = square_residuals(equations);
  const double limit =
      compute_outlier_bound_2d(kFixOutlierSigmas, count_degrees_of_freedom(squares)) *
      estimate_variance(squares);
  std::vector<bool> used(at.used.size());
  for (std::size_t i = 0; i < squares.size(); ++i) {
    used[equations[i].capture] = squares[i] <= limit;
  }
  const bool changed = used != at.used;
  at.used = std::move(used);
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    std::vector<double> weights;
    weights.reserve(equations.size());
    for (const Equation& equation : equations) weights.push_back(at.used[equation.capture] ? 1 : 0);
    const auto step = apply_step(equations, weights, at);
    if (!step) return std::nullopt;
    if (step->head<2>().norm() < tolerance_px && step->tail<2>().norm() < tolerance_m)
      return changed;
    equations = linearize_fixes(fixes, at);
  }
  return std::nullopt;
}

/// Returns the derivative of the solution with respect to the fixes, -(J'WJ)^-1 J'W.
Eigen::Matrix4Xd differentiate_by_fixes(const ReferencePointFixes& fixes,
                                        const OffsetSeparation& at) {
  Eigen::Matrix4Xd jacobian = Eigen::Matrix4Xd::Zero(4, 2 * std::ssize(at.used));
  for (const Equation& equation : linearize_fixes(fixes, at)) {
    if (!at.used[equation.capture]) continue;
    jacobian.middleCols<2>(2 * static_cast<Eigen::Index>(equation.capture)) =
        -at.covariance * equation.jacobian.transpose() * equation.whitening;
  }
  return jacobian;
}

}  // namespace

std::optional<OffsetSeparation> separate_offsets(const ReferencePointFixes& fixes) {
  OffsetSeparation result;
  result.used.resize(fixes.locate_with_offset(result.offset_px).size());
  if (!solve_approximately(fixes, result)) return std::nullopt;
  constexpr int max_iterations = 10;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    const auto changed = solve_without_outliers(fixes, result);
    if (!changed) return std::nullopt;
    if (!*changed) break;
  }
  result.jacobian_wrt_fixes = differentiate_by_fixes(fixes, result);
  return result;
}

namespace {

std::vector<Eigen::Vector2d> compute_errors(const ReferencePointFixes& reference_fixes,
                                            const Eigen::Vector2d& offset_px,
                                            const std::vector<bool>& used) {
  const OptionalFixes fixes = reference_fixes.locate_with_offset(offset_px);
  std::vector<Eigen::Vector2d> errors_m;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    if (fixes[i] && used[i]) errors_m.push_back(fixes[i]->error_m);
  }
  return errors_m;
}

Eigen::Vector2d compute_mean_point(const std::vector<Eigen::Vector2d>& points) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const auto& point : points) sum += point;
  return sum / static_cast<double>(points.size());
}

/// Differentiates the mean fix with respect to the offset, numerically. The result is not finite if
/// there is no fix.
Eigen::Matrix2d differentiate_mean_fix(const ReferencePointFixes& reference_fixes,
                                       const Eigen::Vector2d& at_px,
                                       const std::vector<bool>& used) {
  constexpr double step_px =
      0.25;  // fixes are smooth over this step, which is far above their rounding
  Eigen::Matrix2d derivative;
  for (Eigen::Index axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d step = step_px * Eigen::Vector2d::Unit(axis);
    derivative.col(axis) =
        (compute_mean_point(compute_errors(reference_fixes, at_px + step, used)) -
         compute_mean_point(compute_errors(reference_fixes, at_px - step, used))) /
        (2 * step_px);
  }
  return derivative;
}

/// Returns the mean noise covariance of the fixes, in m^2. Returns zero if neither sigma_px nor
/// residuals determine the noise.
Eigen::Matrix2d compute_mean_noise(const OptionalFixes& fixes, const std::vector<bool>& used,
                                   bool noise_is_stated) {
  Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
  double count = 0, squares_px2 = 0, freedom = 0;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    if (!fixes[i] || !used[i]) continue;
    sum += fixes[i]->covariance;
    squares_px2 += fixes[i]->squared_residuals_px2;
    freedom += fixes[i]->degrees_of_freedom;
    ++count;
  }
  const double variance_px2 = noise_is_stated ? 1 : freedom > 0 ? squares_px2 / freedom : 0;
  return sum * (variance_px2 / count);
}

/// Estimates the covariance of the mean of n errors from their scatter and their noise.
///
/// Few errors do not determine a covariance: two errors give one of rank 1. The sample covariance
/// therefore has weight n - 1 and its isotropic mean has isotropic_weight.
/// compute_variance_factor() scales the variance along each axis of the result, in
/// coordinates in which the noise is the unit matrix.
Eigen::Matrix2d estimate_covariance(const std::vector<Eigen::Vector2d>& errors,
                                    const Eigen::Matrix2d& noise) {
  constexpr double isotropic_weight = 2;  // as three errors
  const Eigen::Vector2d mean = compute_mean_point(errors);
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  for (const auto& error : errors) squares += (error - mean) * (error - mean).transpose();
  const double n = static_cast<double>(errors.size());
  const double isotropic = squares.trace() / (2 * (n - 1));
  const double freedom = 2 * n - 2;
  const Eigen::Matrix2d scatter =
      (squares + isotropic_weight * isotropic * Eigen::Matrix2d::Identity()) /
      (n - 1 + isotropic_weight);
  const Eigen::LLT<Eigen::Matrix2d> root(noise);
  if (root.info() != Eigen::Success)
    return compute_variance_factor(1, freedom, false) * scatter / n;
  const Eigen::Matrix2d l = root.matrixL(), l_inverse = l.inverse();
  auto [values, axes] =
      eigendecompose(Eigen::Matrix2d(l_inverse * scatter * l_inverse.transpose()));
  const double ratio = (l_inverse * squares * l_inverse.transpose()).trace() / freedom;
  for (double& value : values) value = compute_variance_factor(value, freedom, true, ratio);
  return l * axes * values.asDiagonal() * axes.transpose() * l.transpose() / n;
}

/// Returns the derivative of the offset with respect to the fixes. The offset compensates the mean
/// change of those that are used.
Eigen::Matrix2Xd differentiate_by_fixes(const std::vector<bool>& used,
                                        const Eigen::Matrix2d& image_from_floor) {
  Eigen::Matrix2Xd jacobian = Eigen::Matrix2Xd::Zero(2, 2 * std::ssize(used));
  const auto count = static_cast<double>(std::ranges::count(used, true));
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (used[i])
      jacobian.middleCols<2>(2 * static_cast<Eigen::Index>(i)) = -image_from_floor / count;
  }
  return jacobian;
}

}  // namespace

Circle fit_dispersion_circle(const std::vector<Eigen::Vector2d>& points, DispersionCircle kind) {
  if (kind == DispersionCircle::enclosing) return enclose_in_circle(points);
  Circle circle{compute_mean_point(points), 0};
  for (const auto& point : points) {
    circle.radius = std::max(circle.radius, (point - circle.center).norm());
  }
  return circle;
}

ChenGuanOffset estimate_chen_guan_offset(const ReferencePointFixes& reference_fixes,
                                         const Eigen::Vector2d& focal_px, DispersionCircle kind,
                                         bool noise_is_stated) {
  const OptionalFixes fixes = reference_fixes.locate_with_offset({0, 0});
  const std::vector<bool> used = flag_inlier_fixes(fixes);
  const MeanFix mean_fix = compute_mean_fix(fixes, used);
  if (!mean_fix.are_yaws_similar()) return {.status = DispersionStatus::several_yaws};
  Eigen::Matrix2d image_from_floor =
      focal_px.asDiagonal() *
      Eigen::Matrix2d(complex_product_matrix(mean_fix.heading.normalized()).transpose() /
                      mean_fix.height_m);
  constexpr int max_iterations = 30;
  constexpr double tolerance_m = 1e-10;  // far below any noise
  Eigen::Vector2d offset_px = Eigen::Vector2d::Zero();
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    const auto errors_m = compute_errors(reference_fixes, offset_px, used);
    if (errors_m.size() < 2) break;
    const Eigen::Vector2d center_m = fit_dispersion_circle(errors_m, kind).center;
    if (iteration > 0) {
      image_from_floor = differentiate_mean_fix(reference_fixes, offset_px, used).inverse();
      if (!image_from_floor.allFinite()) break;
    }
    if (center_m.norm() > tolerance_m) {
      offset_px -= image_from_floor * center_m;
      continue;
    }
    ChenGuanOffset found{.status = DispersionStatus::ok, .offset_px = offset_px, .used = used};
    if (kind == DispersionCircle::mean) {
      const Eigen::Matrix2d noise_m2 =
          compute_mean_noise(reference_fixes.locate_with_offset(offset_px), used, noise_is_stated);
      const Eigen::Matrix2d mean_covariance_m2 = estimate_covariance(errors_m, noise_m2);
      Matrix2 covariance = image_from_floor * mean_covariance_m2 * image_from_floor.transpose();
      covariance(1, 0) = covariance(0, 1);
      found.covariance = covariance;
      found.jacobian_wrt_fixes = differentiate_by_fixes(used, image_from_floor);
    }
    return found;
  }
  return {.status = DispersionStatus::diverged};
}

}  // namespace vlp
