// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "lamps/image/background.h"
#include "lamps/image/image_view.h"
#include "lamps/image/runs.h"

namespace vlp {

/// The least coherence of what flickers: three quarters of what changes in a part of a light from
/// line to line change in all.
inline constexpr double kLeastCoherence = 0.85;

/// How alike the parts of a light show stripes of that period. A shutter exposes all pixels of a
/// line at one time, so that a lamp's stripes are at the same lines all over it, whatever its
/// shape; of bright things without stripes, letters and patterns, each part shows its own. Each
/// line is divided into five parts. With the means a_k and b_k of part k over the quarter of a
/// period before and after a line, and c, half of what noise reaches and 5 % of the brightest line,
///
///     d_k(line) = log((b_k + c) / (a_k + c)),
///
/// and the coherence of part k is the correlation of d_k with the sum of the others. That of the
/// light is the least but one, because something may hide a part. Parts that have nothing to do
/// with each other, and three independent lines, as a period and a half shows, reach
/// kLeastCoherence with a chance of (1 - 0.85) / 2 each, and four of five together with 1.5e-4.
/// Bars that lean reach it within 7 degrees when a light shows two of them.
///
/// `chords` are the light's pixels on each of its `lines`, see lines_of() and chords_of(). 0 when
/// it has too few lines to tell.
double coherence_of(const ImageView& lines, const std::vector<Run>& chords,
                    const Background& background, double period_lines);

}  // namespace vlp
