// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/valid_region.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <numeric>
#include <optional>
#include <utility>

#include "camera/spline_grid.h"
#include "geometry/polygon.h"

namespace vlp {
namespace {

/// Returns a positive value if c lies clockwise of the line from a to b in the image (y down).
double compute_side_of_line(const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                            const Eigen::Vector2d& c) {
  const Eigen::Vector2d u = b - a, v = c - a;
  return u.x() * v.y() - u.y() * v.x();
}

/// Computes the convex hull by Andrew's monotone chain (1979); empty if all points are on a line.
ImageRegion compute_convex_hull(std::vector<Eigen::Vector2d> points) {
  std::sort(points.begin(), points.end(), [](const auto& a, const auto& b) {
    return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
  });
  const auto chain = [](auto first, auto last) {
    ImageRegion part;
    for (; first != last; ++first) {
      while (part.size() > 1 &&
             compute_side_of_line(part[part.size() - 2], part.back(), *first) <= 0) {
        part.pop_back();
      }
      part.push_back(*first);
    }
    return part;
  };
  if (points.size() < 3) return {};
  ImageRegion hull = chain(points.begin(), points.end());
  const ImageRegion back = chain(points.rbegin(), points.rend());
  hull.pop_back();
  hull.insert(hull.end(), back.begin(), back.end() - 1);
  return hull.size() < 3 ? ImageRegion() : hull;
}

/// Returns the part of a polygon with sign * (x[axis] - limit) <= 0 (Sutherland and Hodgman, 1974).
ImageRegion clip_polygon(const ImageRegion& region, int axis, double limit, double sign) {
  ImageRegion clipped;
  for (std::size_t i = 0; i < region.size(); ++i) {
    const Eigen::Vector2d &from = region[i], &to = region[(i + 1) % region.size()];
    const double from_out = sign * (from[axis] - limit), to_out = sign * (to[axis] - limit);
    if (from_out <= 0) clipped.push_back(from);
    if ((from_out < 0 && to_out > 0) || (from_out > 0 && to_out < 0)) {
      Eigen::Vector2d crossing = from + (to - from) * (from_out / (from_out - to_out));
      crossing[axis] = limit;
      clipped.push_back(crossing);
    }
  }
  return clipped;
}

/// Returns points along the edges of a polygon, at most `spacing_px` apart, with its vertices.
ImageRegion subdivide_edges(const ImageRegion& region, double spacing_px) {
  ImageRegion points;
  for (std::size_t i = 0; i < region.size(); ++i) {
    const Eigen::Vector2d edge = region[(i + 1) % region.size()] - region[i];
    const int parts = std::max(1, static_cast<int>(std::ceil(edge.norm() / spacing_px)));
    for (int part = 0; part < parts; ++part) points.emplace_back(region[i] + edge * part / parts);
  }
  return points;
}

using HasRays = std::function<bool(const Eigen::Vector2d&)>;

/// Returns the last point with rays on the line from `inside`, which has them, to `outside`, less a
/// distance that keeps the edges between such points inside.
Eigen::Vector2d bisect_end_of_rays(const HasRays& has_rays, const Eigen::Vector2d& inside,
                                   const Eigen::Vector2d& outside) {
  constexpr double tolerance_px = 0.01, distance_px = 0.25;
  const Eigen::Vector2d line = outside - inside;
  const double length_px = line.norm();
  double with_rays = 0, without = 1;
  while ((without - with_rays) * length_px > tolerance_px) {
    const double middle = (with_rays + without) / 2;
    (has_rays(inside + middle * line) ? with_rays : without) = middle;
  }
  return inside + std::max(0.0, with_rays - distance_px / length_px) * line;
}

/// Returns the mean of the corners, or else the corner nearest to it that has rays; std::nullopt if
/// none has.
std::optional<Eigen::Vector2d> find_center(std::vector<Eigen::Vector2d> corners_px,
                                           const HasRays& has_rays) {
  const Eigen::Vector2d mean =
      std::accumulate(corners_px.begin(), corners_px.end(), Eigen::Vector2d(0, 0)) /
      static_cast<double>(corners_px.size());
  if (has_rays(mean)) return mean;
  std::erase_if(corners_px, [&](const auto& corner) { return !has_rays(corner); });
  if (corners_px.empty()) return {};
  return *std::ranges::min_element(
      corners_px, {}, [&](const auto& corner) { return (corner - mean).squaredNorm(); });
}

/// Returns the part of a region that has rays. Removes points on straight edges again.
ImageRegion clip_to_rays(const ImageRegion& region, const HasRays& has_rays,
                         const std::vector<Eigen::Vector2d>& corners_px, double spacing_px) {
  const ImageRegion points = subdivide_edges(region, spacing_px);
  std::vector<bool> has_ray;
  std::ranges::transform(points, std::back_inserter(has_ray), has_rays);
  if (std::ranges::find(has_ray, false) == has_ray.end()) return region;
  const auto inside = find_center(corners_px, has_rays);
  if (!inside) return {};
  ImageRegion clipped;
  const std::size_t count = points.size();
  for (std::size_t i = 0; i < count; ++i) {
    const bool is_vertex = std::ranges::find(region, points[i]) != region.end();
    const bool is_beside = !has_ray[(i + 1) % count] || !has_ray[(i + count - 1) % count];
    if (!has_ray[i]) {
      clipped.push_back(bisect_end_of_rays(has_rays, *inside, points[i]));
    } else if (is_vertex || is_beside) {
      clipped.push_back(points[i]);
    }
  }
  return clipped;
}

}  // namespace

ImageRegion make_valid_region(const std::vector<Eigen::Vector2d>& corners_px,
                              const std::array<int, 2>& imager_px, const Lens& lens,
                              std::span<const Lens> others) {
  constexpr double model_margin = 0.04, spacing = 0.02;
  const double margin = is_splined_lens_model(lens.lens_model()) ? 0 : model_margin;
  const Eigen::Vector2d last(imager_px[0] - 1, imager_px[1] - 1);
  const double margin_px = margin * last.norm();
  // Extends the hull by a square: near a corner of the image it reaches both edges.
  std::vector<Eigen::Vector2d> grown;
  for (const Eigen::Vector2d& corner : compute_convex_hull(corners_px)) {
    for (const double x : {-margin_px, margin_px}) {
      for (const double y : {-margin_px, margin_px})
        grown.emplace_back(corner + Eigen::Vector2d(x, y));
    }
  }
  ImageRegion region = compute_convex_hull(std::move(grown));
  for (const int axis : {0, 1}) {
    region = clip_polygon(region, axis, 0, -1);
    region = clip_polygon(region, axis, last[axis], 1);
  }
  constexpr double whole = 0.985;
  if (region.empty()) return region;
  if (compute_area_fraction(region, imager_px) >= whole)
    region = {{0, 0}, {last.x(), 0}, last, {0, last.y()}};
  const auto has_rays = [&](const Eigen::Vector2d& pixel) {
    return lens.unproject_pixel(pixel) && std::ranges::all_of(others, [&](const Lens& other) {
             return other.unproject_pixel(pixel).has_value();
           });
  };
  return clip_to_rays(region, has_rays, corners_px, spacing * last.norm());
}

double compute_area_fraction(const ImageRegion& region, const std::array<int, 2>& imager_px) {
  return compute_polygon_area(region) / ((imager_px[0] - 1.0) * (imager_px[1] - 1.0));
}

}  // namespace vlp
