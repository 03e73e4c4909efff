// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "calibration/intrinsics/intrinsics.h"

namespace vlp {

/// Lens model with its fit to the corners of a solution, compared with the other models.
struct LensCandidate {
  LensModel model;
  /// RMS residual per axis of a view to which the lens was not fitted, px, as the geometric mean
  /// over the views (compute_left_out_squares_px2()). Infinity if no lens of the model fits.
  double rms_px = std::numeric_limits<double>::infinity();
  /// `rms_px` relative to the smallest one of all candidates, minus 1. The model is rejected if
  /// this exceeds `max_excess`. It may describe the lens up to `max_plausible_excess`.
  double excess = std::numeric_limits<double>::infinity(), max_excess = 0, max_plausible_excess = 0;
  /// Fit of the model; std::nullopt if there is none.
  std::optional<IntrinsicsSolution> fit = {};

  bool is_rejected() const { return !(excess <= max_excess); }
  bool may_describe_lens() const { return excess <= std::max(max_excess, max_plausible_excess); }
};

/// Minimum number of views for the selection of a lens model, and for the comparison of the models.
constexpr std::size_t kMinViewsToChoose = 6, kMinViewsToCompare = 5;

/// Fit of OPENCV_FISHEYE, and the largest angle of a corner off its axis.
struct FisheyeFit {
  IntrinsicsSolution solution;
  double max_corner_angle_rad;
};

/// Comparison of the lens models, and the selected one.
struct LensChoice {
  LensModel model;
  /// Candidates in the order of their number of parameters; OPENCV4 before OPENCV_FISHEYE.
  std::vector<LensCandidate> candidates;
  /// Largest angle of a corner off the axis of the compared solution if it is at least a right
  /// angle, where no OPENCVn has rays; 0 otherwise.
  double beyond_right_angle_rad = 0;
};

/// Angle off the axis from which on no OPENCVn has rays.
inline constexpr double kRightAngle_rad = std::numbers::pi / 2;

/// Returns the largest angle of a corner off the axis.
double compute_max_corner_angle_rad(const IntrinsicsSolution& solution);

/// Returns false if all corners are certainly less than 90 degrees off the axis: after stage 3 of
/// solve_intrinsics() for OPENCV_FISHEYE, which takes a quarter of the time of a solve.
bool may_exceed_right_angle(const InitialSolutions& initial);

/// Fits OPENCV_FISHEYE. Returns std::nullopt if no lens fits the views with an RMS residual of at
/// most 2 px.
std::optional<FisheyeFit> fit_fisheye_lens(const InitialSolutions& initial);

/// Returns true if OPENCV_FISHEYE certainly fits the views worse than another model, without
/// corners beyond 90 degrees off the axis (may_exceed_right_angle()). Compares the models after
/// stage 3.
///
/// The corners are then not yet corrected for curvature and displacement of the edges. Both models
/// have these errors, so that the ratio of their residuals is closer to 1 than after all stages.
bool is_fisheye_worse(const InitialSolutions& initial, LensModel other);

/// Returns true if corners may be more than 40 degrees off the axis. Assumes the focal length with
/// which the poses of the views fit best. Takes a small fraction of the time of a solve.
bool may_be_wide_angle(const InitialSolutions& initial);

/// Solves OPENCV8, and OPENCV_FISHEYE for wide lenses if it may fit. Returns the solution with the
/// smaller residuals, that of OPENCV_FISHEYE if corners are 90 degrees off its axis or more.
IntrinsicsSolution solve_opencv8_or_fisheye(const InitialSolutions& initial);

/// Compares the models with distortion by cross-validation and selects one.
///
/// Each model is fitted to the corners of `reference`, with its corrections, weights and outliers,
/// starting from its lens. The views are divided into five blocks of consecutive views. Each view
/// is evaluated with the lens of the other blocks (compute_left_out_squares_px2()).
/// Consecutive views are often alike, and have the same errors and the same blind spots.
///
/// Two models are compared by the mean, over the views, of the logarithm of the ratio of their
/// squared residuals. The views of a few positions do not dominate this mean. A model is rejected
/// if its mean exceeds that of the best by more than one standard error over the views, widened
/// for few views (compute_squared_t_bound()). A model with a smaller mean than the selected
/// one is never rejected. The smallest model that is not rejected is selected: the
/// one-standard-error rule of Breiman, Friedman, Olshen and Stone, Classification and Regression
/// Trees, 1984, 3.4.3. With two standard errors, few views select wrong models with a bias that
/// exceeds the scatter of larger ones.
///
/// Two standard errors, over the views or over the blocks, are used for
/// LensCandidate::may_describe_lens().
///
/// OPENCVn models are not compared if corners are at 90 degrees off the axis or more.
/// @return std::nullopt if no model fits the views, or with fewer than kMinViewsToCompare views
std::optional<LensChoice> compare_lens_models(const IntrinsicsSolution& reference);

/// Selects a lens model by compare_lens_models(), with solve_opencv8_or_fisheye() as reference;
/// with OPENCV4 if that fails.
/// @return std::nullopt if no model fits the views, or with fewer than kMinViewsToChoose views
std::optional<LensChoice> select_lens_model(const InitialSolutions& initial);

/// Describes the candidates with the figures that were compared, the selected one first.
std::string describe_lens_choice(const LensChoice& choice);

}  // namespace vlp
