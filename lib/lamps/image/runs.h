// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "lamps/image/image_view.h"
#include "lamps/image/pixel_box.h"

namespace vlp {

/// Lit pixels of a row that stand side by side: columns from begin to before end.
struct Run {
  int row, begin, end;

  int width() const { return end - begin; }
};

/// Of tiles: so many rows and columns. Those at the right and at the bottom may have less.
inline constexpr int kTile_px = 64;

/// A value for each tile of an image.
struct TileMask {
  int columns = 0, rows = 0;
  std::vector<std::uint8_t> values;  ///< row by row

  TileMask() = default;
  TileMask(int columns_, int rows_)
      : columns(columns_), rows(rows_), values(std::size_t(columns_) * std::size_t(rows_)) {}
  bool empty() const { return values.empty(); }
  std::uint8_t* row(int y) { return values.data() + std::ptrdiff_t(y) * columns; }
  const std::uint8_t* row(int y) const { return values.data() + std::ptrdiff_t(y) * columns; }
};

/// Counts the pixels of each tile above `threshold`: 0, 1, or 2 if there are more.
TileMask lit_tiles(const ImageView& image, double threshold);

/// The runs of pixels above `threshold`, row by row. Gaps of up to two pixels do not end a run;
/// runs of less than three pixels are noise. Only tiles that are `lit`, not 0, are searched, or all
/// of them if it is empty.
std::vector<Run> find_runs(const ImageView& image, double threshold, const TileMask& lit = {});

/// Runs that belong to one light: they overlap from row to row, across up to `most_dark_rows` dark
/// ones. Lights that touch are one blob.
struct Blob {
  std::vector<Run> runs;  // by row

  int top() const { return runs.front().row; }
  int bottom() const { return runs.back().row; }
  PixelBox box() const;
};

std::vector<Blob> group_runs(const std::vector<Run>& runs, int most_dark_rows);

}  // namespace vlp
