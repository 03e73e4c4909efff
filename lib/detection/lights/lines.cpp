// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/lights/lines.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace vlp {
namespace {

constexpr int kTile = 64;

template <typename Level>
bool any_above(const cv::Mat& tile, double threshold) {
  Level brightest = 0;
  for (int row = 0; row < tile.rows; ++row) {
    const auto* pixels = tile.ptr<Level>(row);
    for (int column = 0; column < tile.cols; ++column) {
      brightest = std::max(brightest, pixels[column]);
    }
  }
  return brightest > threshold;
}

std::size_t index_of(const cv::Size& tiles, int row, int column) {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(tiles.width) +
         static_cast<std::size_t>(column);
}

/// Tiles with something bright, and those around them, where outlines are seen from outside.
std::vector<bool> tiles_to_turn(const cv::Mat& image, const cv::Size& tiles, double threshold) {
  const cv::Rect all({0, 0}, image.size());
  std::vector<bool> turn(index_of(tiles, tiles.height, 0));
  for (int row = 0; row < tiles.height; ++row) {
    for (int column = 0; column < tiles.width; ++column) {
      const cv::Mat tile = image(cv::Rect(column * kTile, row * kTile, kTile, kTile) & all);
      const bool lit = image.depth() == CV_8U ? any_above<std::uint8_t>(tile, threshold)
                                              : any_above<std::uint16_t>(tile, threshold);
      if (!lit) continue;
      for (int r = std::max(0, row - 1); r <= std::min(tiles.height - 1, row + 1); ++r) {
        for (int c = std::max(0, column - 1); c <= std::min(tiles.width - 1, column + 1); ++c) {
          turn[index_of(tiles, r, c)] = true;
        }
      }
    }
  }
  return turn;
}

}  // namespace

cv::Mat lines_of(const cv::Mat& image, Readout readout, const Background& background) {
  if (readout == Readout::rows) return image;
  const cv::Size tiles((image.cols + kTile - 1) / kTile, (image.rows + kTile - 1) / kTile);
  const auto turn = tiles_to_turn(image, tiles, background.threshold);
  const cv::Rect all({0, 0}, image.size());
  cv::Mat lines(image.cols, image.rows, image.type(), cv::Scalar(std::round(background.level)));
  for (int row = 0; row < tiles.height; ++row) {
    for (int column = 0; column < tiles.width; ++column) {
      if (!turn[index_of(tiles, row, column)]) continue;
      const cv::Rect tile = cv::Rect(column * kTile, row * kTile, kTile, kTile) & all;
      cv::Mat target = lines(cv::Rect(tile.y, tile.x, tile.height, tile.width));
      cv::transpose(image(tile), target);
    }
  }
  return lines;
}

}  // namespace vlp
