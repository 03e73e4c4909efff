// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/image/scanlines.h"

#include <sys/mman.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <new>
#include <utility>

#include "lamps/image/pixel_box.h"

namespace vlp {
namespace {

/// Pixels owned by `ScanlineImage`.
template <typename Level>
struct Pixels {
  Level* first;
  int width, height;

  Level* row(int y) const { return first + std::ptrdiff_t(y) * width; }
};

/// Allocates a black image. The system provides such memory page by page at its first use. Large
/// pages are requested, because getting a small page takes longer than transposing its pixels.
std::shared_ptr<void> allocate_black_image(const ImageSize& size, int bits) {
  const std::size_t bytes =
      std::size_t(size.width) * std::size_t(size.height) * std::size_t(bits / 8);
  void* memory = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw std::bad_alloc();
  madvise(memory, bytes, MADV_HUGEPAGE);
  return {memory, [bytes](void* used) { munmap(used, bytes); }};
}

/// Fills a margin around each group of lit tiles with the background level. The margin is the size
/// of the group.
template <typename Level>
void fill_around_lit_tiles(const TileMask& lit, Level level, const Pixels<Level>& pixels) {
  for (const PixelBox& tiles : list_tile_boxes(lit)) {
    const int size = std::max(tiles.width, tiles.height);
    if (size == 1) continue;  // the tiles around it are transposed
    const PixelBox box = pixels_from_tiles(
        expand_and_clip_box(tiles, size, {lit.columns, lit.rows}), {pixels.width, pixels.height});
    for (int y = box.y; y < box.end_row(); ++y)
      std::fill_n(pixels.row(y) + box.x, box.width, level);
  }
}

/// Transposes a box of an image, in squares that fit the cache lines.
template <typename Level>
void transpose(const ImageView& image, const PixelBox& box, const Pixels<Level>& turned) {
  constexpr int square = 16;
  for (int top = box.y; top < box.end_row(); top += square) {
    const int bottom = std::min(top + square, box.end_row());
    for (int x = box.x; x < box.end_column(); ++x) {
      Level* target = turned.row(x);
      for (int y = top; y < bottom; ++y) target[y] = image.row_pixels<Level>(y)[x];
    }
  }
}

template <typename Level>
void fill_scanlines(const ImageView& image, const TileMask& lit, double dark,
                    ScanlineImage& lines) {
  const Pixels<Level> pixels{static_cast<Level*>(lines.memory.get()), image.height, image.width};
  fill_around_lit_tiles(lines.lit, static_cast<Level>(std::lround(dark)), pixels);
  const TileMask turned = dilate_tile_mask(lit);
  for (int row = 0; row < turned.rows; ++row) {
    for (int column = 0; column < turned.columns; ++column) {
      if (turned.tile_row(row)[column] == 0) continue;
      transpose(image, pixels_from_tiles({column, row, 1, 1}, image.size()), pixels);
    }
  }
}

}  // namespace

ScanlineImage make_scanlines(const ImageView& image, Readout readout,
                             const Background& background) {
  TileMask lit = mark_bright_tiles(image, background.threshold);
  if (readout == Readout::rows) return {image, std::move(lit), {}};
  ScanlineImage lines;
  lines.memory = allocate_black_image({image.height, image.width}, image.bits);
  lines.pixels = {lines.memory.get(), image.height, image.width,
                  std::ptrdiff_t(image.height) * (image.bits / 8), image.bits};
  lines.lit = transpose_tiles(lit);
  visit_levels(image, [&](auto level) {
    fill_scanlines<decltype(level)>(image, lit, background.level, lines);
  });
  return lines;
}

}  // namespace vlp
