// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "detection/boards/board_detector.h"
#include "rig/board.h"

namespace vlp {

/// Estimates one tone curve for all images of a camera and corrects the corners in `views` for it.
/// The curve is level = 255 (light / 255)^(1 / gamma).
/// @return gamma, at least 1; 1 if there is no tone curve, and the corners are unchanged
/// @throws std::invalid_argument as BoardLattice
///
/// Minimizes over kGammas
///   cost(gamma) = n log ratio(gamma) + (log(gamma / gamma_levels) / 0.2)^2 / 2
/// with
///   ratio         RMS residual of the lens fit for corners corrected with gamma, divided by the
///                 median standard deviation of the corners from pixel noise; OPENCV8 or
///                 OPENCV_FISHEYE, whichever fits better without a curve
///   n             50 / min(ratio), an effective number of residuals
///   gamma_levels  estimate from the gray values next to the edges (sum_tone_curve_costs())
///
/// Uses gamma_levels alone if no lens is found or if check_board_layout() reports another board. It
/// does the same if at least half of the views with usable gray values show no curve. Uses at most
/// 24 views.
///
/// Reason for both terms: gray values are precise but biased by JPEG and sharpening (20 % RMS of
/// gamma). A wrong curve displaces edges by fractions of their blur, which differ from tag to tag
/// with its width. No lens and no smooth edge shift of a view (fit_displacements())
/// absorbs such displacements.
///
/// Reason for n: thousands of residuals do not determine gamma as precisely as exact ratios would.
/// With n, a ratio of 2 % weighs as much as the gray values, and less if the noise explains few of
/// the residuals.
double correct_tone_curve(std::vector<BoardView>& views, const Board& board);

}  // namespace vlp
