// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <optional>
#include <vector>

#include "lamps/shape/shear.h"
#include "lamps/signal/stripes.h"

namespace vlp {

/// Class of a light in an image.
enum class LightKind {
  lamp,         ///< identified and fully inside the image: usable for a position fix
  truncated,    ///< identified, but cut by the image border
  unknown,      ///< modulated, but not identified as one lamp of the map, see LightReason
  unmodulated,  ///< not modulated
  no_outline    ///< modulated, but cut by the image border or too small for an outline
};

/// Reason for the class of a light: the check that rejected it as a lamp, or `identified`. The
/// checks run in another order than that of the enumerators
/// (LightDetector::identify_lamps()).
enum class LightReason {
  identified,       ///< a lamp, possibly cut by the image border
  overexposed,      ///< steady: contrast below kMinContrast, most pixels at full scale
  unmodulated,      ///< steady: contrast below kMinContrast
  too_few_periods,  ///< below kMinPeriods, or no lamp of the image has kMinReliablePeriods
  no_clear_period,  ///< no period fits, its parts differ, or its stripes are irregular
  unknown_period,   ///< no lamp or several have its period, or other lamps contradict it
  reflection,       ///< blurrier, dimmer or smaller than another light, or its mirror image
  wrong_shape,      ///< its outline differs from that of its lamp, or cannot be fitted
  incomplete        ///< cut by the image border, or too small for an outline
};

/// Outline from which the center of a light is known.
enum class LightOutline {
  none,      ///< the center is the centroid of the lit area
  edge,      ///< edge of an evenly lit disc
  rim,       ///< rim of a disc whose level varies near the edge, such as of a reflector
  rectangle  ///< four straight edges
};

/// Light in an image. Without an outline `pixel` is the center of the lit area or of its box.
struct Light {
  LightKind kind;
  LightReason reason;
  /// Id of the lamp; also set for a lamp that the image border cuts.
  std::optional<int> lamp;
  /// Pixel (u, v) of the lamp's center.
  Eigen::Vector2d pixel;
  /// Standard deviation of `pixel` per axis, by the noise model in light_center_noise.h. Includes
  /// sd_without_lens_px() if the lens is unknown.
  double sigma_px;
  /// Radius in the image; for other shapes than discs the radius of the disc of equal area.
  double radius_px;
  /// Bounding box of the outline, (u, v).
  Eigen::AlignedBox2d box;
  LightOutline outline_kind;
  /// Points of the outline, (u, v); empty without an outline.
  std::vector<Eigen::Vector2d> outline;
  Stripes stripes;
  /// Width of the edge from 25 % to 75 % of the level, in pixels.
  double rise_px;
  /// Discs: fraction of the ends of scanlines that agree with the outline. Rectangles: fraction of
  /// the pixels along the worst edge that agree with the edge model. 1 without an outline.
  double inlier_fraction;
};

/// Ellipse |unit_from_plane (p - center)| = 1 in the plane of LightShape. With a lens it is a
/// circle.
struct PlaneEllipse {
  Eigen::Vector2d center;
  Matrix2 unit_from_plane;

  /// Returns the radius of the circle of equal area.
  double radius() const { return 1 / std::sqrt(std::abs(unit_from_plane.determinant())); }
};

/// Light with the values by which the detector identifies it.
struct MeasuredLight : Light {
  /// Outline of a round light in the plane of LightShape.
  PlaneEllipse plane_outline;
  /// Normal equations of the circle in the level plane, for discs with a known lens.
  std::optional<OutlineEquations> outline_equations;
  /// Polygon inside the edges of a rectangle, as pixels (u, v).
  std::vector<Eigen::Vector2d> inner_polygon;
  /// Ratio of the long to the short axis in the plane of LightShape, and the standard deviation of
  /// its logarithm; 1 and 0 for discs.
  double aspect = 1, aspect_sd = 0;
  /// True if the middle of a disc is brighter than the light at its rim.
  bool has_bright_core = false;
  /// Level of the brightest scanlines above the dark level, in gray levels.
  double peak_level = 0;
};

/// Minimum of Light::inlier_fraction for an identified lamp.
inline constexpr double kMinInlierFraction = 0.45;

/// Returns true if a light has an outline: that of its lamp, unless it is a reflection.
inline bool has_outline(const Light& light) { return light.outline_kind != LightOutline::none; }

/// Returns true if a light with an outline is evenly lit near it. Its stripes are measured within
/// the outline.
inline bool has_even_outline(const Light& light) {
  return light.outline_kind == LightOutline::edge || light.outline_kind == LightOutline::rectangle;
}

/// Returns true if a light is modulated and large enough: it may be a lamp of this map or of
/// another one.
inline bool is_light_modulated(const Light& light) {
  return light.kind != LightKind::unmodulated && light.kind != LightKind::no_outline;
}

}  // namespace vlp
