// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

namespace vlp {

/// Size of an image, in pixels.
struct ImageSize {
  int width = 0, height = 0;

  bool operator==(const ImageSize&) const = default;
};

/// Axis-aligned box of pixels: columns x to x + width - 1, rows y to y + height - 1. Empty if width
/// or height is 0.
struct PixelBox {
  int x = 0, y = 0, width = 0, height = 0;

  int end_column() const { return x + width; }
  int end_row() const { return y + height; }
  int area_px() const { return width * height; }

  bool operator==(const PixelBox&) const = default;
};

/// Returns the intersection of two boxes; width and height are 0 if they do not overlap.
inline PixelBox intersect_boxes(const PixelBox& a, const PixelBox& b) {
  const int x = std::max(a.x, b.x), y = std::max(a.y, b.y);
  const int width = std::min(a.end_column(), b.end_column()) - x;
  const int height = std::min(a.end_row(), b.end_row()) - y;
  return width > 0 && height > 0 ? PixelBox{x, y, width, height} : PixelBox{};
}

/// Returns the bounding box of two boxes. @pre Both boxes are not empty.
inline PixelBox enclosing_box(const PixelBox& a, const PixelBox& b) {
  const int x = std::min(a.x, b.x), y = std::min(a.y, b.y);
  return {x, y, std::max(a.end_column(), b.end_column()) - x,
          std::max(a.end_row(), b.end_row()) - y};
}

/// Returns the box extended by `margin_px` on each side and clipped to an image of `size`.
inline PixelBox expand_and_clip_box(const PixelBox& box, int margin_px, const ImageSize& size) {
  return intersect_boxes(
      {box.x - margin_px, box.y - margin_px, box.width + 2 * margin_px, box.height + 2 * margin_px},
      {0, 0, size.width, size.height});
}

/// Returns the distance between two boxes along the axis in which it is larger; negative if they
/// overlap.
inline int compute_box_gap_px(const PixelBox& a, const PixelBox& b) {
  const int across = std::max(a.x, b.x) - std::min(a.end_column(), b.end_column());
  const int along = std::max(a.y, b.y) - std::min(a.end_row(), b.end_row());
  return std::max(across, along);
}

}  // namespace vlp
