// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <cmath>
#include <optional>
#include <vector>

#include "lamps/shape/outline.h"
#include "lamps/shape/shear.h"
#include "lamps/signal/stripes.h"
#include "rig/lamp_shape.h"

namespace vlp {

/// Class of a light in an image.
enum class LightKind {
  lamp,         ///< identified and fully inside the image: usable for a position fix
  truncated,    ///< identified, but cut by the image border
  unknown,      ///< modulated, but not identified as one lamp of the map, see LightReason
  unmodulated,  ///< not modulated
  no_outline    ///< bright, but neither modulated nor with a known outline
};

/// Reason for the class of a light: the check that rejected it as a lamp, or `identified`. The
/// checks run in another order than that of the enumerators
/// (LightDetector::identify_lamps_of_lights()).
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

/// Ellipse |unit_from_plane (p - center)| = 1 in the plane of LightShape. With a lens it is a
/// circle.
struct PlaneEllipse {
  Eigen::Vector2d center;
  Matrix2 unit_from_plane;

  /// Returns the radius of the circle of equal area.
  double radius() const { return 1 / std::sqrt(std::abs(unit_from_plane.determinant())); }
};

/// Light in an image. A light of kind no_outline has only a box, with `pixel` at its center, and
/// the `outline` of its pixels; it has no stripes and no sigma.
struct Light {
  LightKind kind;
  LightReason reason;
  /// Id of the lamp; also set for a lamp that the image border cuts.
  std::optional<int> lamp;
  /// Pixel (u, v) of the lamp's center, estimated from the outline.
  Eigen::Vector2d pixel;
  /// Standard deviation of `pixel` per axis, by the noise model in light_center_noise.h. Includes
  /// predict_center_sd_without_lens_px() if the lens is unknown.
  double sigma_px;
  /// Shape of the outline; a disc if the light has no outline.
  ShapeKind shape;
  /// Radius in the image; for other shapes than discs the radius of the disc of equal area.
  double radius_px;
  /// Outline of a round light in the plane of LightShape.
  PlaneEllipse plane_outline;
  /// Top left and bottom right corner of the bounding box of the outline, (u, v).
  Eigen::Vector2d box_min, box_max;
  Stripes stripes;
  /// Result of compute_stripe_coherence_between_parts(), or ModulatedLight::phase_coherence if
  /// `is_found_by_modulation`. 0 if the stripes have no period.
  double coherence;
  /// Steady lights only: fraction of the pixels in the middle that have the level of the light's
  /// brightest pixel. 0 if this level is not full scale.
  double clipped_fraction;
  /// Level of the brightest scanlines above the dark level, in gray levels.
  double peak_level;
  /// True if the light was found by its modulation, which then also determined its stripes.
  bool is_found_by_modulation;
  /// True if the light has no outline; its center is then the centroid of the lit area.
  bool is_glow;
  /// True if the outline may differ from the outline of the lamp: blurred, partly visible, or that
  /// of a source in a reflector, much brighter inside than next to its outline.
  bool is_doubtful;
  /// True if the outline is a rim, see fit_rim_of_light(). Its inlier_fraction is then that of
  /// OutlineFit.
  bool is_uneven;
  /// Width of the edge from 25 % to 75 % of the level, in pixels.
  double rise_px;
  /// Polygon inside the edges of the light, as pixels (u, v); empty for discs.
  std::vector<Eigen::Vector2d> inner_polygon;
  /// Ratio of the long to the short axis in the plane of LightShape, and the standard deviation of
  /// its logarithm; 1 and 0 for discs.
  double aspect = 1, aspect_sd = 0;
  /// Discs: fraction of the blob's edge points that lie on the first outline. Rectangles: fraction
  /// of the pixels along the worst edge that agree with the edge model.
  double inlier_fraction;
  /// Ratio of the number of the blob's edge points outside all lights of the blob to the number of
  /// edge points on the outline.
  double outside_ratio;
  /// Points of the first outline, or of the rim, (column, line): (v, u) for readout along columns.
  std::vector<EdgePoint> outline;
  /// Normal equations of the circle in the level plane, for discs with a known lens that were
  /// fitted by fit_disc_outline().
  std::optional<OutlineEquations> outline_equations;
};

/// Minimum of Light::inlier_fraction for an identified lamp.
inline constexpr double kMinInlierFraction = 0.45;

inline bool is_light_disc_shaped(const Light& light) { return light.shape == ShapeKind::disc; }

/// Returns true if a light is modulated: it may be a lamp of this map or of another one.
inline bool is_light_modulated(const Light& light) {
  return light.kind != LightKind::unmodulated && light.kind != LightKind::no_outline;
}

}  // namespace vlp
