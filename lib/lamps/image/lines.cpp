// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/image/lines.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <new>
#include <vector>

#include "lamps/image/pixel_box.h"

namespace vlp {
namespace {

/// Pixels that `Lines` owns.
template <typename Level>
struct Pixels {
  Level* first;
  int width, height;

  Level* row(int y) const { return first + std::ptrdiff_t(y) * width; }
};

/// Allocates a black image. The system gives such memory page by page, when it is used first.
std::shared_ptr<void> black_pixels(const ImageSize& size, int bits) {
  const std::size_t pixels = std::size_t(size.width) * std::size_t(size.height);
  std::shared_ptr<void> memory{std::calloc(pixels, std::size_t(bits / 8)), std::free};
  if (!memory) throw std::bad_alloc();
  return memory;
}

PixelBox grown(const PixelBox& tiles, int by) {
  return {tiles.x - by, tiles.y - by, tiles.width + 2 * by, tiles.height + 2 * by};
}

PixelBox pixels_of(const PixelBox& tiles) {
  return {tiles.x * kTile_px, tiles.y * kTile_px, tiles.width * kTile_px, tiles.height * kTile_px};
}

/// Calls a function with the value of each tile around one, and of that one itself.
template <typename Function>
void for_each_around(const TileMask& mask, int column, int row, Function&& function) {
  const PixelBox box = intersection({column - 1, row - 1, 3, 3}, {0, 0, mask.columns, mask.rows});
  for (int y = box.y; y < box.bottom(); ++y) {
    for (int x = box.x; x < box.right(); ++x) function(x, y, mask.row(y)[x]);
  }
}

/// Returns the mask of what a function makes of each tile.
template <typename Function>
TileMask map_tiles(const TileMask& mask, Function&& function) {
  TileMask result(mask.columns, mask.rows);
  for (int row = 0; row < mask.rows; ++row) {
    for (int column = 0; column < mask.columns; ++column) {
      result.row(row)[column] = function(column, row) ? 1 : 0;
    }
  }
  return result;
}

/// Leaves out tiles with one lit pixel and none in the tiles around: that is noise, and no run.
TileMask without_lone_pixels(const TileMask& lit) {
  return map_tiles(lit, [&](int column, int row) {
    int around = 0;
    for_each_around(lit, column, row, [&](int, int, int value) { around += value; });
    return lit.row(row)[column] > 0 && around > 1;
  });
}

/// Adds the tiles around.
TileMask dilated(const TileMask& lit) {
  return map_tiles(lit, [&](int column, int row) {
    bool any = false;
    for_each_around(lit, column, row, [&](int, int, int value) { any = any || value > 0; });
    return any;
  });
}

TileMask transposed(const TileMask& mask) {
  TileMask result(mask.rows, mask.columns);
  for (int row = 0; row < mask.rows; ++row) {
    for (int column = 0; column < mask.columns; ++column) {
      result.row(column)[row] = mask.row(row)[column];
    }
  }
  return result;
}

/// Returns the boxes around the groups of tiles that touch, corners included.
std::vector<PixelBox> group_boxes(TileMask lit) {
  std::vector<PixelBox> boxes;
  std::vector<std::pair<int, int>> open;
  for (int row = 0; row < lit.rows; ++row) {
    for (int column = 0; column < lit.columns; ++column) {
      if (lit.row(row)[column] == 0) continue;
      PixelBox box{column, row, 1, 1};
      open.emplace_back(column, row);
      lit.row(row)[column] = 0;
      while (!open.empty()) {
        const auto [x, y] = open.back();
        open.pop_back();
        box = around(box, {x, y, 1, 1});
        for_each_around(lit, x, y, [&](int next_x, int next_y, int value) {
          if (value == 0) return;
          open.emplace_back(next_x, next_y);
          lit.row(next_y)[next_x] = 0;
        });
      }
      boxes.push_back(box);
    }
  }
  return boxes;
}

/// The background's level around each group of lit tiles, as far as it is large.
template <typename Level>
void fill_around(const TileMask& lit, Level level, const Pixels<Level>& pixels) {
  for (const PixelBox& tiles : group_boxes(lit)) {
    const int size = std::max(tiles.width, tiles.height);
    if (size == 1) continue;  // the tiles around it are turned
    const PixelBox box =
        intersection(pixels_of(grown(tiles, size)), {0, 0, pixels.width, pixels.height});
    for (int y = box.y; y < box.bottom(); ++y) std::fill_n(pixels.row(y) + box.x, box.width, level);
  }
}

/// Turns a box of an image over its diagonal, in squares that stay in the cache's lines.
template <typename Level>
void transpose(const ImageView& image, const PixelBox& box, const Pixels<Level>& turned) {
  constexpr int square = 16;
  for (int top = box.y; top < box.bottom(); top += square) {
    const int bottom = std::min(top + square, box.bottom());
    for (int x = box.x; x < box.right(); ++x) {
      Level* target = turned.row(x);
      for (int y = top; y < bottom; ++y) target[y] = image.row<Level>(y)[x];
    }
  }
}

template <typename Level>
void fill_lines(const ImageView& image, const TileMask& lit, double dark, Lines& lines) {
  const Pixels<Level> pixels{static_cast<Level*>(lines.memory.get()), image.height, image.width};
  fill_around(lines.lit, static_cast<Level>(std::lround(dark)), pixels);
  const TileMask turned = dilated(lit);
  for (int row = 0; row < turned.rows; ++row) {
    for (int column = 0; column < turned.columns; ++column) {
      if (turned.row(row)[column] == 0) continue;
      const PixelBox tile = pixels_of({column, row, 1, 1});
      transpose(image, intersection(tile, {0, 0, image.width, image.height}), pixels);
    }
  }
}

}  // namespace

Lines lines_of(const ImageView& image, Readout readout, const Background& background) {
  if (readout == Readout::rows) return {image, {}, {}};
  const TileMask lit = without_lone_pixels(lit_tiles(image, background.threshold));
  Lines lines;
  lines.memory = black_pixels({image.height, image.width}, image.bits);
  lines.pixels = {lines.memory.get(), image.height, image.width,
                  std::ptrdiff_t(image.height) * (image.bits / 8), image.bits};
  lines.lit = transposed(lit);
  visit_levels(
      image, [&](auto level) { fill_lines<decltype(level)>(image, lit, background.level, lines); });
  return lines;
}

}  // namespace vlp
