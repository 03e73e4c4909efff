// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace vlp {

/// Pixel next to an edge of a tag.
struct EdgePixel {
  /// Coordinates of the pixel relative to the edge: `along` is w, from -1 at one end to 1 at the
  /// other; `across_px` is the distance v from the straight edge, px, positive outside the tag.
  double along, across_px;
  /// Gray level of the pixel, 0 to 255, as in the image.
  double level;
  /// Width of the black stripe inside the edge at this w, px, and white fraction (0 to 1) of the
  /// pattern behind the stripe.
  double stripe_px, white_behind;
};

/// Curve v = a + b w + c w^2 + d w^3 relative to a straight line. The coordinates of a pixel x are
///   w = along.(x - middle) / half_length_px,  v = across.(x - middle).
struct EdgeCurve {
  static constexpr int kTerms = 3, kMaxTerms = 4;
  using Coefficients = Eigen::Matrix<double, kMaxTerms, 1>;

  Eigen::Vector2d middle, along, across;
  double half_length_px;
  Coefficients coefficients = Coefficients::Zero();
  /// True if d is fitted; otherwise it is 0.
  bool cubic = false;
  double blur_px = 0.8;

  double curve_offset_px(double w) const {
    const Coefficients& c = coefficients;
    return c[0] + w * (c[1] + w * (c[2] + w * c[3]));
  }
  /// Returns the distance of a point from the curve in px along v, positive outwards.
  double signed_distance_outwards_px(const Eigen::Vector2d& x) const {
    return across.dot(x - middle) - curve_offset_px(along.dot(x - middle) / half_length_px);
  }
  /// Returns the gradient of signed_distance_outwards_px() with respect to the pixel (u, v);
  /// dimensionless.
  Eigen::Vector2d compute_distance_gradient(const Eigen::Vector2d& x) const;
};

/// Computes the intersection of two curves by Newton's method from a nearby point.
Eigen::Vector2d intersect_edge_curves(const EdgeCurve& a, const EdgeCurve& b,
                                      Eigen::Vector2d point);

/// Prior for the fit of an edge: tone curve, and expected blur and light.
struct EdgePrior {
  /// Tone curve, level = 255 (light / 255)^(1 / gamma).
  double gamma = 1;
  /// Prior of the blur and of the light on the brighter side. Each adds a residual in gray levels:
  /// blur_weight (blur - blur_px) and bright_weight (bright - bright_light). Weight 0: no prior.
  double blur_px = 0, blur_weight = 0;
  double bright_light = 0, bright_weight = 0;
};

/// Light of an edge for a tone curve: (middle + contrast step) (1 + slope . (w, v)).
struct EdgeLight {
  double gamma = 1, middle = 0, contrast = 0;
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
};

/// Result of fit_edge_curve().
struct EdgeFit {
  /// Sum of the squared residuals, in gray levels squared.
  double sum_of_squares;
  std::size_t pixels;
  /// True if the brighter side is saturated.
  bool is_saturated;
  /// Light on the brighter and on the darker side in the middle of the edge, in gray levels without
  /// tone curve.
  double bright_light, dark_light;
  EdgeLight light;
  /// Variance of the position of the ends across the edge (mean of both), in px^2. It applies to a
  /// noise of one gray level and a known curvature.
  double end_variance = 0;
  /// Sigma of the Gaussian with the MTF50 of the step, in px. The line spread may be flatter or
  /// more peaked than a Gaussian.
  double equivalent_blur_px = 0;
  /// Variances of the blur and of bright_light for a noise of one gray level. They are not computed
  /// (0) for gamma 1 without saturation, where both are well determined.
  double blur_variance = 0, bright_variance = 0;
};

/// Fits an edge to pixels by nonlinear least squares of their gray levels, with the tone curve and
/// the priors of `prior`.
///
/// @param edge      initial curve and blur; overwritten by the fit
/// @param previous  fit of the same pixels with another prior that found no saturation, if any.
///                  Its light is the initial one; otherwise the mean levels of both sides are.
/// @return          std::nullopt for fewer than 24 pixels, or if the pixels do not match the model
///
///   light = (middle + contrast step) (1 + slope . (w, v)),
///   step = s(e) + white_behind (1 + s(-e - stripe_px)),     e = v - a - b w - c w^2 - d w^3,
///   s(e) = erf(e / (sqrt(2) blur))
///
/// The edge is saturated if at least 25 % of the pixels on the brighter side are white. Levels
/// above 250 are then censored: residuals use min(level, 250), because the processing of a camera
/// leaves some saturated pixels below 255.
std::optional<EdgeFit> fit_edge_curve(EdgeCurve& edge, const std::vector<EdgePixel>& pixels,
                                      const EdgePrior& prior, const EdgeFit* previous = nullptr);

}  // namespace vlp
