// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "lamps/image/pixel_box.h"
#include "lamps/shape/light.h"

namespace vlp {

// Noise model of lamp centers, Light::sigma_px:
//
//     sigma^2 = trace(C) / 2 + sum of b^2
//
//   C  covariance of the center from the fit of its outline: fit_disc_outline(),
//      fit_rectangle_outline(), or OutlineEquations for a camera that moves
//   b  systematic errors per axis: another possible center, a hidden end, an unknown lens
//
// A center without an outline has ModulatedLight::center_sd_px.

/// Returns the standard deviation per axis, sqrt(trace(C) / 2), in the unit of the covariance C.
double compute_center_sd(const Matrix2& covariance);

/// Returns max(sigma_px, kMinSigma_px); std::nullopt if sigma_px exceeds kMaxSigma_px.
std::optional<double> limit_center_sd(double sigma_px);

/// Adds an independent error of the center to Light::sigma_px, up to kMaxSigma_px.
void add_center_error(double sd_px, Light& light);

/// Adds the error of a partly hidden light to its sigma. If the aspect ratio differs from that of
/// the lamp, an object may hide one end: the center of the visible part is offset by half of the
/// hidden length.
///
/// @param off      difference of the log aspect ratios of light and lamp
/// @param tilt_sd  standard deviation of the log aspect ratio from an unknown tilt
void add_hidden_end_error(double off, double tilt_sd, MeasuredLight& light);

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
double sd_without_lens_px(const Light& light, const ImageSize& image);

}  // namespace vlp
