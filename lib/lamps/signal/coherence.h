// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "lamps/image/background.h"
#include "lamps/image/image_view.h"
#include "lamps/image/runs.h"

namespace vlp {

/// Minimum coherence of a modulated light: three quarters of the variance in a part of it are
/// common to all parts.
inline constexpr double kMinCoherence = 0.85;

/// Computes how similar the stripes of that period are in the parts of a light. A shutter exposes
/// all pixels of a line at one time, so that a lamp's stripes are on the same lines in all parts of
/// it, whatever its shape. In letters and patterns the parts differ. Each line is divided into five
/// parts. With the means a_k and b_k of part k over the quarter of a
/// period before and after a line, and c, half of what noise reaches and 5 % of the brightest line,
///
///     d_k(line) = log((b_k + c) / (a_k + c)),
///
/// and the coherence of part k is the correlation of d_k with the sum of the others. That of the
/// light is the second smallest, because an object may hide a part. Independent parts with three
/// independent lines, as a period and a half shows, reach
/// kMinCoherence with a chance of (1 - 0.85) / 2 each, and four of five together with 1.5e-4.
/// Bars that lean reach it within 7 degrees when a light shows two of them.
///
/// `chords` are the light's pixels on each of its `lines`, see lines_of() and chords_of(). Returns
/// 0 if it has too few lines.
double coherence_of(const ImageView& lines, const std::vector<Run>& chords,
                    const Background& background, double period_lines);

}  // namespace vlp
