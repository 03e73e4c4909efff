// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "evaluation/errors/fix_errors.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"

namespace vlp {

/// Root mean square of error / reported standard deviation. 1 if the reported values are correct,
/// whatever their correlations; above 1 if errors are larger than reported.
struct NormalizedError {
  double rms = 0;
  /// Lower limit of the 95 % interval of the ratio of true to reported standard deviations, which
  /// allows for errors that the fixes have in common: rms sqrt(v / chi2(0.975; v)).
  ///
  /// The degrees of freedom v are those of Welch and Satterthwaite (JCGM 100:2008, G.4.1) for the
  /// mean square, v = rms^4 / sum(c_i^2 / v_i). Its parts c_i are the square of the mean error, of
  /// the mean error in the frame of the camera (horizontal only), and the scatter, whose v_i is the
  /// number of clusters less the fitted means. A unit has one calibration: if its error dominates,
  /// the rms of correct fixes has 1 or 2 degrees of freedom, however many fixes there are.
  double low = 0;
  /// Fraction of the errors within kWithin95 standard deviations: 0.95 is expected over many
  /// cameras; that of one camera may be far from it.
  double within_95 = 0;
};

/// Normalized errors of x and y together over `fixes` fixes, height and yaw.
struct NormalizedErrors {
  NormalizedError horizontal;
  std::size_t fixes;
  std::optional<NormalizedError> height, yaw;
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
