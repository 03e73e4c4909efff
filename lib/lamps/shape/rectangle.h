// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "lamps/image/background.h"
#include "lamps/image/image_view.h"
#include "lamps/image/pixel_box.h"
#include "lamps/image/runs.h"
#include "lamps/shape/light.h"
#include "lamps/shape/light_shape.h"

namespace vlp {

/// Change of the logarithm of a rectangle's ratio of sides by an unknown lean of 5 degrees, 35
/// degrees from the axis. Its angles change by about as much, in rad.
inline constexpr double kLeanedOff = 0.06;

/// A light that is a rectangle, a panel or a tube, by its four edges, straight in rays behind the
/// lens; without a lens in the image, where what they bow tells how far from the centre the
/// diagonals cross; that is taken off, and how surely it is known is in sigma_px. `outline` is that
/// of outline_of().
///
/// From the rectangle of the least area around the outline, turned to what lines say of its sides,
/// each side goes to its edge, see straight_edge_at(). The centre is where the diagonals cross: of
/// the image of a rectangle, whatever the angle from which it is seen, that is the image of its
/// centre. The sigma is that of the eight ends of the sides.
///
/// Behind a lens one edge, or two opposite ones, may be hidden by a dark stripe that they lie
/// along, see hidden_edge_at(). The direction of a hidden edge follows from the others. The place
/// of a single one follows from the ratio of the sides, too, if one of `sizes_m`, the sizes of the
/// map's rectangles, agrees with the stripes. Right angles correct all edges, within what is known
/// of the tilt. `low` and `high` include two standard deviations of the sides.
///
/// Returns std::nullopt if four edges do not make a rectangle, to 20 degrees (an unknown lean bends
/// it); if it is less than 10 px wide, has less than some 18 lines, or is more than 40 times as
/// long as wide; if an edge that is not hidden is not in the image or not found; and if edges are
/// hidden and a circle explains more of the outline.
std::optional<Light> rectangle_of(const ImageView& lines, const Blob& blob,
                                  const std::vector<EdgePoint>& outline,
                                  const Background& background, const LightShape& shape,
                                  const std::vector<Eigen::Vector2d>& sizes_m);

/// The pixels inside a convex polygon, (column, row), on each line of an image of that size.
std::vector<Run> chords_within(const std::vector<Eigen::Vector2d>& polygon, const ImageSize& size);

}  // namespace vlp
