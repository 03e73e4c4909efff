// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "lamps/image/background.h"
#include "lamps/image/pixel_box.h"
#include "lamps/shape/light.h"
#include "lamps/shape/light_center.h"
#include "lamps/shape/robust_ellipse.h"

namespace vlp {

// Noise model of lamp centers, Light::sigma_px:
//
//     sigma^2 = n trace(C) / 2 + sum of b^2
//
//   C  covariance of the center from the fit of its outline: fit_robust_circle(),
//      fit_straight_edge(), estimate_outline_offset(), or OutlineSums for a camera that moves
//   n  number of points with a common error, 1 if their errors are independent
//   b  systematic errors per axis: another tone curve, another possible center, a hidden end, an
//      unknown lens
//
// A rim without clear steps has the standard deviation of the jackknife. A center without an
// outline has ModulatedLight::center_sd_px.

/// Returns the standard deviation per axis, sqrt(n trace(C) / 2 + |bias|^2 / 2), in the unit of
/// the covariance C.
double compute_center_sd(const Matrix2& covariance, double num_correlated = 1,
                         const Eigen::Vector2d& bias = Eigen::Vector2d::Zero());

/// Returns the standard deviation, at least kMinSigma_px; std::nullopt if it exceeds kMaxSigma_px.
std::optional<double> limit_center_sd(double sigma_px);

/// Adds an independent error of the center to Light::sigma_px, up to kMaxSigma_px.
void add_error_to_center_sigma(double sd_px, Light& light);

/// Returns the number of points with a common error. It is the sum of the products of the errors of
/// neighboring points, including their own squares, divided by the sum of squares. For independent
/// errors the fit, which removes three degrees of freedom, causes products of -3 / n of the mean
/// square; this is corrected.
///
/// @param points   outline in the plane of the fit
/// @param outline  the same points in the image
/// @param counted  points that are used
double estimate_num_correlated_points(const std::vector<Eigen::Vector2d>& points,
                                      const std::vector<EdgePoint>& outline,
                                      const std::vector<bool>& counted, const RobustEllipse& fit);

/// Returns the number of points with a common error: those of a stripe, on consecutive scanlines.
double count_outline_points_per_stripe(const std::vector<EdgePoint>& outline);

/// Returns the standard deviation per axis of a light's center by the delete-a-group jackknife
/// (Efron and Tibshirani 1993, section 11.5): its outline is fitted again without each of its
/// pieces. A piece on another edge than the others moves the center by more than the scatter of its
/// points. Outliers of the fit are excluded beforehand. Returns std::nullopt if the outline without
/// one of the pieces has no center.
std::optional<double> estimate_center_sd_by_jackknife_px(const Light& light,
                                                         const Background& background,
                                                         const LightShape& shape);

/// Adds the error of a partly hidden light to its sigma. If the aspect ratio differs from that of
/// the lamp, an object may hide one end: the center of the visible part is offset by half of the
/// hidden length.
///
/// @param off      difference of the log aspect ratios of light and lamp
/// @param tilt_sd  standard deviation of the log aspect ratio from an unknown tilt
void add_hidden_end_error_to_center_sigma(double off, double tilt_sd, Light& light);

/// Predicts the error of a lamp's center if the lens is unknown, as a standard deviation per axis,
/// px. The cause is that the center of an outline is not the image of the lamp's center. Returns 0
/// for rectangles, because the curvature of their edges determines the error.
///
/// A lens that images a ray of slope r at the distance f g(r) from its axis separates the two
/// points by
///
///     f q^2 (3/8 g'' + 1/8 (g' / r - g / r^2) + 1/4 g' (g' / g - 1 / r)),
///
/// with q the disc's radius as a slope. This is the first harmonic of the effect of the second
/// order of g on the outline. Let a be the outline's radius and R its distance from the axis, both
/// in pixels. For g = r - k r^3 the shift is 3 k a^2 R / f^2. For the equidistant lens (g = atan r,
/// k = 1/3) it is at most a^2 R / f^2 at any R. A camera tilt t shifts the center by a^2 tan(t) / f
/// (Heikkila and Silven 1997).
///
/// The bound assumes an equidistant lens of 115 degrees from corner to corner; f is then half of
/// the image's diagonal. The camera is assumed to be tilted by 10 degrees. It is used as one
/// standard deviation of the shift. Lenses of consumer cameras distort less, a fisheye of 180
/// degrees up to 2.5 times as much.
double predict_center_sd_without_lens_px(const Light& light, const ImageSize& image);

}  // namespace vlp
