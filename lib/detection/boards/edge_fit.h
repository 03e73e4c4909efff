// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace vlp {

/// A pixel beside an edge of a tag.
struct EdgePixel {
  /// w, -1 to 1 along the edge, and v, in px outwards.
  double along, across_px;
  double level;
  /// How wide the stripe inside the edge is there, and how white what follows upon it, 0 to 1.
  double stripe_px, white_behind;
};

/// A curve v = a + b w + c w^2 + d w^3 beside a straight line; at a pixel x
///   w = along.(x - middle) / half_px,  v = across.(x - middle).
struct EdgeCurve {
  static constexpr int kTerms = 3, kMostTerms = 4;
  using Coefficients = Eigen::Matrix<double, kMostTerms, 1>;

  Eigen::Vector2d middle, along, across;
  double half_px;
  Coefficients coefficients = Coefficients::Zero();
  /// d is asked for; else it is 0.
  bool cubic = false;
  double blur_px = 0.8;

  double value_at(double w) const {
    const Coefficients& c = coefficients;
    return c[0] + w * (c[1] + w * (c[2] + w * c[3]));
  }
  /// How far outside a point is.
  double off(const Eigen::Vector2d& x) const {
    return across.dot(x - middle) - value_at(along.dot(x - middle) / half_px);
  }
  /// Of off().
  Eigen::Vector2d gradient(const Eigen::Vector2d& x) const;
};

/// Where two curves cross, by Newton's method from a point near it.
Eigen::Vector2d crossing(const EdgeCurve& a, const EdgeCurve& b, Eigen::Vector2d point);

/// What is known of the edges of an image before one is fitted.
struct EdgePrior {
  /// Of the tone curve, level = 255 (light / 255)^(1 / gamma).
  double gamma = 1;
  /// About so much are the blur, and the light on the brighter side where white runs over: what
  /// counts as pixels with the residuals weight (blur - blur_px) and weight (bright -
  /// bright_light), in levels.
  double blur_px = 0, blur_weight = 0;
  double bright_light = 0, bright_weight = 0;
};

struct EdgeFit {
  /// Of the levels that are left over.
  double squares;
  std::size_t pixels;
  /// White runs over.
  bool runs_over;
  /// Light on the brighter and on the darker side in the middle of the edge, in levels behind no
  /// tone curve.
  double bright_light, dark_light;
  /// Of where an end is across the edge, in the mean of both, by noise of one level and with the
  /// bow known, in px^2.
  double end_variance = 0;
  /// Sigma of the Gaussian whose MTF50 is that of the step, in px: the line spread may be flatter
  /// or more peaked than a Gaussian.
  double equivalent_blur_px = 0;
  /// Of blur and bright_light, by noise of one level; of edges behind no curve, and not over
  /// white, 0 for that they are well known.
  double blur_variance = 0, bright_variance = 0;
};

/// Fits an edge, from where it is, by least squares of
///   light = (middle + contrast step) (1 + slope . (w, v)),
///   step = s(e) + white_behind (1 + s(-e - stripe_px)),     e = v - a - b w - c w^2 - d w^3,
/// with s(e) = erf(e / (sqrt(2) blur)), in levels, behind the prior's tone curve. Where a quarter
/// of the brighter side's pixels are white, white runs over: levels beyond 250 tell only that,
/// since a camera's processing leaves some of them below 255. Nothing when the pixels look
/// otherwise.
std::optional<EdgeFit> fit_edge(EdgeCurve& edge, const std::vector<EdgePixel>& pixels,
                                const EdgePrior& prior);

}  // namespace vlp
