// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>

#include "detection/boards/board_detector.h"

namespace vlp {

/// Of the tone curves level = 255 (light / 255)^(1 / gamma) behind which edges are fitted: from
/// none to the steepest of cameras for people.
inline constexpr std::array kGammas{1.0, 1.3, 1.6, 2.0, 2.4};

/// Puts corners where they are behind the curve that all images of a camera call for together
/// (SeenBoard::curve_costs): the least of a parabola through the least of the costs' sums and its
/// neighbours, by the logarithm of gamma, and corners between those of kGammas likewise. An image
/// says it to 20 % from JPEG of quality 80, forty to 3 %. One curve for all, as what it leaves over
/// is alike all over a view then, and taken out with the lens (edge_shifts()). Returns gamma, 1 of
/// none.
double take_common_curve(std::span<SeenBoard*> images);

}  // namespace vlp
