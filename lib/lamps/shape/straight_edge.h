// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "geometry/types.h"
#include "lamps/image/background.h"
#include "lamps/image/image_view.h"
#include "lamps/shape/light_shape.h"
#include "lamps/shape/line_levels.h"

namespace vlp {

/// One side of a rectangle in the plane of LightShape, from one corner to the next; the light is on
/// its left.
struct Side {
  Eigen::Vector2d from, to;

  Eigen::Vector2d way() const { return (to - from).normalized(); }
  Eigen::Vector2d inwards() const {
    const Eigen::Vector2d along = way();
    return {-along.y(), along.x()};
  }
};

struct StraightEdge {
  /// With its ends where the edge was found.
  Side side;
  /// Covariance of the distances of both ends from the edge, in pixels (per_px of the plane).
  Matrix2 covariance_px;
  /// Sigma of the blur across it.
  double blur_px;
  /// Distance of its middle from the line through its ends; 0 with a lens.
  double bow_px;
  /// The share of the pixels next to it that it explains.
  double share;
  /// On the edge, where it is lit.
  std::vector<EdgePoint> points;
};

/// Pixels to use, and the blur that is expected.
struct EdgeSearch {
  /// Distance from the side, to both sides.
  double reach_px;
  /// Maximum number of places along the side.
  std::size_t stations;
  /// Sigma of the blur of the light's other edges; 0 if it is not known.
  double blur_px = 0;
};

/// Prior of a hidden edge, by the other edges: distance of its middle from the side, inside
/// positive, and half the difference of the distances of its ends, which is 0 but for its sd.
struct HiddenEdgePrior {
  double offset_px, offset_sd_px, slant_sd_px;
};

/// The edge near a side, of a light whose lines are lit to levels s(line). With d, the distance
/// from the edge in pixels, inside positive, and F, the normal distribution, pixels show
///
///     dark + s(line) (h + (L(t) - h) F(d / blur)),    t from 0 to 1 along the side,
///
/// with the level L(t), a parabola, inside and h outside, both shares of s: the edge is where half
/// of the local step is passed, and a dark line says nothing of it. The place of both ends, blur,
/// L (of which short sides tell little: it is taken to change by a tenth in 100 px, give or take)
/// and h are those with the least residuals of all pixels near the side (Gauss-Newton,
/// Tukey's biweight), d in rays behind the lens; without a lens a bow is one more unknown,
/// known beforehand to what a lens of 115 degrees from corner to corner bends a side so long.
/// Pixels on lines with an uncertain level have less weight. The blur is that of the search within
/// 15 %, if it has one. The covariance is by the scatter of the pixels and by the standard
/// deviations of the levels of lines, see LineLevels. Returns std::nullopt if that leaves an end
/// uncertain by more than half a pixel, or if most pixels do not look like an edge.
std::optional<StraightEdge> straight_edge_at(const ImageView& lines, const Side& side,
                                             const LineLevels& levels, double dark, double per_px,
                                             const EdgeSearch& search, const LightShape& shape);

/// Estimates an edge that a dark stripe hides in part or whole: the mean and the covariance of its
/// ends, by the probability of all pixels near the side.
///
/// An edge in a dark stripe lies between the last lit line and the next line that would be lit, if
/// the light reached so far. The pixels are those of straight_edge_at() with L = 1 and h = 0;
/// the level of each line is any within its standard deviation. The probability, times the prior,
/// is summed on a grid of offsets and slants, four times ever finer. Returns std::nullopt if the
/// side is not in the image, or if the mean contradicts a fifth of the pixels on lit lines. The
/// edge may lie outside the image; it has no `points`.
///
/// @pre search.blur_px > 0
std::optional<StraightEdge> hidden_edge_at(const ImageView& lines, const Side& side,
                                           const LineLevels& levels, double dark, double per_px,
                                           const EdgeSearch& search, const LightShape& shape,
                                           const HiddenEdgePrior& prior);

}  // namespace vlp
