// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "lamps/image/background.h"
#include "lamps/image/image_view.h"
#include "lamps/image/pixel_runs.h"
#include "lamps/shape/light.h"
#include "lamps/shape/light_center.h"
#include "lamps/shape/outline_fit.h"

namespace vlp {

/// Fits the outline of a disc: its edge, or the rim of a source deep in a reflector. The core of
/// such a source is at least ten times as bright as its rim and moves with the point of view. A
/// part of the rim is dark, and the ceiling around it is lit. An outline appears as a step, not as
/// a level. The step at a border between two pixels of a scanline is
///
///     e = log((i + c) / (o + c)) - max(0, log((b + c) / (i + c))),   clamped to -0.7 to 1,
///
/// or to -0.7 to 0.5 if the radius is known, with the mean levels of a few pixels outside the
/// border, o, inside it, i, and behind the latter, b. The constant c is half of the noise
/// threshold, and at least 2 % of the brightest level.
///
/// 1. Searches the circle in the level plane whose crossings with the scanlines in the brighter
/// half of the period have the largest sum of e. Its mean has to be at least 0.28, or 0.1 if
/// the radius is known. (Daugman 1993 sums steps of irises.) Circles in the image would follow a
/// part of a rim that is viewed obliquely. Without a lens also the ellipse with the second moments
/// of the blob is searched. It is used if its sum is 1.2 times as large.
///
/// 2. Fits the outline to the pixels near this circle, see fit_disc_outline().
///
/// @param period_lines  period of the stripes in scanlines
/// @param radius        known radius in the plane of LightShape: excludes the edge of a source in a
///                      reflector, which is a clearer circle than the rim
/// @return light with its outline; std::nullopt if the blob is smaller than 8 px or has less than 5
///     lit scanlines; if no circle has such steps; if the outline has no fit, see
///     fit_disc_outline(); if the standard deviation of the center is above 0.6 % of the radius (1
///     % of a known radius); or if the radius is another one than the known one
std::optional<MeasuredLight> fit_rim_of_light(const ImageView& image, const Blob& blob,
                                              double period_lines, const Background& background,
                                              const LightShape& shape,
                                              const std::optional<KnownRadius>& radius = {});

}  // namespace vlp
