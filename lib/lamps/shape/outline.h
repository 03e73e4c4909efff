// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "lamps/image/background.h"
#include "lamps/image/image_view.h"
#include "lamps/image/runs.h"

namespace vlp {

/// A point of a light's outline: begin or end of a lit row, where it passes half of the level next
/// to the edge, to a fraction of a pixel.
struct EdgePoint {
  /// (column, row)
  Eigen::Vector2d pixel;
  /// Level of the light next to the edge, above the dark.
  double level;
  /// Width of the edge from 25 % to 75 % of the level, in pixels along the row.
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
  /// Whether the light's level inside varies from place to place, as with LED chips behind a
  /// diffuser. Neighbouring points then have a common error.
  bool mottled;
};

/// Refines the outline of a disc, whose rim is the upright ellipse in its box. The level is taken
/// at one depth below the outline everywhere, further in where a row cuts it at a flat angle. It is
/// extrapolated to the outline as that of a disc which darkens with the square of the distance from
/// its centre. A blur of standard deviation s, up to 1.5 px,
/// moves the half of the level outwards by s^2 level' / level - s^2 / (2 r), level' inwards and r
/// the rim's radius of curvature, which is undone to first order. Points where a row cuts flatter
/// than 20 degrees are left out.
///
/// A light is mottled if the residuals of lines through its levels are correlated from pixel to
/// pixel beyond chance. Its level at the rim differs from that further in: x, the rim, is fitted to
/// the pixels
/// from 3 s before it to 3 s + 1 px behind it, t = i - x, with the level o outside,
///
///     level(i) = o (1 - F(t / s)) + a F(t / s) + b (t F(t / s) + s f(t / s)),
///
/// a blurred step to a level that rises evenly; F, f: the normal distribution and its density.
RefinedOutline refined(const ImageView& image, const std::vector<EdgePoint>& points,
                       const DiscImage& disc, const Background& background);

/// Returns the first begin and the last end of each row: the outline of a light that an occluder
/// splits.
std::vector<EdgePoint> outermost(std::vector<EdgePoint> points);

/// Returns the two ends of each run, without those at the image's edge and those too short to
/// judge.
std::vector<EdgePoint> outline_of(const ImageView& image, const Blob& blob,
                                  const Background& background);

}  // namespace vlp
