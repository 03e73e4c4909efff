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

/// Returns the two ends of each run. Excludes ends at the image border and ends of runs that are
/// too short.
std::vector<EdgePoint> find_blob_outline(const ImageView& image, const Blob& blob,
                                         const Background& background);

}  // namespace vlp
