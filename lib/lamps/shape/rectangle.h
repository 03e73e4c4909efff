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

/// Change of the log aspect ratio of a rectangle that an unknown tilt of 5 degrees causes, 35
/// degrees off axis. Its angles change by about as much, in rad.
inline constexpr double kUnknownTiltSd = 0.06;

/// Fits a rectangular light, a panel or a tube, by its four edges.
///
/// @param lines    image whose rows are the scanlines
/// @param blob     lit pixels of the light
/// @param outline  result of find_blob_outline() for the blob, (column, row)
/// @param sizes_m  lengths of both axes of the map's rectangles, used only for hidden edges
/// @return  the light; its sigma is propagated from the eight ends of the sides, and `box` includes
///     two standard deviations of the sides
///
/// Starts from the minimum-area rectangle around the outline, aligned by line fits to its sides.
/// Then fits each side to its edge, see fit_straight_edge(). The center is the intersection of the
/// diagonals, because perspective preserves it from any viewing angle.
///
/// Edges are straight in the plane of LightShape. Without a lens they are fitted in the image.
/// Their curvature then estimates the offset of the center from the intersection of the diagonals.
/// The offset is subtracted, and its uncertainty is included in sigma_px.
///
/// With a lens, one edge or two opposite ones may be hidden by a dark stripe along them, see
/// estimate_position_of_edge_in_dark_stripe(). The direction of a hidden edge follows from the
/// other edges. The position of a single hidden edge also follows from the aspect ratio if one of
/// `sizes_m` agrees with the stripes. Right angles correct all edges, within the uncertainty of the
/// tilt.
///
/// Returns std::nullopt in these cases:
///   - Four edges do not form a rectangle to 20 degrees, since an unknown tilt deforms it.
///   - The rectangle is less than 6 px wide, has less than about 18 scanlines, or has an aspect
///     ratio above 40.
///   - An edge that is not hidden is outside the image or not found.
///   - Edges are hidden and a circle explains more of the outline.
std::optional<MeasuredLight> fit_rectangular_light(const ImageView& lines, const Blob& blob,
                                                   const std::vector<Eigen::Vector2d>& outline,
                                                   const Background& background,
                                                   const LightShape& shape,
                                                   const std::vector<Eigen::Vector2d>& sizes_m);

/// Returns the pixels inside a convex polygon, (column, row), on each line of an image of `size`.
std::vector<PixelRun> find_chords_in_polygon(const std::vector<Eigen::Vector2d>& polygon,
                                             const ImageSize& size);

}  // namespace vlp
