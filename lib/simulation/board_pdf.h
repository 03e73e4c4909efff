// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "rig/board.h"

namespace vlp {

struct Paper {
  std::string name;
  /// Upright: width, height.
  Eigen::Vector2d size_m;
};

/// A0 to A4 and Letter.
const std::vector<Paper>& papers();

/// The one of this name; throws std::invalid_argument, with the names, when there is none.
const Paper& paper_named(const std::string& name);

/// How large a tag, or square, a sheet has room for, upright or lying, in whole millimetres;
/// nothing when less than 5 mm. board: its tag_size_m, or square_size_m, is not looked at.
std::optional<double> largest_size_m(const Board& board, const Paper& paper);

/// The board as a PDF at true scale in the middle of a sheet, upright or lying, with its parameters
/// and a ruler of 100 mm to check the print with. The same board gives the same bytes. Throws
/// std::invalid_argument when it does not fit on the sheet, or when the family lacks an id.
std::string board_pdf(const Board& board, const Paper& paper);

}  // namespace vlp
