// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace vlp {

/// A grey image in memory that the caller owns and that stays valid as long as the view is used.
struct ImageView {
  /// First pixel of the first row. Pixels are std::uint8_t where bits is 8, and std::uint16_t in the
  /// machine's byte order where it is 16, aligned as such.
  const void* data = nullptr;
  int width = 0, height = 0;  ///< pixels
  /// Bytes from the start of a row to the start of the next one.
  std::ptrdiff_t stride = 0;
  int bits = 8;  ///< 8 or 16

  bool empty() const { return data == nullptr || width <= 0 || height <= 0; }

  /// Returns the first pixel of row y. `Level` is std::uint8_t or std::uint16_t, as `bits` has it.
  template <typename Level>
  const Level* row(int y) const {
    return reinterpret_cast<const Level*>(static_cast<const std::byte*>(data) + y * stride);
  }
};

}  // namespace vlp
