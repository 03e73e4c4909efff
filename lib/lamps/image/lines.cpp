// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/image/lines.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <new>
#include <opencv2/imgproc.hpp>

#include "lamps/image/runs.h"

namespace vlp {
namespace {

/// Black. The system gives such memory page by page, when it is used first.
Lines black_lines(const cv::Size& size, int type) {
  Lines lines;
  const std::size_t pixels = std::size_t(size.width) * std::size_t(size.height);
  lines.memory = {std::calloc(pixels, std::size_t(CV_ELEM_SIZE(type))), std::free};
  if (!lines.memory) throw std::bad_alloc();
  lines.pixels = cv::Mat(size, type, lines.memory.get());
  return lines;
}

cv::Rect grown(const cv::Rect& tiles, int by) {
  return {tiles.x - by, tiles.y - by, tiles.width + 2 * by, tiles.height + 2 * by};
}

cv::Rect pixels_of(const cv::Rect& tiles) {
  return {tiles.x * kTile_px, tiles.y * kTile_px, tiles.width * kTile_px, tiles.height * kTile_px};
}

/// Not those with one lit pixel and none in the tiles around: that is noise, and no run.
cv::Mat1b without_lone_pixels(const cv::Mat1b& lit) {
  cv::Mat1b around;
  cv::boxFilter(lit, around, -1, {3, 3}, {-1, -1}, false, cv::BORDER_CONSTANT);
  return cv::Mat1b((lit > 0) & (around > 1));
}

/// The background's level around each group of lit tiles, as far as it is large.
void fill_around(const cv::Mat1b& lit, double level, cv::Mat& pixels) {
  const cv::Rect all({0, 0}, pixels.size());
  cv::Mat labels, groups, centers;
  const int count = cv::connectedComponentsWithStats(lit, labels, groups, centers);
  for (int group = 1; group < count; ++group) {
    const auto* box = groups.ptr<int>(group);
    const cv::Rect tiles(box[cv::CC_STAT_LEFT], box[cv::CC_STAT_TOP], box[cv::CC_STAT_WIDTH],
                         box[cv::CC_STAT_HEIGHT]);
    const int size = std::max(tiles.width, tiles.height);
    if (size == 1) continue;  // the tiles around it are turned
    pixels(pixels_of(grown(tiles, size)) & all).setTo(std::round(level));
  }
}

}  // namespace

Lines lines_of(const cv::Mat& image, Readout readout, const Background& background) {
  if (readout == Readout::rows) return {image, {}, {}};
  const cv::Mat1b lit = without_lone_pixels(lit_tiles(image, background.threshold));
  Lines lines = black_lines({image.rows, image.cols}, image.type());
  cv::transpose(lit, lines.lit);
  fill_around(lines.lit, background.level, lines.pixels);
  cv::Mat1b turned;
  cv::dilate(lit, turned, cv::Mat1b::ones(3, 3));
  const cv::Rect all({0, 0}, image.size());
  for (int row = 0; row < turned.rows; ++row) {
    for (int column = 0; column < turned.cols; ++column) {
      if (turned(row, column) == 0) continue;
      const cv::Rect tile = pixels_of({column, row, 1, 1}) & all;
      cv::Mat target = lines.pixels(cv::Rect(tile.y, tile.x, tile.height, tile.width));
      cv::transpose(image(tile), target);
    }
  }
  return lines;
}

}  // namespace vlp
