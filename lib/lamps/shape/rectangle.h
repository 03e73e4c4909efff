// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "lamps/image/background.h"
#include "lamps/image/image_view.h"
#include "lamps/image/pixel_box.h"
#include "lamps/image/pixel_runs.h"
#include "lamps/shape/light.h"
#include "lamps/shape/light_center.h"
#include "lamps/shape/outline.h"

namespace vlp {

/// Fits a rectangular light, a panel or a tube, by its outline: see fit_rectangle_outline().
///
/// @param lines         image whose rows are the scanlines
/// @param blob          lit pixels of the light
/// @param outline       result of trace_blob_outline() for the blob, (column, row)
/// @param period_lines  period of the stripes in scanlines, if those inside the first rectangle are
///     not clear
/// @param sizes_m       lengths of both axes of the map's rectangles, used only for hidden sides
/// @return  the light; `box` includes two standard deviations of the sides
///
/// Starts from the minimum-area rectangle around the outline, aligned by line fits to its sides.
///
/// Returns std::nullopt in these cases:
///   - The first sides do not form a rectangle to 20 degrees, since an unknown tilt deforms it.
///   - The rectangle is less than 6 px wide or has an aspect ratio above 40.
///   - The outline is not determined, or without a lens a side is hidden.
///   - The outline of the blob contradicts the rectangle: a quarter of its points is more than 3 px
///     outside, or it does not extend into the corners.
std::optional<MeasuredLight> fit_rectangular_light(const ImageView& lines, const Blob& blob,
                                                   const std::vector<Eigen::Vector2d>& outline,
                                                   double period_lines,
                                                   const Background& background,
                                                   const LightShape& shape,
                                                   const std::vector<Eigen::Vector2d>& sizes_m);

/// Returns one run of pixels for each image row that a convex polygon crosses: the pixels inside
/// Corners are (column, row). Runs of fewer than two pixels are omitted.
std::vector<PixelRun> list_chords_in_polygon(const std::vector<Eigen::Vector2d>& polygon,
                                             const ImageSize& size);

}  // namespace vlp
