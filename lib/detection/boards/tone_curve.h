// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "detection/boards/board_view.h"

namespace vlp {

/// Of the tone curves level = 255 (light / 255)^(1 / gamma) behind which edges are fitted: from
/// none to the steepest of cameras for people.
inline constexpr std::array kGammas{1.0, 1.3, 1.6, 2.0, 2.4};

/// A figure for each of kGammas.
using PerCurve = std::array<double, kGammas.size()>;

/// What the levels beside the edges of tags say against each curve (SeenBoard::curve_costs), of all
/// images together: each counts 1000 at most, whatever is in it.
PerCurve costs_of_levels(const std::vector<BoardView>& views);

/// Gamma where costs are least, by a parabola through the least and its neighbours, over the
/// logarithm of gamma.
double gamma_of(const PerCurve& costs);

/// Puts corners where they are behind the curve of gamma_of(), which is returned: by a parabola
/// through those of the same three of kGammas. Of less than 1.2 it is taken for none, 1, as
/// sharpening makes so much. An image that has none for sure keeps its corners. What curves make of
/// corners is gone from the views then.
double take_curve(std::vector<BoardView>& views, const PerCurve& costs);

}  // namespace vlp
