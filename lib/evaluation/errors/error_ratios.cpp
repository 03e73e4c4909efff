// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/errors/error_ratios.h"

#include <cmath>

#include "camera/lens.h"
#include "captures/parallel_for.h"
#include "evaluation/errors/floor_limits.h"
#include "positioning/error_budget.h"

namespace vlp {
namespace {

/// Accumulator of normalized errors: root mean square, and fraction within 95 %.
class Ratios {
 public:
  void add(double value) {
    squares_ += value * value;
    ++count_;
    if (std::abs(value) <= kWithin95) ++within_;
  }
  std::optional<double> value() const {
    return count_ > 0 ? std::optional(std::sqrt(squares_ / static_cast<double>(count_)))
                      : std::nullopt;
  }
  std::optional<double> fraction_within_95() const {
    return count_ > 0 ? std::optional(static_cast<double>(within_) / static_cast<double>(count_))
                      : std::nullopt;
  }

 private:
  double squares_ = 0;
  std::size_t count_ = 0, within_ = 0;
};

}  // namespace

std::optional<NormalizedErrors> normalize_errors(const std::vector<FixRow>& fixes,
                                                 const std::vector<FixError>& errors) {
  Ratios horizontal, height, yaw;
  std::size_t fixes_with_sd = 0;
  for (const FixError& error : errors) {
    const auto& sd = fixes[error.fix].fix->sd;
    if (!sd || !(sd->minCoeff() > 0)) continue;
    ++fixes_with_sd;
    horizontal.add(error.horizontal_m.x() / (*sd)[0]);
    horizontal.add(error.horizontal_m.y() / (*sd)[1]);
    if (error.height_m) height.add(*error.height_m / (*sd)[2]);
    if (error.yaw_rad) yaw.add(*error.yaw_rad / (*sd)[3]);
  }
  if (fixes_with_sd == 0) return std::nullopt;
  return NormalizedErrors{*horizontal.value(),
                          fixes_with_sd,
                          height.value(),
                          yaw.value(),
                          *horizontal.fraction_within_95(),
                          height.fraction_within_95(),
                          yaw.fraction_within_95()};
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
