// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "evaluation/errors/fix_errors.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"

namespace vlp {

/// Errors in units of the standard deviations that the fixes state: root of the mean of (error /
/// sd) squared. 1 when they are honest, whatever their correlations; more when errors are larger
/// than stated.
struct StatedRatio {
  /// Over the fixes with a positive sd, and their number.
  double horizontal;  // of x and y
  std::size_t fixes;
  std::optional<double> height, yaw;
  /// Shares of the errors within kWithin95 standard deviations, of x and y, height, yaw: 0.95 when
  /// these are honest and the errors normal. Errors of one calibration and map go together: over
  /// one unit the share may be far from that, over many it may not.
  double within_95;
  std::optional<double> height_within_95, yaw_within_95;
};
/// Standard deviations that 95 % of a normal distribution lie within.
inline constexpr double kWithin95 = 1.959964;
/// Nothing when no fix states a sd. Not for errors against a path, which lack the part along it.
std::optional<StatedRatio> stated_ratio(const std::vector<FixRow>& fixes,
                                        const std::vector<FixError>& errors);

/// Errors in units of the theoretical limit.
struct LimitRatio {
  /// sqrt(mean |error|^2 / mean (limit)^2), horizontal: 1 is the best that any unbiased method
  /// reaches with this noise from one image of a level camera, without what else may be known:
  /// other frames, a height, lamps that are partly in view.
  double horizontal;
  /// Root of the mean squared limit of those fixes, x and y together.
  double limit_m;
  /// Fixes at whose true pose there is a limit.
  std::size_t fixes;
  /// Of `horizontal` by chance, where it is 1: sqrt(sum 2 tr C^2) / (2 sum tr C) of normal errors
  /// with the limits' covariances C of x and y; 1 / sqrt(4 n) of n round ones, all as large.
  double sd;

  /// By more than chance allows in 1 of 700 cases, three sd; what errors have in common only adds
  /// to them.
  bool beaten() const;
};
/// The limit at the true pose of each fix: ErrorBudget::noise, Cramer-Rao, for a level camera that
/// sees every lamp of the map that is wholly in its image. Nothing when the truth has no height and
/// yaw, or no place sees two lamps. Preconditions: noise_px > 0, intrinsics that are the lens
/// model's, threads > 0.
std::optional<LimitRatio> limit_ratio(const std::vector<FixError>& errors,
                                      const std::vector<TruthRow>& truth, const LampMap& lamps,
                                      const Camera& camera, double noise_px, int threads);

}  // namespace vlp
