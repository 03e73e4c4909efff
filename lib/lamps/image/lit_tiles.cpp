// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/image/lit_tiles.h"

#include <algorithm>
#include <array>
#include <utility>

namespace vlp {
namespace {

/// Number of rows that are searched together: every second one of 17.
constexpr int kRowsAtOnce = 9;

template <typename Level>
using Rows = std::array<const Level*, kRowsAtOnce>;

/// Returns every `step`-th row from `first` on; rows below the image are replaced by its last row.
template <typename Level, int step>
Rows<Level> get_rows_from(const ImageView& image, int first) {
  Rows<Level> rows;
  for (int i = 0; i < kRowsAtOnce; ++i) {
    rows[std::size_t(i)] = image.row_pixels<Level>(std::min(first + step * i, image.height - 1));
  }
  return rows;
}

/// Returns the brightest level in a range of columns. Has no branches, so that it is compiled to
/// vector instructions.
template <typename Level>
Level get_brightest_level(const Rows<Level>& rows, int begin, int count) {
  const auto [a, b, c, d, e, f, g, h, l] = rows;
  Level brightest = 0;
  for (int i = begin; i < begin + count; ++i) {
    const Level upper = std::max(std::max(a[i], b[i]), std::max(c[i], d[i]));
    const Level lower = std::max(std::max(e[i], f[i]), std::max(g[i], h[i]));
    brightest = std::max(std::max(brightest, l[i]), std::max(upper, lower));
  }
  return brightest;
}

/// Marks the tiles that are lit in one of the searched rows.
template <typename Level>
void search(const ImageView& image, Level threshold, TileMask& found) {
  constexpr int span = 2 * (kRowsAtOnce - 1);  // rows from 0 to 16, from 15 to 31, and so on
  const int whole = image.width / kTile_px;
  for (int top = 0; top < image.height; top += span) {
    const Rows<Level> rows = get_rows_from<Level, 2>(image, top - top / span % 2);
    auto* marks = found.tile_row(top / kTile_px);
    for (int tile = 0; tile < whole; ++tile) {
      if (get_brightest_level(rows, tile * kTile_px, kTile_px) > threshold) marks[tile] = 1;
    }
    const int begin = whole * kTile_px, remaining_px = image.width - begin;
    if (remaining_px > 0 && get_brightest_level(rows, begin, remaining_px) > threshold)
      marks[whole] = 1;
  }
}

/// Counts the pixels of a box above the threshold: 0, 1, or 2 if there are more.
template <typename Level>
std::uint8_t count_above(const ImageView& image, const PixelBox& box, Level threshold) {
  std::ptrdiff_t count = 0;
  for (int top = box.y; top < box.end_row() && count < 2; top += kRowsAtOnce) {
    const auto rows = get_rows_from<Level, 1>(image, top);
    if (get_brightest_level(rows, box.x, box.width) <= threshold) continue;
    for (int y = top; y < std::min(top + kRowsAtOnce, box.end_row()); ++y) {
      const Level* row = image.row_pixels<Level>(y);
      count += std::count_if(row + box.x, row + box.end_column(),
                             [&](Level level) { return level > threshold; });
    }
  }
  return static_cast<std::uint8_t>(std::min<std::ptrdiff_t>(count, 2));
}

/// Calls `function` with the column and row of a tile and of each of its neighbors.
template <typename Function>
void for_each_neighbor_tile(const TileMask& mask, int column, int row, Function&& function) {
  const PixelBox box = expand_and_clip_box({column, row, 1, 1}, 1, {mask.columns, mask.rows});
  for (int y = box.y; y < box.end_row(); ++y) {
    for (int x = box.x; x < box.end_column(); ++x) function(x, y);
  }
}

/// Calls `function` with the column and row of each nonzero tile.
template <typename Function>
void for_each_nonzero_tile(const TileMask& mask, Function&& function) {
  for (int row = 0; row < mask.rows; ++row) {
    for (int column = 0; column < mask.columns; ++column) {
      if (mask.tile_row(row)[column] != 0) function(column, row);
    }
  }
}

int count_tiles_for(int pixels) { return (pixels + kTile_px - 1) / kTile_px; }

}  // namespace

PixelBox pixels_from_tiles(const PixelBox& tiles, const ImageSize& size) {
  return intersect_boxes(
      {tiles.x * kTile_px, tiles.y * kTile_px, tiles.width * kTile_px, tiles.height * kTile_px},
      {0, 0, size.width, size.height});
}

TileMask mark_bright_tiles(const ImageView& image, double threshold) {
  TileMask found(count_tiles_for(image.width), count_tiles_for(image.height));
  if (threshold >= image.get_max_gray_level()) return found;
  TileMask counts = found, lit = found;
  visit_levels(image, [&](auto type) {
    const auto level = static_cast<decltype(type)>(threshold);
    search(image, level, found);
    for_each_nonzero_tile(dilate_tile_mask(found), [&](int column, int row) {
      const PixelBox box = pixels_from_tiles({column, row, 1, 1}, image.size());
      counts.tile_row(row)[column] = count_above(image, box, level);
    });
  });
  for_each_nonzero_tile(counts, [&](int column, int row) {
    int around = 0;
    for_each_neighbor_tile(counts, column, row,
                           [&](int x, int y) { around += counts.tile_row(y)[x]; });
    lit.tile_row(row)[column] = around > 1 ? 1 : 0;
  });
  return lit;
}

TileMask dilate_tile_mask(const TileMask& mask) {
  TileMask result(mask.columns, mask.rows);
  for_each_nonzero_tile(mask, [&](int column, int row) {
    for_each_neighbor_tile(mask, column, row, [&](int x, int y) { result.tile_row(y)[x] = 1; });
  });
  return result;
}

TileMask transpose_tiles(const TileMask& mask) {
  TileMask result(mask.rows, mask.columns);
  for_each_nonzero_tile(mask, [&](int column, int row) {
    result.tile_row(column)[row] = mask.tile_row(row)[column];
  });
  return result;
}

std::vector<PixelBox> list_tile_boxes(TileMask mask) {
  std::vector<PixelBox> boxes;
  std::vector<std::pair<int, int>> open;
  const auto visit_tile = [&](int x, int y) {
    if (mask.tile_row(y)[x] == 0) return;
    open.emplace_back(x, y);
    mask.tile_row(y)[x] = 0;
  };
  for (int row = 0; row < mask.rows; ++row) {
    for (int column = 0; column < mask.columns; ++column) {
      if (mask.tile_row(row)[column] == 0) continue;
      PixelBox box{column, row, 1, 1};
      visit_tile(column, row);
      while (!open.empty()) {
        const auto [x, y] = open.back();
        open.pop_back();
        box = enclosing_box(box, {x, y, 1, 1});
        for_each_neighbor_tile(mask, x, y, visit_tile);
      }
      boxes.push_back(box);
    }
  }
  return boxes;
}

}  // namespace vlp
