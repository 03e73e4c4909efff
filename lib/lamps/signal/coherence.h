// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "lamps/image/background.h"
#include "lamps/image/image_view.h"
#include "lamps/image/pixel_runs.h"

namespace vlp {

/// Minimum coherence of a modulated light: three quarters of the variance in a part of it are
/// common to all parts.
inline constexpr double kMinCoherence = 0.85;

/// Computes the similarity of the stripes in the parts of a light. A shutter exposes all pixels of
/// a scanline at the same time. A lamp's stripes are therefore on the same scanlines in all its
/// parts, whatever its shape. In letters and patterns the parts differ.
///
/// @param lines       image whose rows are the scanlines, see make_scanline_image()
/// @param chords      pixels of the light on each scanline, see find_chords_in_ellipse()
/// @param background  dark level and noise of the image
/// @param period_lines  period of the stripes
/// @return  coherence, at most 1; 0 if the light has too few scanlines
///
/// Each scanline is divided into five parts. a_k and b_k are the means of part k over a quarter of
/// a period before and after a scanline. The constant c is half of the noise threshold plus 5 % of
/// the brightest scanline. With
///
///     d_k(line) = log((b_k + c) / (a_k + c)),
///
/// the coherence of part k is the correlation of d_k with the sum of the other parts. The coherence
/// of the light is the second smallest of these, because an object may hide a part.
///
/// Independent parts with three independent scanlines, as in one and a half periods, each reach
/// kMinCoherence with a probability of (1 - 0.85) / 2, and four of five together with 1.5e-4.
/// Tilted bars reach it within 7 degrees if a light shows two of them.
double compute_coherence(const ImageView& lines, const std::vector<PixelRun>& chords,
                         const Background& background, double period_lines);

}  // namespace vlp
