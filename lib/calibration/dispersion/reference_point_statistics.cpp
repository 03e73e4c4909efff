// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/dispersion/reference_point_statistics.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "calibration/dispersion/offset_separation.h"
#include "geometry/angles.h"
#include "geometry/median.h"
#include "geometry/robust_scatter.h"
#include "geometry/statistical_bounds.h"

namespace vlp {
namespace {

constexpr double kMaxErrorFraction = 0.2;  // of the lamps' height

/// Computes q of compute_variance_factor().
double compute_student_factor(double degrees_of_freedom) {
  constexpr double sigmas_of_95_percent = 1.96;
  return compute_t_squared_bound(sigmas_of_95_percent, degrees_of_freedom) /
         (sigmas_of_95_percent * sigmas_of_95_percent);
}

/// Computes the weight of residuals that contradict given noise: 0 up to the ratio that 20 % of
/// all residuals exceed, 1 from that of 5 %, linear in between.
double compute_contradiction(double ratio, double degrees_of_freedom) {
  constexpr double sigmas_of_20_percent = 0.8416, sigmas_of_5_percent = 1.6449;
  const double first =
      chi_squared_bound(sigmas_of_20_percent, degrees_of_freedom) / degrees_of_freedom;
  const double last =
      chi_squared_bound(sigmas_of_5_percent, degrees_of_freedom) / degrees_of_freedom;
  return std::clamp((ratio - first) / (last - first), 0.0, 1.0);
}

}  // namespace

double MeanFix::yaw_variation() const {
  return std::sqrt(std::max(0.0, 1 - heading.squaredNorm()));
}

bool MeanFix::is_at_one_yaw() const {
  constexpr double one_yaw_rad = rad_from_deg(10);
  return yaw_variation() < std::sin(one_yaw_rad);
}

MeanFix compute_mean_fix(const OptionalFixes& fixes, const std::vector<bool>& used) {
  MeanFix mean_fix;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    if (!fixes[i] || !used[i]) continue;
    mean_fix.heading += Eigen::Vector2d(std::cos(fixes[i]->yaw_rad), std::sin(fixes[i]->yaw_rad));
    mean_fix.height_m += fixes[i]->height_m;
    ++mean_fix.count;
  }
  mean_fix.heading /= mean_fix.count;
  mean_fix.height_m /= mean_fix.count;
  return mean_fix;
}

bool is_at_one_yaw_without_one(const OptionalFixes& fixes, std::vector<bool> used) {
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (!fixes[i] || !used[i]) continue;
    used[i] = false;
    if (compute_mean_fix(fixes, used).is_at_one_yaw()) return true;
    used[i] = true;
  }
  return false;
}

bool are_all_fixes_far(const OptionalFixes& fixes) {
  return std::all_of(fixes.begin(), fixes.end(), [](const auto& fix) {
    return !fix || fix->error_m.norm() > kMaxErrorFraction * fix->height_m;
  });
}

double compute_variance_factor(double ratio, double degrees_of_freedom, bool noise_is_stated,
                               std::optional<double> pooled_ratio) {
  assert(degrees_of_freedom > 0);
  const double from_residuals = ratio * compute_student_factor(degrees_of_freedom);
  if (!noise_is_stated) return from_residuals;
  const double total_freedom = kStatedFreedom + degrees_of_freedom;
  const double combined = (kStatedFreedom + degrees_of_freedom * ratio) / total_freedom *
                          compute_student_factor(total_freedom);
  const double factor = std::max(1.0, combined);
  const double weight = compute_contradiction(pooled_ratio.value_or(ratio), degrees_of_freedom);
  return factor * std::pow(std::max(1.0, from_residuals / factor), weight);
}

std::vector<bool> find_near_median(const OptionalFixes& fixes) {
  std::vector<double> x, y, squares;
  for (const auto& fix : fixes) {
    if (!fix) continue;
    x.push_back(fix->error_m.x());
    y.push_back(fix->error_m.y());
  }
  const Eigen::Vector2d middle_m(upper_median(x), upper_median(y));
  for (const auto& fix : fixes) {
    if (fix) squares.push_back((fix->error_m - middle_m).squaredNorm());
  }
  const double freedom = 2 * static_cast<double>(squares.size()) - 2;
  const double variance = std::max(robust_planar_variance(squares, freedom), kFixRoundingVariance);
  const double limit = planar_outlier_bound(kFixOutlierSigmas, freedom) * variance;
  std::vector<bool> near;
  near.reserve(fixes.size());
  for (const auto& fix : fixes) {
    near.push_back(fix && (fix->error_m - middle_m).squaredNorm() <= limit);
  }
  return near;
}

}  // namespace vlp
