// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "geometry/types.h"
#include "lamps/image/background.h"
#include "lamps/image/image_view.h"
#include "lamps/shape/light_center.h"
#include "lamps/shape/line_levels.h"

namespace vlp {

/// Side of a rectangle in the plane of LightShape, from one corner to the next; the light is on its
/// left.
struct Side {
  Eigen::Vector2d from, to;

  Eigen::Vector2d edge_direction() const { return (to - from).normalized(); }
  Eigen::Vector2d inward_normal() const {
    const Eigen::Vector2d along = edge_direction();
    return {-along.y(), along.x()};
  }
};

/// Image data for the fit of an edge of a light. `lines` is an image whose rows are the scanlines,
/// and `levels` are the light's levels on them. `dark` is the dark level of the image, in gray
/// levels. Edges are straight in the plane of `shape`.
struct EdgeImage {
  const ImageView& lines;
  const LineLevels& levels;
  double dark;
  /// Size of a pixel in the plane of `shape`, in the unit of that plane.
  double per_px;
  const LightShape& shape;
};

/// Levels across an edge, as fractions of that of the scanline. With d, the distance from the edge
/// in pixels, inside positive, and F, the normal distribution, the level is
///
///     h(d) + (L(d) - h(d)) F(d / blur_px),    L(d) = inside + inside_slope d,
///                                             h(d) = outside + outside_slope d.
///
/// The slopes are those of a light that is dimmer near its edge, and of the halo around it.
struct EdgeProfile {
  double blur_px, inside, inside_slope, outside, outside_slope;  ///< slopes per px

  /// Returns the level at a depth, as a fraction of that of the scanline. Slopes end 6 px from the
  /// edge, and the level outside is not negative.
  double compute_level(double depth_px) const;
};

/// Edge of a light that was fitted along a side.
struct StraightEdge {
  /// Line segment on the fitted edge, in the plane of LightShape.
  Side side;
  /// Covariance of the distances of both ends from the edge, in square pixels.
  Matrix2 covariance_px;
  /// Levels across the middle of the edge.
  EdgeProfile profile;
  /// Sagitta of the edge: distance of its middle from the line through its ends, px; 0 with a lens.
  double sagitta_px;
  /// Fraction of the pixels next to the edge that the model explains.
  double explained_fraction;
  /// Points (column, row) where lit scanlines cross the edge.
  std::vector<Eigen::Vector2d> points;
};

/// Search window around a side, and the levels across the light's other edges.
struct EdgeSearch {
  /// Half-width of the search window across the side.
  double reach_px;
  /// Maximum number of sampling positions along the side.
  std::size_t positions;
  /// std::nullopt if unknown.
  std::optional<EdgeProfile> profile = {};
};

/// Prior of a hidden edge from the other edges: distance of its middle from the side, inside
/// positive, with standard deviation. The slant is half the difference of the distances of its
/// ends; its mean is 0.
struct HiddenEdgePrior {
  double offset_px, offset_sd_px, slant_sd_px;
};

/// Fits the edge near a side of a light whose scanlines are lit to levels s(line). With d, the
/// distance from the edge in pixels, inside positive, and F, the normal distribution, the model of
/// a pixel is
///
///     dark + s(line) (h(d) + (L(t, d) - h(d)) F(d / blur)),    t from 0 to 1 along the side.
///
/// L is the level inside, a parabola in t and linear in d, and h that outside, linear in d, both as
/// fractions of s. The edge is at half of the local step; a dark scanline does not constrain it.
/// Gauss-Newton with Tukey's biweight minimizes the residuals of all pixels near the side over the
/// position of both ends, blur, L and h.
///
/// d is measured in the plane of LightShape with a lens. Without a lens the curvature of the edge
/// is one more unknown. Its prior is the curvature that a lens of 115 degrees from corner to corner
/// causes for this side. Short sides barely determine L: its prior is a change by 10 % in 100 px.
/// The slopes of L and h across the edge are 0 within 3 % per pixel. If `search` has a
/// profile, the prior of the blur is that of the profile within 15 %. Pixels on scanlines
/// with an uncertain level have less weight.
///
/// The covariance includes the scatter of the pixels and the standard deviations of the scanline
/// levels, see LineLevels. Returns std::nullopt if the standard deviation of an end exceeds 0.5 px,
/// or if less than 80 % of the pixels match the edge model.
std::optional<StraightEdge> fit_straight_edge(const EdgeImage& image, const Side& side,
                                              const EdgeSearch& search);

/// Estimates an edge that a dark stripe hides partly or completely: the mean and the covariance of
/// its ends, from the likelihood of all pixels near the side.
///
/// An edge in a dark stripe lies beyond the last lit scanline. It lies before the next scanline
/// that would be lit if the light extended to it. The levels across the edge are those of
/// the profile; the level of each scanline may vary within its standard deviation, and
/// all together by 20 %. The probability, times the prior, is summed on a grid of offsets and
/// slants that is refined four times. Returns std::nullopt if the side is not in the image, or if
/// the mean contradicts 30 % of the pixels on lit scanlines. The edge may lie outside the image; it
/// has no `points`.
///
/// @pre search.profile has a value
std::optional<StraightEdge> estimate_position_of_edge_in_dark_stripe(const EdgeImage& image,
                                                                     const Side& side,
                                                                     const EdgeSearch& search,
                                                                     const HiddenEdgePrior& prior);

}  // namespace vlp
