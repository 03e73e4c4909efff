// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "lamps/shape/outline.h"
#include "lamps/shape/shear.h"
#include "lamps/signal/stripes.h"

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
  overexposed,      ///< steady: contrast below kLeastContrast, most pixels at full scale
  steady,           ///< steady: contrast below kLeastContrast
  too_few_periods,  ///< less than kLeastPeriods, or less than kEnoughPeriods and no lamp with more
  no_clear_period,  ///< no period explains it, its parts differ, or its stripes are irregular
  unknown_period,   ///< its period is that of no lamp, or of several
  reflection,       ///< softer, dimmer or smaller than another light, or like its mirror image
  wrong_shape,      ///< its outline is not that of its lamp, or cannot be fitted
  incomplete        ///< cut by the image's edge, or too small for an outline
};

/// One that is formless has its box, `pixel` in the middle, and its edge; no stripes, no sigma.
struct Light {
  LightKind kind;
  LightReason reason;
  /// Of a lamp, and of one that is cut.
  std::optional<int> lamp;
  /// Image of the centre of its outline, (u, v).
  Eigen::Vector2d pixel;
  /// Standard deviation of `pixel` per axis, by its outline, or by unknown_lens_sd_px() as well.
  double sigma_px;
  /// Of a rectangle that of the disc of its area.
  double radius_px;
  /// Of one that is round, in the plane of LightShape: the outline is where
  /// |unit_from_plane (p - plane_center)| = 1.
  Eigen::Vector2d plane_center;
  Matrix2 unit_from_plane;
  /// The corners of the box around the outline, top left and bottom right.
  Eigen::Vector2d low, high;
  Stripes stripes;
  /// See coherence_of(); 0 when the stripes have no period.
  double coherence;
  /// Share of the pixels in the middle of a steady light that are as bright as the brightest there:
  /// of one that is clipped, most.
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
  /// Whether it is lit unevenly, and its outline is a rim, see rim_of(); its roundness is the share
  /// of the ends of its lit lines that show the rim.
  bool uneven;
  /// How soft the outline is: from a quarter to three quarters of the level.
  double rise_px;
  /// Of a rectangle, see rectangle_of(), a polygon around it within its edges, (u, v), and its long
  /// side over the short one, behind the lens, with the standard deviation of its logarithm, by the
  /// scatter of the edges and a quarter of their blur, which a tone curve may move them by; empty
  /// of others.
  std::vector<Eigen::Vector2d> face;
  double aspect, aspect_sd;
  /// The share of the blob's edge that lies on the circle; of a rectangle the share of the pixels
  /// along the edge that is seen worst that look like an edge.
  double roundness;
  /// Points of the blob's edge that lie outside this and its other lights, over those on the
  /// circle.
  double outside;
  /// As (column, row) of the lines that the shutter reads: (v, u) for a read-out along columns.
  std::vector<EdgePoint> outline;
  /// Of a circle in the level plane what it leaves of the outline; of no points else.
  OutlineSums sums;
};

/// Part of an outline that has to be seen for it to be trusted: Light::roundness.
inline constexpr double kMinRoundness = 0.45;

inline bool is_rectangle(const Light& light) { return !light.face.empty(); }

/// Whether it may be a lamp, of this map or another.
inline bool flickers(const Light& light) {
  return light.kind != LightKind::steady && light.kind != LightKind::formless;
}

}  // namespace vlp
