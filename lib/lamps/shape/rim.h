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

namespace vlp {

/// Returns true if a blob is three times as bright inside as next to its outline, in at least one
/// line of ten. Also returns true if less than 20 % of the ends of its runs have an outline
/// point. Returns false if `outline` is empty.
bool is_blob_unevenly_lit(const ImageView& image, const Blob& blob,
                          const std::vector<EdgePoint>& outline, const Background& background);

/// Result of fit_rim_of_light(): a light whose outline is its rim. `is_clear` is true if at
/// least one of two conditions holds: more than 60 % of the pieces of the rim show a step, or the
/// outline still has a center whichever of its eight pieces is omitted.
struct Rim {
  Light light;
  bool is_clear;
};

/// Smallest and largest radius of a rim in the image, px.
struct RadiusRange {
  double min_px, max_px;
};

/// Fits the rim of an unevenly lit light, such as a source deep in a reflector. Its core is at
/// least ten times as bright as its rim and moves with the point of view. A part of the rim is
/// dark, and the ceiling around it is lit. A rim appears as a step, not as a level. The step at a
/// border between two pixels of a scanline is
///
///     e = log((i + c) / (o + c)) - max(0, log((b + c) / (i + c))),   clamped to -0.7 to 1,
///
/// with the mean levels of a few pixels outside the border, o, inside it, i, and behind the latter,
/// b. The constant c is half of the noise threshold, and at least 2 % of the brightest level.
///
/// 1. Searches the circle in the level plane whose crossings with the lit scanlines have the
/// largest sum of e. Its mean has to be at least 0.28. (Daugman 1993 sums steps of irises.) Circles
/// in the image would follow a part of a rim that is viewed obliquely.
///
/// 2. Fits a circle, or an ellipse without a lens, to the clearest steps near it.
///
/// 3. Fits steps to the pixels next to it, see fit_brightness_steps_at_rim(). If 60 % of the pieces
/// show a step,
///   the steps define the rim and the sigma of its center. Sigma includes the shift that another
///   tone curve causes. Otherwise sigma is the larger one of the scatter of the points and the
///   jackknife over eight pieces of the outline.
///
/// @param radius  range of the radius if it is known: excludes the edge of a source in a reflector,
///        which is a clearer circle than the rim. A rim out of range is not clear.
/// @return std::nullopt if the blob is smaller than 20 px or has less than 10 lit scanlines; if no
///     circle has such steps; or if the steps determine no circle
std::optional<Rim> fit_rim_of_light(const ImageView& image, const Blob& blob,
                                    const Background& background, const LightShape& shape,
                                    const std::optional<RadiusRange>& radius = {});

}  // namespace vlp
