// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "detection/boards/board_detector.h"

namespace vlp {

/// Gammas of the tone curves level = 255 (light / 255)^(1 / gamma) for which edges are fitted: from
/// no curve to the steepest curve of consumer cameras.
inline constexpr std::array kGammas{1.0, 1.3, 1.6, 2.0, 2.4};

/// One value per tone curve, in the order of kGammas: a cost (negative log-likelihood up to a
/// constant, smaller is more likely) or a ratio of residuals.
using ValuesPerGamma = std::array<double, kGammas.size()>;

/// Sums the costs of the tone curves (BoardDetection::curve_costs) over all images. The costs of an
/// image are relative to its smallest one and limited to 1000.
ValuesPerGamma sum_tone_curve_costs(const std::vector<BoardView>& views);

/// Estimates the gamma with the smallest cost, by a parabola over log(gamma) through the smallest
/// of `costs` and its neighbors.
double estimate_gamma(const ValuesPerGamma& costs);

/// Corrects the tags of all views for the tone curve with estimate_gamma(costs) and
/// returns this gamma. Returns 1 and changes no corner if gamma is below 1.2: sharpening has a
/// similar effect.
///
/// Interpolates corners and edge curvatures by a parabola through the fits for the same three of
/// kGammas, and standard deviations and steps linearly. An image that certainly has no tone curve
/// keeps its corners. Clears TagDetection::tone_curve_fits and BoardDetection::curve_costs in all
/// views.
double correct_views_for_tone_curve(std::vector<BoardView>& views, const ValuesPerGamma& costs);

}  // namespace vlp
