// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/errors/error_ratios.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>

#include "camera/lens.h"
#include "captures/parallel_for.h"
#include "evaluation/errors/floor_limits.h"
#include "positioning/error_budget.h"

namespace vlp {
namespace {

/// Returns chi2(0.975; dof) / dof by the approximation of Wilson and Hilferty (1931, PNAS 17,
/// 684-688): 2 % too small for one degree of freedom, 0.6 % for two.
double compute_chi_square_ratio(double dof) {
  const double variance = 2 / (9 * dof);
  return std::pow(1 - variance + kWithin95 * std::sqrt(variance), 3);
}

/// Normalized errors of fixes along `axes` axes: x and y, or x alone.
class Ratios {
 public:
  explicit Ratios(int axes) : axes_(axes) {}

  void add(const Eigen::Vector2d& error, double yaw_rad, std::size_t cluster) {
    errors_.push_back(error);
    yaws_rad_.push_back(yaw_rad);
    clusters_.insert(cluster);
  }

  /// Returns std::nullopt if there are no errors.
  std::optional<NormalizedError> summarize() const {
    if (errors_.empty()) return std::nullopt;
    const double count = static_cast<double>(errors_.size()), axes = axes_;
    Eigen::Vector2d mean = Eigen::Vector2d::Zero(), camera_mean = mean;
    for (const Eigen::Vector2d& error : errors_) mean += error / count;
    double mean_square = 0, within = 0;
    for (std::size_t i = 0; i < errors_.size(); ++i) {
      mean_square += errors_[i].squaredNorm() / (axes * count);
      within += static_cast<double>((errors_[i].head(axes_).array().abs() <= kWithin95).count());
      if (axes_ == 2)
        camera_mean += Eigen::Rotation2Dd(-yaws_rad_[i]) * (errors_[i] - mean) / count;
    }
    const double common = mean.squaredNorm() / axes, in_camera = camera_mean.squaredNorm() / axes;
    const double scatter = std::max(0.0, mean_square - common - in_camera);
    const double scatter_dof = axes * std::max(1.0, static_cast<double>(clusters_.size()) - axes);
    const double variance =
        (common * common + in_camera * in_camera) / axes + scatter * scatter / scatter_dof;
    NormalizedError result{std::sqrt(mean_square), 0, within / (axes * count)};
    if (variance > 0) {
      const double dof = mean_square * mean_square / variance;
      result.low = result.rms / std::sqrt(compute_chi_square_ratio(dof));
    }
    return result;
  }

 private:
  int axes_;
  std::vector<Eigen::Vector2d> errors_;
  std::vector<double> yaws_rad_;
  std::set<std::size_t> clusters_;
};

}  // namespace

std::optional<NormalizedErrors> normalize_errors(const std::vector<FixRow>& fixes,
                                                 const std::vector<FixError>& errors) {
  Ratios horizontal(2), height(1), yaw(1);
  std::size_t fixes_with_sd = 0;
  for (const FixError& error : errors) {
    const FixRow::Fix& fix = *fixes[error.fix].fix;
    if (!fix.sd || !(fix.sd->minCoeff() > 0)) continue;
    const Eigen::Vector4d& sd = *fix.sd;
    ++fixes_with_sd;
    horizontal.add(error.horizontal_m.cwiseQuotient(sd.head<2>()), fix.pose.yaw_rad, error.cluster);
    if (error.height_m) height.add({*error.height_m / sd[2], 0}, 0, error.cluster);
    if (error.yaw_rad) yaw.add({*error.yaw_rad / sd[3], 0}, 0, error.cluster);
  }
  if (fixes_with_sd == 0) return std::nullopt;
  return NormalizedErrors{*horizontal.summarize(), fixes_with_sd, height.summarize(),
                          yaw.summarize()};
}

bool CrlbRatio::are_errors_below_crlb() const {
  constexpr double num_sds = 3;
  return horizontal < 1 - num_sds * sd;
}

std::optional<CrlbRatio> compute_crlb_ratio(const std::vector<FixError>& errors,
                                            const std::vector<TruthRow>& truth,
                                            const LampMap& lamps, const Camera& camera,
                                            double noise_px, int threads) {
  const Lens lens(camera.lens_model, camera.intrinsics);
  std::vector<Eigen::Matrix2d> limits_m2(errors.size(), Eigen::Matrix2d::Zero());  // 0: no limit
  parallel_for(errors.size(), threads, [&](std::size_t i) {
    const TruthRow& place = truth[errors[i].truth];
    if (!place.z_m || !place.yaw_rad) return;
    const Pose pose{{place.xy_m.x(), place.xy_m.y(), *place.z_m}, *place.yaw_rad};
    const auto budget = compute_fix_budget(list_visible_positions(lamps, camera, pose), lens, pose,
                                           {noise_px, 0, 0, 0});
    if (budget) limits_m2[i] = budget->noise.topLeftCorner<2, 2>();
  });
  double errors_m2 = 0, limit_m2 = 0, variance_m4 = 0;
  std::size_t fixes = 0;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    if (!(limits_m2[i].trace() > 0)) continue;
    errors_m2 += errors[i].horizontal_m.squaredNorm();
    limit_m2 += limits_m2[i].trace();
    variance_m4 += 2 * limits_m2[i].squaredNorm();
    ++fixes;
  }
  if (fixes == 0) return std::nullopt;
  return CrlbRatio{std::sqrt(errors_m2 / limit_m2),
                   std::sqrt(limit_m2 / static_cast<double>(fixes)), fixes,
                   std::sqrt(variance_m4) / (2 * limit_m2)};
}

}  // namespace vlp
