// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>

#include "pixel_box.h"

namespace vlp {

/// Non-owning view of a gray image. The memory has to stay valid as long as the view is used.
struct ImageView {
  /// Pointer to the first pixel of the first row. Pixels are std::uint8_t if `bits` is 8. If `bits`
  /// is 16, they are aligned std::uint16_t in native byte order. Null: empty view.
  const void* data = nullptr;
  int width = 0, height = 0;  ///< pixels
  /// Bytes from the start of a row to the start of the next one.
  std::ptrdiff_t stride = 0;
  int bits = 8;  ///< 8 or 16

  bool empty() const { return data == nullptr || width <= 0 || height <= 0; }
  ImageSize size() const { return {width, height}; }
  /// Returns the largest level: 255 or 65535.
  int get_max_gray_level() const { return (1 << bits) - 1; }

  /// Returns the first pixel of row y. `Level` is std::uint8_t or std::uint16_t, according to
  /// `bits`.
  template <typename Level>
  const Level* row_pixels(int y) const {
    return reinterpret_cast<const Level*>(static_cast<const std::byte*>(data) + y * stride);
  }

  /// Returns the level of the pixel in column x of row y. @pre The pixel is in the image.
  int gray_level_at_pixel(int x, int y) const {
    return bits == 8 ? row_pixels<std::uint8_t>(y)[x] : row_pixels<std::uint16_t>(y)[x];
  }

  /// Returns a view of the intersection of `box` and the image; an empty view if they do not
  /// overlap.
  ImageView crop_to_box(const PixelBox& box) const {
    const PixelBox inside = intersect_boxes(box, {0, 0, width, height});
    const auto* first = static_cast<const std::byte*>(data) + inside.y * stride;
    return {first + std::ptrdiff_t(inside.x) * (bits / 8), inside.width, inside.height, stride,
            bits};
  }
};

/// Calls `function` with a value of the level type of the image, std::uint8_t or std::uint16_t, and
/// returns its result.
template <typename Function>
decltype(auto) visit_levels(const ImageView& image, Function&& function) {
  return image.bits == 8 ? std::forward<Function>(function)(std::uint8_t{})
                         : std::forward<Function>(function)(std::uint16_t{});
}

}  // namespace vlp
