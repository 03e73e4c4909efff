// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>

namespace vlp {

/// Number of corners in each of 8 x 6 parts of an image.
class ImageCoverage {
 public:
  static constexpr int kCols = 8, kRows = 6;

  explicit ImageCoverage(const std::array<int, 2>& imager_px) : imager_px_(imager_px) {}

  void add_corner(const Eigen::Vector2d& pixel) {
    ++corners_[flat_cell_index(cell_index(pixel.x(), imager_px_[0], kCols),
                               cell_index(pixel.y(), imager_px_[1], kRows))];
  }
  int count_in_cell(int col, int row) const { return corners_[flat_cell_index(col, row)]; }

  /// Returns the fraction, 0 to 1, of the 8 x 6 equal parts of the image that contain at least one
  /// corner.
  double covered_fraction() const {
    const auto covered =
        std::count_if(corners_.begin(), corners_.end(), [](int corners) { return corners > 0; });
    return static_cast<double>(covered) / static_cast<double>(corners_.size());
  }

  /// Returns the number of the part, of `parts` along an edge of `size_px`, that a pixel is in.
  static int cell_index(double pixel, int size_px, int parts) {
    return std::clamp(static_cast<int>(pixel / size_px * parts), 0, parts - 1);
  }

 private:
  static std::size_t flat_cell_index(int col, int row) {
    return static_cast<std::size_t>(row * kCols + col);
  }

  std::array<int, 2> imager_px_;
  std::array<int, kCols * kRows> corners_{};
};

}  // namespace vlp
