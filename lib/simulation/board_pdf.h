// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "rig/board.h"

namespace vlp {

/// Page size of a printer.
struct PageSize {
  std::string name;
  /// Width and height of the page in portrait orientation, m.
  Eigen::Vector2d size_m;
};

/// Returns A0 to A4 and Letter.
const std::vector<PageSize>& list_page_sizes();

/// Returns the page size of this name.
/// @throws std::invalid_argument with the valid names, if there is none
const PageSize& require_page_size(const std::string& name);

/// Computes the largest tag size (or square size) for which the board fits on a page, portrait or
/// landscape, in whole millimeters. Returns std::nullopt if it is below 5 mm. Ignores the
/// tag_size_m or square_size_m of `board`.
std::optional<double> find_tag_size_m(const Board& board, const PageSize& paper);

/// Renders the board as a PDF at true scale, centered on a page in portrait or landscape
/// orientation. The page shows the parameters of the board and a ruler of 100 mm for checking the
/// print. The same board yields the same bytes.
/// @throws std::invalid_argument if the board does not fit on the page, or if the family lacks an
/// id
std::string render_board_pdf(const Board& board, const PageSize& paper);

}  // namespace vlp
