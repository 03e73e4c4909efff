// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "lamps/image/background.h"
#include "lamps/image/image_view.h"
#include "lamps/image/runs.h"

namespace vlp {

/// A point of a light's outline: where a lit row begins or ends, at half the level between the dark
/// and the light next to the edge, to a fraction of a pixel.
struct EdgePoint {
  /// (column, row)
  Eigen::Vector2d pixel;
  /// Of the light next to the edge, above the dark.
  double level;
  /// From a quarter to three quarters of the level, in pixels along the row.
  double rise_px;
  /// Whether the light begins here, or ends.
  bool begins;
};

/// The image of a disc: the box around its rim, and the image of its centre, (column, row) each.
struct DiscImage {
  Eigen::Vector2d low, high, center;
};

struct RefinedOutline {
  std::vector<EdgePoint> points;
  /// Whether the light's level inside varies from place to place, as LED chips behind a diffuser
  /// make it. What it does next to the outline neighbouring points have in common.
  bool mottled;
};

/// The points again, now that the light is known to be a disc, whose rim is taken as the upright
/// ellipse in its box: the level is taken at the same depth below the outline everywhere, where a
/// row cuts it at a flat angle further in, and extrapolated to it as that of a disc which darkens
/// with the square of the distance from its centre. A blur of standard deviation s, up to 1.5 px,
/// moves the half of the level outwards by s^2 level' / level - s^2 / (2 r), level' inwards and r
/// the rim's radius of curvature, which is undone to first order. Points where a row cuts flatter
/// than 20 degrees are left out.
///
/// A light is mottled when what lines through its levels leave goes on from pixel to pixel beyond
/// chance. The level at its rim is not that further in: there x, the rim, is fitted to the pixels
/// from 3 s before it to 3 s + 1 px behind it, t = i - x, with the level o outside,
///
///     level(i) = o (1 - F(t / s)) + a F(t / s) + b (t F(t / s) + s f(t / s)),
///
/// a blurred step to a level that rises evenly; F, f: the normal distribution and its density.
RefinedOutline refined(const ImageView& image, const std::vector<EdgePoint>& points,
                       const DiscImage& disc, const Background& background);

/// Of each row the first begin and the last end: the outline of a light that something in the way
/// splits.
std::vector<EdgePoint> outermost(std::vector<EdgePoint> points);

/// The two ends of each run, but those at the image's edge and those too short to tell.
std::vector<EdgePoint> outline_of(const ImageView& image, const Blob& blob,
                                  const Background& background);

}  // namespace vlp
