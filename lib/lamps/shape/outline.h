// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "lamps/image/background.h"
#include "lamps/image/image_view.h"
#include "lamps/image/pixel_runs.h"

namespace vlp {

/// Point of a light's outline: subpixel position along a row at which the level passes half of that
/// inside the edge.
struct EdgePoint {
  /// Position (column, row) in the image whose rows are the scanlines, px. The column is
  /// fractional; the row is an integer.
  Eigen::Vector2d pixel;
  /// Level of the light inside the edge, above the dark level, in gray levels.
  double level;
  /// Width of the edge from 25 % to 75 % of the level, in pixels along the row.
  double rise_px;
  /// True if the light begins at this point of the row, false if it ends.
  bool is_run_begin;
};

/// Image of a disc: bounding box of its rim and image of its center, (column, row) each.
struct DiscImage {
  Eigen::Vector2d box_min, box_max, center;
};

/// Result of refine_disc_outline(): the outline of a light with refined points.
struct RefinedOutline {
  std::vector<EdgePoint> points;
  /// True if the level inside the light varies locally, as with LED chips behind a diffuser. Errors
  /// of neighboring points are then correlated.
  bool is_mottled;
};

/// Refines the outline of a disc whose rim is the axis-aligned ellipse in its box. Excludes points
/// whose row cuts the rim at less than 20 degrees.
///
/// The level inside is measured at a constant depth below the outline, further inside where a row
/// cuts it at a flat angle. It is extrapolated to the outline with the profile of a disc that
/// darkens with the square of the distance from its center. A blur of standard deviation s, up to
/// 1.5 px, moves the half-level point outwards by
///
///     s^2 level' / level - s^2 / (2 r),
///
/// level' the slope of the level inwards and r the radius of curvature of the rim. This is
/// corrected to first order.
///
/// A light is mottled if the residuals of line fits to its levels are correlated from pixel to
/// pixel beyond chance. Its level at the rim then differs from that further inside. In this case
/// the rim x is fitted to the pixels from 3 s before it to 3 s + 1 px behind it. With t = i - x and
/// the level o outside,
///
///     level(i) = o (1 - F(t / s)) + a F(t / s) + b (t F(t / s) + s f(t / s)),
///
/// a blurred step to a level that rises linearly; F, f: the normal distribution and its density.
RefinedOutline refine_disc_outline(const ImageView& image, const std::vector<EdgePoint>& points,
                                   const DiscImage& disc, const Background& background);

/// Returns the first begin and the last end of each row: the outline of a light that an occluder
/// splits.
std::vector<EdgePoint> select_outermost_edge_points(std::vector<EdgePoint> points);

/// Returns the two ends of each run. Excludes ends at the image border and ends of runs that are
/// too short.
std::vector<EdgePoint> find_blob_outline(const ImageView& image, const Blob& blob,
                                         const Background& background);

}  // namespace vlp
