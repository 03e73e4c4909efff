// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "calibration/intrinsics/intrinsics.h"

namespace vlp {

/// Lens model with its residuals in views that were held out of its solves.
struct LensCandidate {
  LensModel model;
  /// RMS residual of the held-out views per axis, px, over the views that count
  /// (select_lens_model()). Infinity if no lens of the model fits all of them.
  double rms_px = std::numeric_limits<double>::infinity();
};

/// Minimum number of views for select_lens_model().
constexpr std::size_t kMinViewsToChoose = 6;

/// Fit of OPENCV_FISHEYE, and the largest angle of a corner off its axis.
struct FisheyeFit {
  IntrinsicsSolution solution;
  double max_corner_angle_rad;
};

/// Selected lens model and the results of its selection.
struct LensChoice {
  LensModel model;
  /// Candidates in the order of their number of parameters; OPENCV4 before OPENCV_FISHEYE.
  std::vector<LensCandidate> candidates;
  /// Largest angle of a corner off the axis of OPENCV_FISHEYE if it is at least a right angle,
  /// where no OPENCVn has rays; 0 otherwise.
  double beyond_right_angle_rad = 0;
  /// Fit of OPENCV_FISHEYE; std::nullopt if it does not fit.
  std::optional<FisheyeFit> fisheye = {};
};

/// Angle off the axis from which on no OPENCVn has rays.
inline constexpr double kRightAngle_rad = std::numbers::pi / 2;

/// Fits OPENCV_FISHEYE. Returns std::nullopt if no lens fits the views with an RMS residual of at
/// most 2 px.
std::optional<FisheyeFit> fit_fisheye_lens(const InitialSolutions& initial);

/// Returns true if OPENCV_FISHEYE certainly fits the views worse than another model, and if all
/// corners are certainly less than 90 degrees off the axis. Compares the models after stage 3 of
/// solve_intrinsics(), which takes a quarter of the time of a solve.
///
/// The corners are then not yet corrected for curvature and displacement of the edges. Both models
/// have these errors, so that the ratio of their residuals is closer to 1 than after all stages.
bool is_fisheye_model_clearly_worse(const InitialSolutions& initial, LensModel other);

/// Returns true if corners may be more than 40 degrees off the axis. Assumes the focal length with
/// which the poses of the views fit best. Takes a small fraction of the time of a solve.
bool may_be_wide_angle_lens(const InitialSolutions& initial);

/// Selects a lens model by three-fold cross-validation. Every third view is in the same part.
///
/// Each model with distortion is solved with two parts (solve_intrinsics()) and evaluated with the
/// third, so that each view is evaluated once. The evaluation fits only poses and edge shifts
/// (compute_held_out_view_residual_rms_px()). Two models are compared by the mean, over the views,
/// of the logarithm of the ratio of their squared residuals. The views of a few positions do not
/// dominate this mean.
///
/// Selects the model with the fewest parameters whose mean exceeds that of the best by at most two
/// standard errors: the one-standard-error rule of Breiman, Friedman, Olshen and Stone,
/// Classification and Regression Trees, 1984, 3.4.3. With one standard error, the rule would select
/// a model larger than the lens in one of six cases.
///
/// Views in which the residuals of every model exceed three times the typical residual do not
/// count. OPENCVn models are skipped if OPENCV_FISHEYE fits and has corners at 90 degrees off the
/// axis or more.
/// @return std::nullopt if no model fits the views, or with fewer than kMinViewsToChoose views
std::optional<LensChoice> select_lens_model(const InitialSolutions& initial);

/// Describes the candidates with their residuals, the selected one first.
std::string describe_lens_model_choice(const LensChoice& choice);

}  // namespace vlp
