// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "simulation/pixel_window.h"

namespace vlp {

/// Where the camera is, as seen by what is drawn, while a line is exposed.
using TargetFromCamera = std::function<Eigen::Isometry3d(int line)>;

/// Where a ray meets the plane z = 0 of the target; NaN when it does not.
inline Eigen::Vector2d plane_hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  const double distance = -origin.z() / direction.z();
  if (!(distance > 0)) return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  return origin.head<2>() + distance * direction.head<2>();
}

inline double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// Adds to each pixel of the window, which is all of `image`, weight times the mean of a flat
/// pattern g over the pixel. The mean is exact for the pixel's image on the pattern, a
/// quadrilateral Q: by Green's theorem the integral of g over Q is the sum over its edges of
/// shape.edge_integral(p, q), which is the integral of G(x, y) along the edge for any G that
/// Green's theorem turns into g. A shape has hit(origin, direction), in its frame, and
/// edge_integral(p, q).
template <typename Shape>
void add_shape(const PixelRays& rays, const PixelWindow& window,
               const TargetFromCamera& target_from_camera, const Shape& shape, double weight,
               cv::Mat1f& image) {
  struct Edge {
    double integral, area;
  };
  const auto edge = [&](const Eigen::Vector2d& p, const Eigen::Vector2d& q) {
    return Edge{shape.edge_integral(p, q), cross(p, q) / 2};
  };
  const auto corners = static_cast<std::size_t>(window.place_end - window.place_begin) + 1;
  std::vector<Eigen::Vector2d> above(corners), below(corners);
  for (int line = window.line_begin; line < window.line_end; ++line) {
    const Eigen::Isometry3d pose = target_from_camera(line);
    const Eigen::Vector3d origin = pose.translation();
    for (std::size_t i = 0; i < corners; ++i) {
      const int place = window.place_begin + static_cast<int>(i);
      above[i] = shape.hit(origin, pose.linear() * rays.corner(line, place));
      below[i] = shape.hit(origin, pose.linear() * rays.corner(line + 1, place));
    }
    float* pixel = image[line - window.line_begin];
    Edge left = edge(below[0], above[0]);
    for (std::size_t i = 0; i + 1 < corners; ++i) {
      const Edge top = edge(above[i], above[i + 1]);
      const Edge right = edge(below[i + 1], above[i + 1]);
      const Edge bottom = edge(below[i], below[i + 1]);
      const double area = left.area + top.area - right.area - bottom.area;
      const double mean = (left.integral + top.integral - right.integral - bottom.integral) / area;
      if (std::isfinite(mean)) pixel[i] += static_cast<float>(weight * mean);
      left = right;
    }
  }
}

}  // namespace vlp
