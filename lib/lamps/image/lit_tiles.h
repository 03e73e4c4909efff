// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "lamps/image/image_view.h"
#include "lamps/image/pixel_box.h"

namespace vlp {

/// Width and height of a tile, in pixels. Tiles at the right and bottom border may be smaller.
inline constexpr int kTile_px = 64;

/// Mask of the tiles of an image, which are kTile_px wide and high: a tile is selected if its value
/// is not zero.
struct TileMask {
  int columns = 0, rows = 0;
  std::vector<std::uint8_t> values;  ///< row by row

  TileMask() = default;
  TileMask(int columns_, int rows_)
      : columns(columns_), rows(rows_), values(std::size_t(columns_) * std::size_t(rows_)) {}
  bool empty() const { return values.empty(); }
  bool has_nonzero_tile() const { return std::ranges::any_of(values, std::identity()); }
  std::uint8_t* tile_row(int y) { return values.data() + std::ptrdiff_t(y) * columns; }
  const std::uint8_t* tile_row(int y) const { return values.data() + std::ptrdiff_t(y) * columns; }
};

/// Finds the tiles with pixels above `threshold`. The tile and its neighbors have to contain more
/// than one such pixel, because a single pixel is noise and forms no run.
///
/// Searches every second row, alternating between odd and even rows every 16 rows. Then searches
/// every row of the tiles with light and of their neighbors. A light is found if two consecutive
/// rows are lit. A light with single-row stripes at an even period is guaranteed to be found if its
/// height is at least 16 rows and a period. Identification of a lamp needs at least 8 lit lines.
TileMask mark_bright_tiles(const ImageView& image, double threshold);

/// Returns the mask with all eight neighbors of its nonzero tiles added.
TileMask dilate_tile_mask(const TileMask& mask);

TileMask transpose_tiles(const TileMask& mask);

/// Returns the bounding boxes, in tiles, of the 8-connected groups of nonzero tiles.
std::vector<PixelBox> list_tile_boxes(TileMask mask);

/// Converts a box of tiles to a box of pixels, clipped to an image of `size`.
PixelBox pixels_from_tiles(const PixelBox& tiles, const ImageSize& size);

}  // namespace vlp
