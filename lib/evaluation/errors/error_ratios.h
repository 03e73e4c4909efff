// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "evaluation/errors/fix_errors.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"

namespace vlp {

/// Normalized errors: root mean square of error / reported standard deviation. 1 if the reported
/// values are correct, whatever their correlations; above 1 if errors are larger than reported.
struct NormalizedErrors {
  /// Root mean square of error / reported standard deviation, over the x and y of all fixes whose
  /// reported standard deviations are positive. Their number is `fixes`.
  double horizontal;  // of x and y
  std::size_t fixes;
  std::optional<double> height, yaw;
  /// Fractions of the errors within kWithin95 standard deviations: x and y together, height, yaw.
  /// 0.95 is expected for correct values and normal errors. Errors of one calibration and map are
  /// correlated: the fraction of one camera may be far from 0.95, that over many cameras should
  /// not.
  double within_95;
  std::optional<double> height_within_95, yaw_within_95;
};
/// Number of standard deviations that contain 95 % of a normal distribution.
inline constexpr double kWithin95 = 1.959964;
/// Computes the normalized errors. Returns std::nullopt if no fix reports standard deviations. Not
/// for errors against a path, which lack the component along it.
std::optional<NormalizedErrors> normalize_errors(const std::vector<FixRow>& fixes,
                                                 const std::vector<FixError>& errors);

/// Errors in units of the theoretical limit (Cramer-Rao lower bound).
struct CrlbRatio {
  /// Horizontal ratio sqrt(mean |error|^2 / mean limit^2). 1 is the best that an unbiased method
  /// can reach with this noise from one image of a level camera. Other frames, a known height, or
  /// partly visible lamps are additional information and not included.
  double horizontal;
  /// RMS of the horizontal limit over those fixes, x and y together: sqrt(mean (var x + var y)).
  double crlb_m;
  /// Number of fixes at whose true pose there is a limit.
  std::size_t fixes;
  /// Standard deviation of `horizontal` where its expectation is 1: sqrt(sum 2 tr C^2) / (2 sum tr
  /// C), for normal errors with the limits' covariances C of x and y. For n isotropic covariances
  /// of equal size it is 1 / sqrt(4 n).
  double sd;

  /// Returns true if the errors are below the limit by more than three sd, by chance in 1 of 700
  /// cases. Systematic errors only increase the ratio.
  bool are_errors_below_crlb() const;
};
/// Computes the ratio to the limit at the true pose of each fix: ErrorBudget::noise, for a level
/// camera and all lamps of the map that are wholly in its image.
///
/// Returns std::nullopt if the ground truth has no height and yaw, or if two lamps are visible from
/// no position.
/// @pre noise_px > 0, intrinsics match the lens model, threads > 0
std::optional<CrlbRatio> compute_crlb_ratio(const std::vector<FixError>& errors,
                                            const std::vector<TruthRow>& truth,
                                            const LampMap& lamps, const Camera& camera,
                                            double noise_px, int threads);

}  // namespace vlp
