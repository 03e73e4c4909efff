// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "detection/boards/detect_boards.h"

namespace vlp {

/// Of the tone curves level = 255 (light / 255)^(1 / gamma) behind which edges are fitted: from
/// none to the steepest of cameras for people.
inline constexpr std::array kGammas{1.0, 1.3, 1.6, 2.0, 2.4};

/// Puts corners where they are behind the curve that all images of a camera call for together
/// (SeenBoard::curve_costs): the least of a parabola through the least of the costs' sums and its
/// neighbours, by the logarithm of gamma, and corners between those of kGammas likewise. Of less
/// than 1.2 it is taken for none, as sharpening makes so much. JPEG and sharpening make curves look
/// flatter (tests/ACCURACY.md); what one leaves over is alike all over a view, as it is one for all
/// images, and taken out with the lens (edge_shifts()). An image that has none for sure keeps its
/// corners. Returns gamma, 1 of none; what it went by is gone from the views then.
double take_common_curve(std::vector<BoardView>& views);

}  // namespace vlp
