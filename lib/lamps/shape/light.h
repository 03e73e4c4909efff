// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "lamps/shape/outline.h"
#include "lamps/shape/shear.h"
#include "lamps/signal/stripes.h"
#include "rig/lamp_shape.h"

namespace vlp {

/// Kind of a light in an image.
enum class LightKind {
  lamp,     ///< wholly in the image and identified: fit for a fix
  cut,      ///< identified, but cut by the image's edge
  unknown,  ///< modulated, but not identified as one lamp of the map, see LightReason
  steady,   ///< not modulated
  formless  ///< bright, but neither modulated nor of a known outline
};

/// Reason why a light is no lamp; of several the first that applies.
enum class LightReason {
  identified,       ///< a lamp, or one that is cut
  overexposed,      ///< steady: contrast below kMinContrast, most pixels at full scale
  steady,           ///< steady: contrast below kMinContrast
  too_few_periods,  ///< less than kMinPeriods, or less than kEnoughPeriods and no lamp with more
  no_clear_period,  ///< no period explains it, its parts differ, or its stripes are irregular
  unknown_period,   ///< its period is that of no lamp, or of several
  reflection,       ///< softer, dimmer or smaller than another light, or like its mirror image
  wrong_shape,      ///< its outline is not that of its lamp, or cannot be fitted
  incomplete        ///< cut by the image's edge, or too small for an outline
};

/// A light in an image. A formless one has its box, with `pixel` in the middle, and its outline; no
/// stripes and no sigma.
struct Light {
  LightKind kind;
  LightReason reason;
  /// Id of a lamp, and of one that is cut.
  std::optional<int> lamp;
  /// Image of the centre of its outline, (u, v).
  Eigen::Vector2d pixel;
  /// Standard deviation of `pixel` per axis. Without a lens unknown_lens_sd_px() is included.
  double sigma_px;
  /// Shape of its outline; a disc if it has none.
  ShapeKind shape;
  /// Radius; for other shapes than discs that of the disc of equal area.
  double radius_px;
  /// Outline of a round light in the plane of LightShape: |unit_from_plane (p - plane_center)| = 1.
  Eigen::Vector2d plane_center;
  Matrix2 unit_from_plane;
  /// Top left and bottom right corner of the box around the outline, (u, v).
  Eigen::Vector2d low, high;
  Stripes stripes;
  /// coherence_of(), or ModulatedLight::phase_coherence if `by_modulation`; 0 if the stripes have
  /// no period.
  double coherence;
  /// Fraction of the pixels in the middle of a steady light that have the level of its brightest
  /// pixel, if that is full scale.
  double clipped;
  /// Level of its brightest lines above the dark, in grey levels.
  double peak;
  /// Whether it was found by its modulation, which decided its stripes.
  bool by_modulation;
  /// Whether it has no outline: its centre is that of the area that it lights.
  bool glows;
  /// Whether its outline may be another one than the lamp's: soft, seen in part, or of a source in
  /// a reflector, much brighter inside than next to it.
  bool is_doubtful;
  /// Whether it is lit unevenly and its outline is a rim, see rim_of(). Its roundness is the
  /// fraction of the ends of its lit lines that show the rim.
  bool uneven;
  /// Width of the edge from 25 % to 75 % of the level.
  double rise_px;
  /// Polygon within the edges, (u, v); empty for discs.
  std::vector<Eigen::Vector2d> face;
  /// Long axis over short axis behind the lens, and the standard deviation of its logarithm; for
  /// discs 1 and 0.
  double aspect = 1, aspect_sd = 0;
  /// Fraction of the blob's edge that lies on the circle. Rectangles: fraction of the pixels along
  /// the worst edge that agree with an edge.
  double roundness;
  /// Number of points of the blob's edge outside all lights of the blob, over the number on the
  /// circle.
  double outside;
  /// Points as (column, line): (v, u) for a read-out along columns.
  std::vector<EdgePoint> outline;
  /// Residuals of a circle in the level plane; empty for other outlines.
  OutlineSums sums;
};

/// Minimum Light::roundness of an identified lamp.
inline constexpr double kMinRoundness = 0.45;

inline bool is_disc(const Light& light) { return light.shape == ShapeKind::disc; }

/// Returns whether a light may be a lamp, of this map or another.
inline bool flickers(const Light& light) {
  return light.kind != LightKind::steady && light.kind != LightKind::formless;
}

}  // namespace vlp
