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

/// What one lens model leaves of views that took no part in its solves.
struct TriedLens {
  LensModel model;
  /// Per axis, over the views that count; infinite when no lens of the model fits all of those.
  double rms_px = std::numeric_limits<double>::infinity();
};

constexpr std::size_t kLeastViewsToChoose = 6;

/// A lens of OPENCV_FISHEYE, and how far off its axis there are corners.
struct FisheyeFit {
  IntrinsicsSolution solution;
  double farthest_rad;
};

/// A lens model for a camera, and what it was chosen by.
struct LensChoice {
  LensModel model;
  /// The models tried, those with fewer parameters first, OPENCV4 before the fisheye.
  std::vector<TriedLens> tried;
  /// How far off the axis the board is seen, by OPENCV_FISHEYE, when that is where no OPENCVn has
  /// rays, at a right angle or beyond; else 0.
  double beyond_rad = 0;
  /// When one fits.
  std::optional<FisheyeFit> fisheye = {};
};

/// From here on no OPENCVn has rays.
inline constexpr double kRightAngle_rad = std::numbers::pi / 2;

/// OPENCV_FISHEYE; nothing when none fits the views to 2 px. input.lens_model is not looked at.
std::optional<FisheyeFit> fit_fisheye(IntrinsicsInput input);

/// Whether there may be corners far off the axis, 40 degrees or more by the focal length with which
/// the views' poses fit best. Takes a small part of the time of a solve.
bool may_be_wide(const IntrinsicsInput& input);

/// The lens model that the views call for, by cross-validation: the views go into three parts in
/// turn, every model with distortion is solved for with two of them (solve_intrinsics()) and judged
/// by the third, where only poses are fitted (held_out_rms_px()), until each view has been judged
/// once. A model is worse than another by the mean over the views of the logarithm of the ratio of
/// their squared residuals, in which the views of a few places do not outweigh the rest. Taken is
/// the model with the fewest parameters that is worse than the best by no more than two standard
/// errors of that: the one-standard-error rule of Breiman, Friedman, Olshen and Stone,
/// Classification and Regression Trees, 1984, 3.4.3, which with one error would take a model larger
/// than the lens in one of six cases. Views that every model leaves three times the usual residual
/// of do not count. No OPENCVn is solved for when OPENCV_FISHEYE fits and sees corners at 90
/// degrees off the axis or beyond. input.lens_model is not looked at. Nothing when no model fits
/// the views, or there are fewer than kLeastViewsToChoose.
std::optional<LensChoice> choose_lens(const IntrinsicsInput& input);

/// In words: the models with what they left, the one taken first.
std::string words_of(const LensChoice& choice);

}  // namespace vlp
