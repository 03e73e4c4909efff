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

/// A light that is a rectangle, a panel or a tube, by its four edges, straight in rays behind the
/// lens; without a lens in the image, where what they bow tells how far from the centre the
/// diagonals cross; that is taken off, and how surely it is known is in sigma_px. `outline` is that
/// of outline_of().
///
/// From the rectangle of the least area around the outline, turned to what lines say of its sides,
/// each side goes to its edge, see straight_edge_at(). The centre is where the diagonals cross: of
/// the image of a rectangle, whatever the angle from which it is seen, that is the image of its
/// centre. The sigma is that of the eight ends of the sides. Nothing when four edges do not make a
/// rectangle, to 20 degrees (a lean that nobody knows of bends it), when it is less than 10 px
/// wide, has less than some 18 lines, is more than 40 times as long as wide, or when an edge is not
/// seen: wholly in the image, and lit where a side lies along the lines and a dark stripe may hide
/// it.
std::optional<Light> rectangle_of(const ImageView& lines, const Blob& blob,
                                  const std::vector<EdgePoint>& outline,
                                  const Background& background, const LightShape& shape);

/// The pixels inside a convex polygon, (column, row), on each line of an image of that size.
std::vector<Run> chords_within(const std::vector<Eigen::Vector2d>& polygon, const ImageSize& size);

/// Whether a point is in a convex polygon.
bool contains(const std::vector<Eigen::Vector2d>& polygon, const Eigen::Vector2d& point);

}  // namespace vlp
