// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "lamps/image/image_view.h"
#include "lamps/image/pixel_box.h"

namespace vlp {

/// Rows and columns of a tile, in pixels. Tiles at the right and at the bottom may have less.
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

/// Finds the tiles with pixels above `threshold`: more than one in the tile and those around it,
/// because one alone is noise, and no run.
///
/// Searches every second row, the odd ones and the even ones in turns of 16 rows, and then every
/// row of the tiles with light and of those around them. So a light is found if two rows in
/// succession are lit. One whose stripes are a single row each, at an even period, is found surely
/// if it is 16 rows and a period high. A lamp needs at least 8 lit lines to be identified.
TileMask lit_tiles(const ImageView& image, double threshold);

/// Adds the tiles around those that are not 0, corners included.
TileMask dilated(const TileMask& mask);

TileMask transposed(const TileMask& mask);

/// Returns the boxes, in tiles, around the groups of tiles that touch, corners included.
std::vector<PixelBox> group_boxes(TileMask mask);

/// Returns the pixels of a box of tiles in an image of that size.
PixelBox pixels_of_tiles(const PixelBox& tiles, const ImageSize& size);

}  // namespace vlp
