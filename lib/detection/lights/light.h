// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "detection/identity/stripes.h"
#include "detection/lights/outline.h"

namespace vlp {

/// What became of a light in an image.
enum class LightKind {
  lamp,     ///< wholly in the image and identified: fit for a fix
  cut,      ///< identified, but the image's edge cuts it
  unknown,  ///< flickers, but like no lamp of the map, like two, or like one seen better elsewhere
  steady,   ///< does not flicker
};

struct Light {
  LightKind kind;
  /// Of a lamp, and of one that is cut.
  std::optional<int> lamp;
  /// Image of the centre of its outline, (u, v).
  Eigen::Vector2d pixel;
  /// Standard deviation of `pixel` per axis, from the scatter of the outline.
  double sigma_px;
  double radius_px;
  /// The corners of the box around the outline, top left and bottom right.
  Eigen::Vector2d low, high;
  Stripes stripes;
  /// Whether it has no edge, and its outline is a level.
  bool glows;
  /// Whether it is lit unevenly, and its outline is a rim, see rim_of(); its roundness is the share
  /// of the ends of its lit lines that show the rim.
  bool uneven;
  /// How soft the outline is: from a quarter to three quarters of the level.
  double rise_px;
  /// The share of the blob's edge that lies on the circle.
  double roundness;
  /// Points of the blob's edge that lie outside this and its other lights, over those on the
  /// circle.
  double outside;
  /// As (column, row) of the lines that the shutter reads: (v, u) for a read-out along columns.
  std::vector<EdgePoint> outline;
};

}  // namespace vlp
