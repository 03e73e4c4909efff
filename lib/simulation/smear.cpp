// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "simulation/smear.h"

#include <algorithm>

namespace vlp {

double compute_motion_px(const std::vector<Eigen::Vector3d>& points_m,
                         const CameraFromTarget& camera_from_target, double exposure_s,
                         const PixelRays& rays) {
  constexpr int pieces = 16;
  const Eigen::Array2d size(rays.lines(), rays.places());
  const auto near_image = [&](const Eigen::Vector2d& pixel) {
    const Eigen::Array2d at = rays.line_and_place(pixel);
    return (at >= -0.1 * size).all() && (at <= 1.1 * size).all();
  };
  std::vector<std::optional<Eigen::Vector2d>> before(points_m.size());
  std::vector<double> lengths_px(points_m.size(), 0);
  for (int piece = 0; piece <= pieces; ++piece) {
    const auto pose = camera_from_target((double(piece) / pieces - 0.5) * exposure_s);
    for (std::size_t i = 0; i < points_m.size(); ++i) {
      const auto pixel = rays.lens().project(pose * points_m[i]);
      const bool counts = pixel && before[i] && (near_image(*pixel) || near_image(*before[i]));
      if (counts) lengths_px[i] += (*pixel - *before[i]).norm();
      before[i] = pixel;
    }
  }
  return lengths_px.empty() ? 0 : *std::max_element(lengths_px.begin(), lengths_px.end());
}

int count_exposure_parts(double compute_motion_px) {
  constexpr double max_motion_px = 0.1, max_parts = 1000;
  return 1 + static_cast<int>(std::min(compute_motion_px / max_motion_px, max_parts - 1));
}

}  // namespace vlp
