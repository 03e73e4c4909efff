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

/// Pixel box of columns x to x + width - 1 and rows y to y + height - 1.
struct PixelBox {
  int x = 0, y = 0, width = 0, height = 0;

  int right() const { return x + width; }
  int bottom() const { return y + height; }
  int area() const { return width * height; }

  bool operator==(const PixelBox&) const = default;
};

/// Returns the intersection of two boxes; width and height are 0 if they do not overlap.
inline PixelBox intersection(const PixelBox& a, const PixelBox& b) {
  const int x = std::max(a.x, b.x), y = std::max(a.y, b.y);
  const int width = std::min(a.right(), b.right()) - x;
  const int height = std::min(a.bottom(), b.bottom()) - y;
  return width > 0 && height > 0 ? PixelBox{x, y, width, height} : PixelBox{};
}

/// Returns the bounding box of two boxes. @pre Both boxes are not empty.
inline PixelBox around(const PixelBox& a, const PixelBox& b) {
  const int x = std::min(a.x, b.x), y = std::min(a.y, b.y);
  return {x, y, std::max(a.right(), b.right()) - x, std::max(a.bottom(), b.bottom()) - y};
}

}  // namespace vlp
