// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/saddle_point.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace vlp {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;

bool has_room(const cv::Mat1f& image, const Eigen::Vector2i& at, int radius) {
  return at.x() >= radius && at.y() >= radius && at.x() + radius < image.cols &&
         at.y() + radius < image.rows;
}

/// Returns the negative determinant of the Hessian, from differences over two pixels.
float compute_saddle_strength(const cv::Mat1f& image, int column, int row) {
  constexpr int step = 2;
  const auto at = [&](int x, int y) { return image(row + step * y, column + step * x); };
  const float xx = at(-1, 0) - 2 * at(0, 0) + at(1, 0);
  const float yy = at(0, -1) - 2 * at(0, 0) + at(0, 1);
  const float xy = (at(1, 1) - at(-1, 1) - at(1, -1) + at(-1, -1)) / 4;
  return xy * xy - xx * yy;
}

std::optional<Eigen::Vector2i> find_strongest_saddle(const cv::Mat1f& image,
                                                     const Eigen::Vector2d& guess_px, int reach) {
  constexpr int room = 2;
  const Eigen::Vector2i middle = guess_px.array().round().cast<int>();
  std::optional<Eigen::Vector2i> best;
  float max_strength = 0;
  for (int y = -reach; y <= reach; ++y) {
    for (int x = -reach; x <= reach; ++x) {
      const Eigen::Vector2i at = middle + Eigen::Vector2i(x, y);
      if (x * x + y * y > reach * reach || !has_room(image, at, room)) continue;
      const float value = compute_saddle_strength(image, at.x(), at.y());
      if (value <= max_strength) continue;
      max_strength = value;
      best = at;
    }
  }
  return best;
}

/// Fits a quadratic surface in a window and returns its saddle point relative to the center of the
/// window; std::nullopt if it has no saddle.
std::optional<Eigen::Vector2d> fit_saddle_offset(const cv::Mat1f& image,
                                                 const Eigen::Vector2i& middle, int radius) {
  Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
  Vector6 right = Vector6::Zero();
  for (int y = -radius; y <= radius; ++y) {
    for (int x = -radius; x <= radius; ++x) {
      if (x * x + y * y > radius * radius) continue;
      const Vector6 terms{{double(x * x), double(x * y), double(y * y), double(x), double(y), 1}};
      normal += terms * terms.transpose();
      right += terms * double(image(middle.y() + y, middle.x() + x));
    }
  }
  const Vector6 fit = normal.ldlt().solve(right);
  Eigen::Matrix2d curvature;
  curvature << 2 * fit[0], fit[1], fit[1], 2 * fit[2];
  if (!(curvature.determinant() < 0)) return {};
  return -curvature.inverse() * fit.segment<2>(3);
}

}  // namespace

std::optional<Eigen::Vector2d> find_saddle_point(const cv::Mat1f& smoothed,
                                                 const Eigen::Vector2d& guess_px, int reach_px,
                                                 int radius_px) {
  constexpr int max_iterations = 5;
  constexpr double max_displacement_px = 2;
  const auto initial_pixel = find_strongest_saddle(smoothed, guess_px, reach_px);
  if (!initial_pixel) return {};
  Eigen::Vector2i middle = *initial_pixel;
  for (int step = 0; step < max_iterations; ++step) {
    if (!has_room(smoothed, middle, radius_px)) return {};
    const auto offset = fit_saddle_offset(smoothed, middle, radius_px);
    if (!offset) return {};
    const Eigen::Vector2d point = middle.cast<double>() + *offset;
    if (!((point - initial_pixel->cast<double>()).norm() <= max_displacement_px)) return {};
    const Eigen::Vector2i nearest = point.array().round().cast<int>();
    if (nearest == middle || step + 1 == max_iterations) return point;
    middle = nearest;
  }
  return {};
}

}  // namespace vlp
