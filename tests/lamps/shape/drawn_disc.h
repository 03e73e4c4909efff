// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "frontend/mat_view.h"

namespace vlp {

constexpr double kDark = 0.04;  // fraction of white

/// Blurred disc on a dark image of 200 x 160 pixels with a fill factor of 1. The blur includes that
/// of the pixels: 0.3 px or more.
struct DrawnDisc {
  Eigen::Vector2d center{101.3, 79.6};
  double radius_px = 38.4, blur_px = 0.8;
  double level = 0.7;                  // fraction of white, above the dark level
  double change = 0;                   // fraction of the level, from the center to the right rim
  double fall = 0;                     // fraction of the level at the rim, grows as radius^2
  std::vector<int> dark_columns = {};  // columns of an occluding bar
  /// Additional fraction of the level above LED chips, and the distance between chips.
  double chips = 0, pitch_px = 6;

  double off(const Eigen::Vector2d& pixel) const { return (pixel - center).norm() - radius_px; }
  cv::Mat image(int depth) const {
    constexpr int finer = 8;
    constexpr double pixels_own = 1 / 12.0;  // variance of a pixel's area
    cv::Mat1d sharp(160 * finer, 200 * finer);
    for (int row = 0; row < sharp.rows; ++row) {
      for (int column = 0; column < sharp.cols; ++column) {
        const Eigen::Vector2d place(column, row);
        const double inside_px = -off((place.array() + 0.5) / finer - 0.5);
        const double lost = fall * std::pow(1 - inside_px / radius_px, 2);
        const double wave = 2 * std::numbers::pi / (finer * pitch_px);
        const double above = std::cos(wave * column) * std::cos(wave * row);
        const double chip = 1 + chips * std::max(0.0, above);
        sharp(row, column) = std::clamp(0.5 + finer * inside_px, 0.0, 1.0) * (1 - lost) * chip;
      }
    }
    const double sigma = finer * std::sqrt(blur_px * blur_px - pixels_own);
    cv::GaussianBlur(sharp, sharp, {}, sigma);
    cv::Mat1d light;
    cv::resize(sharp, light, {200, 160}, 0, 0, cv::INTER_AREA);
    const double white = depth == CV_8U ? 255 : 65535;
    for (int row = 0; row < light.rows; ++row) {
      for (int column = 0; column < light.cols; ++column) {
        const double here = level * (1 + change * (column - center.x()) / radius_px);
        light(row, column) = white * (kDark + here * light(row, column));
      }
    }
    for (const int column : dark_columns) light.col(column) = white * kDark;
    cv::Mat image;
    light.convertTo(image, depth);
    return image;
  }
};

}  // namespace vlp
