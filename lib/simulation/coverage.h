// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "simulation/pixel_window.h"

namespace vlp {

/// Pose of the camera in the frame of a rendered target while a line is exposed.
using TargetFromCamera = std::function<Eigen::Isometry3d(int line)>;

/// Returns the point (x, y) at which a ray meets the plane z = 0 of the target's frame, in the unit
/// of `origin`. NaN if the ray does not meet the plane in its direction.
inline Eigen::Vector2d intersect_ray_with_plane(const Eigen::Vector3d& origin,
                                                const Eigen::Vector3d& direction) {
  const double distance = -origin.z() / direction.z();
  if (!(distance > 0)) return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  return origin.head<2>() + distance * direction.head<2>();
}

inline double cross_product_2d(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// Adds to each element of the window, which is all of `image`, `weight` times the mean of a flat
/// pattern g over the element: a pixel or, with `per_px` 2, a quarter of one.
///
/// The mean is exact for the element's image on the pattern, a quadrilateral Q. By Green's theorem
/// the integral of g over Q is the sum of shape.compute_edge_contribution_to_area_integral(p, q)
/// over its edges. An edge integral is the integral along the edge of any G(x, y) that Green's
/// theorem turns into g.
///
/// Reason for quarters of pixels: a lens blurs the light before pixels integrate it. Blurring pixel
/// means instead would displace an edge by 0.01 px. Rays within a pixel are interpolated linearly
/// between those of its corners.
///
/// A shape has intersect_ray_with_shape(origin, direction) in its frame and
/// compute_edge_contribution_to_area_integral(p, q). Its
/// find_constant_value_in_quadrilateral(corners) is the value of the pattern if it is constant over
/// a whole quadrilateral.
template <typename Shape>
void add_shape_to_image(const PixelRays& rays, const PixelWindow& window,
                        const TargetFromCamera& target_from_camera, const Shape& shape,
                        double weight, cv::Mat1f& image, int per_px = 1) {
  struct Edge {
    double integral, area;
  };
  const auto edge = [&](const Eigen::Vector2d& p, const Eigen::Vector2d& q) {
    return Edge{shape.compute_edge_contribution_to_area_integral(p, q), cross_product_2d(p, q) / 2};
  };
  const auto corner_ray = [&](int row, int column) -> Eigen::Vector3d {
    const int line = window.line_begin + row / per_px, place = window.place_begin + column / per_px;
    const int next_line = line + row % per_px, next_place = place + column % per_px;
    return rays.pixel_corner_ray(line, place) + rays.pixel_corner_ray(line, next_place) +
           rays.pixel_corner_ray(next_line, place) + rays.pixel_corner_ray(next_line, next_place);
  };
  const auto columns = static_cast<std::size_t>(image.cols);
  std::vector<Eigen::Vector2d> above(columns + 1), below(columns + 1);
  std::optional<Eigen::Isometry3d> previous_pose;
  for (int row = 0; row < image.rows; ++row) {
    const Eigen::Isometry3d pose = target_from_camera(window.line_begin + row / per_px);
    const auto intersect_row = [&](int corner_row, std::vector<Eigen::Vector2d>& points) {
      for (std::size_t i = 0; i <= columns; ++i) {
        points[i] = shape.intersect_ray_with_shape(
            pose.translation(), pose.linear() * corner_ray(corner_row, static_cast<int>(i)));
      }
    };
    // Rows seen from one pose share their corners: all rows unless camera or target moves.
    if (previous_pose && previous_pose->matrix() == pose.matrix()) {
      std::swap(above, below);
    } else {
      intersect_row(row, above);
    }
    intersect_row(row + 1, below);
    previous_pose = pose;
    std::optional<Edge> left;
    for (std::size_t i = 0; i < columns; ++i) {
      float& element = image(row, static_cast<int>(i));
      if (const auto even = shape.find_constant_value_in_quadrilateral(
              {above[i], above[i + 1], below[i + 1], below[i]})) {
        element += static_cast<float>(weight * *even);
        left.reset();
        continue;
      }
      if (!left) left = edge(below[i], above[i]);
      const Edge top = edge(above[i], above[i + 1]);
      const Edge right = edge(below[i + 1], above[i + 1]);
      const Edge bottom = edge(below[i], below[i + 1]);
      const double area = left->area + top.area - right.area - bottom.area;
      const double mean = (left->integral + top.integral - right.integral - bottom.integral) / area;
      if (std::isfinite(mean)) element += static_cast<float>(weight * mean);
      left = right;
    }
  }
}

}  // namespace vlp
