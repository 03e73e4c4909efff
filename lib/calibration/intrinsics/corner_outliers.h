// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "calibration/intrinsics/board_lattice.h"

namespace vlp {

/// Finds outliers among the corners of one view: corners farther from their predicted pixel than
/// max(3 px, 25 % of the predicted distance to the nearest neighbor).
///
/// @return indices in `corners`, ascending; empty if more than 10 % of the corners would be
///     outliers, and thus for fewer than ten corners
///
/// More outliers indicate another board or another order of the corners.
///
/// Noise is smaller than this limit. Outliers are misidentified points or errors in a file; least
/// squares would distort the view or the lens to fit them.
///
/// Each corner is predicted by the homography of its nearest eight corners on the board, which
/// approximates any lens. The worst corner is removed and its neighbors are tested again.
std::vector<std::size_t> list_corner_outliers(const std::vector<BoardLattice::Corner>& corners);

/// Estimates the noise of corners of weight 1, px per axis, without a lens: from the residuals of
/// a homography with cubic terms for each 16 neighboring corners (estimate_variance_2d()).
/// Errors that neighbors share are not included. Returns std::nullopt if no view has 16 corners.
std::optional<double> estimate_corner_noise_px(
    std::span<const std::vector<BoardLattice::Corner>> views);

}  // namespace vlp
