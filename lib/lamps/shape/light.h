// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "lamps/signal/stripes.h"
#include "lamps/shape/outline.h"
#include "lamps/shape/shear.h"

namespace vlp {

/// What became of a light in an image.
enum class LightKind {
  lamp,     ///< wholly in the image and identified: fit for a fix
  cut,      ///< identified, but the image's edge cuts it
  unknown,  ///< flickers, but is not told to be one lamp of the map, see LightReason
  steady,   ///< does not flicker
  formless  ///< bright, but without a round outline, so that it has no centre
};

/// What decided that, of lights that are not identified the first that speaks against it.
enum class LightReason {
  identified,    ///< a lamp, and one that is cut
  clipped,       ///< steady: contrast below kLeastContrast, and most of it as bright as can be
  even,          ///< steady: contrast below kLeastContrast
  few_stripes,   ///< steady: less than kLeastPeriods
  unclear,       ///< steady: no period explains half of what varies from line to line
  incoherent,    ///< steady: its parts vary each in its way, see coherence_of()
  irregular,     ///< unknown: the stripes are not readable()
  like_no_lamp,  ///< unknown: the period is like no lamp's, or like two lamps'
  other_shape,   ///< unknown: that lamp has another shape in the map: disc, rectangle, its sides
  soft,          ///< unknown: much softer than others, a reflection
  not_round,     ///< unknown: most of its edge is not on its outline
  seen_better,   ///< unknown: another light is that lamp, and has the surer centre
  alone,         ///< unknown: less than kEnoughPeriods, and no lamp with more in the image
  at_edge,       ///< formless: the image's edge cuts it
  small,         ///< formless: its outline has less than twice kLeastOutlinePoints
  no_outline     ///< formless: neither a circle nor an ellipse fits its outline
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
  /// Whether it has no edge, and its outline is a level.
  bool glows;
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

inline bool is_rectangle(const Light& light) { return !light.face.empty(); }

/// Whether it may be a lamp, of this map or another.
inline bool flickers(const Light& light) {
  return light.kind != LightKind::steady && light.kind != LightKind::formless;
}

}  // namespace vlp
