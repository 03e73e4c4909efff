// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/projection_difference.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace vlp {
namespace {

struct Pair {
  Eigen::Vector2d pixel;
  Eigen::Vector3d a, b;
  double weight;
};

/// Fits the rotation of a to b by weighted least squares (Kabsch, 1976).
Eigen::Matrix3d fit_rotation_between_lenses(const std::vector<Pair>& pairs) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const Pair& pair : pairs) sum += pair.weight * pair.b * pair.a.transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant());
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

}  // namespace

std::optional<Eigen::Matrix3d> fit_rotation_between_lenses(
    const Lens& a, const Lens& b, std::span<const Eigen::Vector2d> pixels) {
  std::vector<Pair> pairs;
  for (const Eigen::Vector2d& pixel : pixels) {
    const auto from_a = a.unproject(pixel), from_b = b.unproject(pixel);
    if (!from_a || !from_b) continue;
    pairs.push_back({pixel, from_a->direction.normalized(), from_b->direction.normalized(), 1});
  }
  if (pairs.size() < 3) return {};
  return fit_rotation_between_lenses(pairs);
}

std::vector<Eigen::Vector2d> make_regular_pixel_grid(const std::array<int, 2>& imager_px,
                                                     int cols) {
  const int rows =
      std::max(2, static_cast<int>(std::lround(cols * double(imager_px[1]) / imager_px[0])));
  std::vector<Eigen::Vector2d> pixels;
  for (int row = 0; row < rows; ++row) {
    for (int col = 0; col < cols; ++col) {
      pixels.emplace_back((imager_px[0] - 1) * double(col) / (cols - 1),
                          (imager_px[1] - 1) * double(row) / (rows - 1));
    }
  }
  return pixels;
}

std::optional<ProjectionDifference> compute_projection_difference(
    const Lens& a, const Lens& b, const std::array<int, 2>& imager_px,
    const std::function<double(const Eigen::Vector2d&)>& sigma_px) {
  std::vector<Pair> pairs;
  for (const Eigen::Vector2d& pixel : make_regular_pixel_grid(imager_px)) {
    const auto from_a = a.unproject(pixel), from_b = b.unproject(pixel);
    const double sigma = sigma_px(pixel);
    if (!from_a || !from_b || !(sigma > 0) || !std::isfinite(sigma)) continue;
    pairs.push_back({pixel, from_a->direction.normalized(), from_b->direction.normalized(),
                     1 / (sigma * sigma)});
  }
  if (pairs.size() < 3) return {};
  const Eigen::Matrix3d rotation = fit_rotation_between_lenses(pairs);
  ProjectionDifference difference{0, 0, 0};
  double count = 0;
  for (const Pair& pair : pairs) {
    const auto pixel = b.project(rotation * pair.a);
    if (!pixel) continue;
    const double distance_px = (*pixel - pair.pixel).norm();
    difference.mean_px += distance_px;
    difference.rms_px += distance_px * distance_px;
    difference.worst_px = std::max(difference.worst_px, distance_px);
    ++count;
  }
  if (count == 0) return {};
  difference.mean_px /= count;
  difference.rms_px = std::sqrt(difference.rms_px / count / 2);
  return difference;
}

}  // namespace vlp
