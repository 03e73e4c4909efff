// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/lattice_rows.h"

#include <limits>

namespace vlp {
namespace {

/// Returns the mean length of the second differences along rows of `row` points, in px; NaN if
/// there are none.
double compute_unevenness_px(std::span<const LatticePixels> images, std::size_t row) {
  double sum_px = 0, count = 0;
  for (const LatticePixels& points : images) {
    for (std::size_t i = 2; i < points.size(); ++i) {
      if (i % row < 2 || !points[i] || !points[i - 1] || !points[i - 2]) continue;
      sum_px += (*points[i] - 2 * *points[i - 1] + *points[i - 2]).norm();
      count += 1;
    }
  }
  return count > 0 ? sum_px / count : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

std::size_t estimate_row_length(std::span<const LatticePixels> images, std::size_t stated) {
  constexpr double max_ratio = 0.5;
  if (images.empty()) return stated;
  const std::size_t points = images.front().size();
  std::size_t best = stated;
  double min_px = std::numeric_limits<double>::infinity();
  // Longer rows are tried first, because a part of a row is as even as the row.
  for (std::size_t row = points / 3; row >= 3; --row) {
    if (points % row != 0) continue;
    const double px = compute_unevenness_px(images, row);
    if (!(px < max_ratio * min_px)) continue;
    min_px = px;
    best = row;
  }
  return min_px < max_ratio * compute_unevenness_px(images, stated) ? best : stated;
}

}  // namespace vlp
