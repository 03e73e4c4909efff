// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "simulation/pixel_window.h"

namespace vlp {

/// Pose of the camera in the frame of a rendered target while a line is exposed.
using TargetFromCamera = std::function<Eigen::Isometry3d(int line)>;

/// Returns the intersection of a ray with the plane z = 0 of the target; NaN if there is none.
inline Eigen::Vector2d plane_hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  const double distance = -origin.z() / direction.z();
  if (!(distance > 0)) return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  return origin.head<2>() + distance * direction.head<2>();
}

inline double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// Returns a bit mask of the sides of the bounds on whose outer side the point lies; 0 for NaN.
inline unsigned find_sides_beyond(const Eigen::AlignedBox2d& bounds, const Eigen::Vector2d& point) {
  return unsigned(point.x() < bounds.min().x()) | unsigned(point.x() > bounds.max().x()) << 1 |
         unsigned(point.y() < bounds.min().y()) << 2 | unsigned(point.y() > bounds.max().y()) << 3;
}

/// Adds to each pixel of the window, which is all of `image`, `weight` times the mean of a flat
/// pattern g over the pixel.
///
/// The mean is exact for the pixel's image on the pattern, a quadrilateral Q. By Green's theorem
/// the integral of g over Q is the sum of shape.integrate_edge(p, q) over its edges. An edge
/// integral is the integral along the edge of any G(x, y) that Green's theorem turns into g.
///
/// A shape has hit(origin, direction) in its frame, integrate_edge(p, q) and bounds().
/// Quadrilaterals whose corners all lie on the outer side of one side of these bounds are skipped,
/// as g is 0 there.
template <typename Shape>
void add_shape(const PixelRays& rays, const PixelWindow& window,
               const TargetFromCamera& target_from_camera, const Shape& shape, double weight,
               cv::Mat1f& image) {
  struct Edge {
    double integral, area;
  };
  const auto edge = [&](const Eigen::Vector2d& p, const Eigen::Vector2d& q) {
    return Edge{shape.integrate_edge(p, q), cross(p, q) / 2};
  };
  const auto corners = static_cast<std::size_t>(window.place_end - window.place_begin) + 1;
  const Eigen::AlignedBox2d bounds = shape.bounds();
  std::vector<Eigen::Vector2d> above(corners), below(corners);
  /// Sides of the bounds beyond which both corners lie, the one above and the one below.
  std::vector<unsigned> sides(corners);
  for (int line = window.line_begin; line < window.line_end; ++line) {
    const Eigen::Isometry3d pose = target_from_camera(line);
    const Eigen::Vector3d origin = pose.translation();
    for (std::size_t i = 0; i < corners; ++i) {
      const int place = window.place_begin + static_cast<int>(i);
      above[i] = shape.hit(origin, pose.linear() * rays.corner(line, place));
      below[i] = shape.hit(origin, pose.linear() * rays.corner(line + 1, place));
      sides[i] = find_sides_beyond(bounds, above[i]) & find_sides_beyond(bounds, below[i]);
    }
    float* pixel = image[line - window.line_begin];
    Edge left = edge(below[0], above[0]);
    bool has_left = true;
    for (std::size_t i = 0; i + 1 < corners; ++i) {
      if ((sides[i] & sides[i + 1]) != 0) {
        has_left = false;
        continue;
      }
      if (!has_left) left = edge(below[i], above[i]);
      has_left = true;
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

/// Returns the mean of a shape's pattern over a quadrilateral with its corners in order.
template <typename Shape>
double compute_mean_over(const std::array<Eigen::Vector2d, 4>& corners, const Shape& shape) {
  double integral = 0, area = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d &p = corners[i], &q = corners[(i + 1) % 4];
    integral += shape.integrate_edge(p, q);
    area += cross(p, q) / 2;
  }
  return integral / area;
}

/// Does the same as add_shape() for each quarter of a pixel, in an image with twice the lines and
/// twice the places.
///
/// Reason: a lens blurs the light before pixels integrate it. Blurring pixel means instead would
/// displace an edge by 0.01 px. Rays within a pixel are interpolated linearly between those of its
/// corners. The shape also has constant_value(corners): the value of its pattern where it is
/// constant over a whole quadrilateral.
template <typename Shape>
void add_shape_supersampled(const PixelRays& rays, const PixelWindow& window,
                            const TargetFromCamera& target_from_camera, const Shape& shape,
                            double weight, cv::Mat1f& image) {
  const auto corners = static_cast<std::size_t>(window.place_end - window.place_begin) + 1;
  std::vector<Eigen::Vector2d> above(corners), below(corners);
  for (int line = window.line_begin; line < window.line_end; ++line) {
    const Eigen::Isometry3d pose = target_from_camera(line);
    const auto hit = [&, origin = Eigen::Vector3d(pose.translation())](const Eigen::Vector3d& ray) {
      return shape.hit(origin, pose.linear() * ray);
    };
    for (std::size_t i = 0; i < corners; ++i) {
      const int place = window.place_begin + static_cast<int>(i);
      above[i] = hit(rays.corner(line, place));
      below[i] = hit(rays.corner(line + 1, place));
    }
    float* const upper = image[2 * (line - window.line_begin)];
    float* const lower = image[2 * (line - window.line_begin) + 1];
    for (std::size_t i = 0; i + 1 < corners; ++i) {
      const auto add = [&](float* half, double value) {
        if (std::isfinite(value)) *half += static_cast<float>(weight * value);
      };
      const Eigen::Vector2d &a = above[i], &b = above[i + 1], &c = below[i + 1], &d = below[i];
      if (const auto even = shape.constant_value({a, b, c, d})) {
        for (float* half : {upper + 2 * i, lower + 2 * i}) {
          add(half, *even);
          add(half + 1, *even);
        }
        continue;
      }
      const int place = window.place_begin + static_cast<int>(i);
      const Eigen::Vector3d top = rays.corner(line, place) + rays.corner(line, place + 1);
      const Eigen::Vector3d bottom =
          rays.corner(line + 1, place) + rays.corner(line + 1, place + 1);
      const Eigen::Vector2d ab = hit(top), cd = hit(bottom), middle = hit(top + bottom);
      const Eigen::Vector2d bc =
          hit(rays.corner(line, place + 1) + rays.corner(line + 1, place + 1));
      const Eigen::Vector2d da = hit(rays.corner(line, place) + rays.corner(line + 1, place));
      add(upper + 2 * i, compute_mean_over({a, ab, middle, da}, shape));
      add(upper + 2 * i + 1, compute_mean_over({ab, b, bc, middle}, shape));
      add(lower + 2 * i, compute_mean_over({da, middle, cd, d}, shape));
      add(lower + 2 * i + 1, compute_mean_over({middle, bc, c, cd}, shape));
    }
  }
}

}  // namespace vlp
