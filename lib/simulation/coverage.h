// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <opencv2/core.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "simulation/pixel_window.h"

namespace vlp {

/// Pose of the camera in the frame of a rendered target while a line is exposed.
using TargetFromCamera = std::function<Eigen::Isometry3d(int line)>;

/// Returns the point (x, y) at which a ray meets the plane z = 0 of the target's frame, in the unit
/// of `origin`. NaN if the ray does not meet the plane in its direction.
inline Eigen::Vector2d intersect_plane(const Eigen::Vector3d& origin,
                                       const Eigen::Vector3d& direction) {
  const double distance = -origin.z() / direction.z();
  if (!(distance > 0)) return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  return origin.head<2>() + distance * direction.head<2>();
}

inline double cross_product_2d(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// Returns the value of a pattern if it is constant over a block of elements; 0 if none of nine
/// rays through the block meets the target; otherwise std::nullopt.
///
/// The block's image on the pattern is bounded by the box around nine points. The box is enlarged
/// by twice the largest second differences along rows and columns. A smooth curve deviates from the
/// chords between adjacent points by 1/8 of its second difference.
///
/// @param rows  three rows of three points of the block on the pattern: its corners, the middles of
///              its edges, its center
/// @pre the points vary smoothly over the block, also with the motion of the camera; the pattern is
///      0 at the horizon of its plane
template <typename Shape>
std::optional<double> find_uniform_value_in_block(
    const Shape& shape, const std::array<const Eigen::Vector2d*, 3>& rows) {
  Eigen::Array2d lower = rows[0][0].array(), upper = lower, sum(0, 0);
  int num_nan = 0;
  Eigen::Array2d along_row(0, 0), along_column(0, 0);  // second differences
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      lower = lower.min(rows[i][j].array());
      upper = upper.max(rows[i][j].array());
      sum += rows[i][j].array();
      num_nan += rows[i][j].hasNaN() ? 1 : 0;
    }
    along_row = along_row.max((rows[i][0] - 2 * rows[i][1] + rows[i][2]).array().abs());
    along_column = along_column.max((rows[0][i] - 2 * rows[1][i] + rows[2][i]).array().abs());
  }
  if (num_nan == 9) return 0;
  if (!sum.isFinite().all()) return std::nullopt;
  const Eigen::Array2d margin = 2 * (along_row + along_column);
  const Eigen::Vector2d box_min = lower - margin, box_max = upper + margin;
  return shape.find_uniform_value({box_min, Eigen::Vector2d(box_max.x(), box_min.y()), box_max,
                                   Eigen::Vector2d(box_min.x(), box_max.y())});
}

/// Elements of a window, projected onto a target; see add_shape_to_image().
template <typename Shape>
class ElementGrid {
 public:
  ElementGrid(const PixelRays& rays, const PixelWindow& window,
              const TargetFromCamera& target_from_camera, const Shape& shape, int per_px,
              const cv::Size& size)
      : rays_(rays), window_(window), shape_(shape), per_px_(per_px), size_(size) {
    poses_.reserve(static_cast<std::size_t>(size.height));
    for (int row = 0; row < size.height; ++row) {
      poses_.push_back(target_from_camera(window.line_begin + row / per_px));
    }
    above_.resize(static_cast<std::size_t>(size.width) + 1);
    below_ = above_;
  }

  /// Adds `weight` times the mean of the pattern to each element of `image`.
  void add_pattern(double weight, cv::Mat1f& image) {
    for (int first_row = 0; first_row < size_.height; first_row += kBlockSize) {
      const int end_row = std::min(first_row + kBlockSize, size_.height);
      const std::vector<cv::Range> varying_columns =
          end_row - first_row == kBlockSize ? fill_uniform_blocks(first_row, weight, image)
                                            : std::vector<cv::Range>{{0, size_.width}};
      for (int row = first_row; row < end_row; ++row) {
        // Rows seen from one pose share their corners: all rows unless camera or target moves.
        if (row > first_row && pose(row).matrix() == pose(row - 1).matrix()) {
          std::swap(above_, below_);
        } else {
          intersect_corners(row, row, varying_columns, above_);
        }
        intersect_corners(row, row + 1, varying_columns, below_);
        for (const cv::Range& columns : varying_columns) {
          add_elements(columns, weight, image.ptr<float>(row));
        }
      }
    }
  }

 private:
  /// Width and height of the blocks of elements that are tested for a constant value.
  static constexpr int kBlockSize = 16;

  struct Edge {
    double integral, area;
  };

  const Eigen::Isometry3d& pose(int row) const { return poses_[static_cast<std::size_t>(row)]; }

  /// Returns the ray through a corner of elements in the camera frame, not normalized: the sum of
  /// the rays of four pixel corners.
  Eigen::Vector3d corner_ray(int row, int column) const {
    const int line = window_.line_begin + row / per_px_,
              place = window_.place_begin + column / per_px_;
    const int next_line = line + row % per_px_, next_place = place + column % per_px_;
    return rays_.pixel_corner_ray(line, place) + rays_.pixel_corner_ray(line, next_place) +
           rays_.pixel_corner_ray(next_line, place) + rays_.pixel_corner_ray(next_line, next_place);
  }

  /// Returns the point of the target on the ray through a corner of elements, for the camera pose
  /// of `row`.
  Eigen::Vector2d intersect_corner(int row, int corner_row, int corner_column) const {
    return shape_.intersect(pose(row).translation(),
                            pose(row).linear() * corner_ray(corner_row, corner_column));
  }

  /// Computes the points of the target at the corners of a range of columns, for the camera pose of
  /// `row`.
  void intersect_corners(int row, int corner_row, const std::vector<cv::Range>& ranges,
                         std::vector<Eigen::Vector2d>& points) const {
    for (const cv::Range& columns : ranges) {
      for (int column = columns.start; column <= columns.end; ++column) {
        points[static_cast<std::size_t>(column)] = intersect_corner(row, corner_row, column);
      }
    }
  }

  /// Fills the blocks below `first_row` over which the pattern is constant. Returns the columns in
  /// which it varies.
  std::vector<cv::Range> fill_uniform_blocks(int first_row, double weight, cv::Mat1f& image) const {
    const int num_blocks = size_.width / kBlockSize;
    std::array<std::vector<Eigen::Vector2d>, 3> points;
    for (int i = 0; i < 3; ++i) {
      const int corner_row = first_row + i * kBlockSize / 2;
      std::vector<Eigen::Vector2d>& row_points = points[static_cast<std::size_t>(i)];
      row_points.reserve(static_cast<std::size_t>(2 * num_blocks + 1));
      for (int j = 0; j <= 2 * num_blocks; ++j) {
        row_points.push_back(intersect_corner(std::min(corner_row, first_row + kBlockSize - 1),
                                              corner_row, j * kBlockSize / 2));
      }
    }
    std::vector<cv::Range> varying_columns;
    const auto append_varying_columns = [&](int begin, int end) {
      if (!varying_columns.empty() && varying_columns.back().end == begin) {
        varying_columns.back().end = end;
      } else if (begin < end) {
        varying_columns.emplace_back(begin, end);
      }
    };
    for (int block = 0; block < num_blocks; ++block) {
      const int column = block * kBlockSize;
      const auto block_points = [&](std::size_t i) { return points[i].data() + 2 * block; };
      if (const auto value = find_uniform_value_in_block(
              shape_, {block_points(0), block_points(1), block_points(2)})) {
        image(cv::Rect(column, first_row, kBlockSize, kBlockSize)) += weight * *value;
      } else {
        append_varying_columns(column, column + kBlockSize);
      }
    }
    append_varying_columns(num_blocks * kBlockSize, size_.width);
    return varying_columns;
  }

  /// Returns the contributions of an edge to the integral of the pattern and to the area, by
  /// Green's theorem.
  Edge integrate_edge(const Eigen::Vector2d& p, const Eigen::Vector2d& q) const {
    return {shape_.integrate_edge(p, q), cross_product_2d(p, q) / 2};
  }

  /// Adds the pattern to elements of a row, whose corners are in above_ and below_.
  void add_elements(const cv::Range& columns, double weight, float* row) const {
    Edge left{};
    bool is_left_known = false;
    for (int column = columns.start; column < columns.end; ++column) {
      const auto i = static_cast<std::size_t>(column);
      if (const auto value =
              shape_.find_uniform_value({above_[i], above_[i + 1], below_[i + 1], below_[i]})) {
        row[i] += static_cast<float>(weight * *value);
        is_left_known = false;
        continue;
      }
      if (!is_left_known) left = integrate_edge(below_[i], above_[i]);
      const Edge top = integrate_edge(above_[i], above_[i + 1]);
      const Edge right = integrate_edge(below_[i + 1], above_[i + 1]);
      const Edge bottom = integrate_edge(below_[i], below_[i + 1]);
      const double area = left.area + top.area - right.area - bottom.area;
      const double mean = (left.integral + top.integral - right.integral - bottom.integral) / area;
      if (std::isfinite(mean)) row[i] += static_cast<float>(weight * mean);
      left = right;
      is_left_known = true;
    }
  }

  const PixelRays& rays_;
  const PixelWindow& window_;
  const Shape& shape_;
  int per_px_;
  cv::Size size_;
  /// Pose of the camera for each row.
  std::vector<Eigen::Isometry3d> poses_;
  /// Points of the target at the corners above and below the current row.
  std::vector<Eigen::Vector2d> above_, below_;
};

/// Adds to each element of the window, which is all of `image`, `weight` times the mean of a flat
/// pattern g over the element: a pixel or, with `per_px` 2, a quarter of one.
///
/// The mean is exact for the element's image on the pattern, a quadrilateral Q. By Green's theorem
/// the integral of g over Q is the sum of shape.integrate_edge(p, q)
/// over its edges. An edge integral is the integral along the edge of any G(x, y) that Green's
/// theorem turns into g.
///
/// Reason for quarters of pixels: a lens blurs the light before pixels integrate it. Blurring pixel
/// means instead would displace an edge by 0.01 px. Rays within a pixel are interpolated linearly
/// between those of its corners.
///
/// A shape has intersect(origin, direction) in its frame and
/// integrate_edge(p, q). Its
/// find_uniform_value(corners) returns the value of the pattern if it is constant
/// over the quadrilateral, which may be larger than an element; otherwise std::nullopt. Blocks of
/// 16 x 16 elements with a constant value are filled at once.
template <typename Shape>
void add_shape_to_image(const PixelRays& rays, const PixelWindow& window,
                        const TargetFromCamera& target_from_camera, const Shape& shape,
                        double weight, cv::Mat1f& image, int per_px = 1) {
  ElementGrid(rays, window, target_from_camera, shape, per_px, image.size())
      .add_pattern(weight, image);
}

}  // namespace vlp
