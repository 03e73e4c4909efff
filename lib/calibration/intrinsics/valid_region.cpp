// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/valid_region.h"

#include <algorithm>

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

}  // namespace

ImageRegion compute_valid_lens_region(const std::vector<Eigen::Vector2d>& corners_px,
                                      const std::array<int, 2>& imager_px, LensModel model,
                                      bool other_model_fits) {
  const double margin = is_splined_lens_model(model) || other_model_fits ? 0 : 0.04;
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
  if (compute_region_fraction_of_image_area(region, imager_px) < whole) return region;
  return {{0, 0}, {last.x(), 0}, last, {0, last.y()}};
}

double compute_region_fraction_of_image_area(const ImageRegion& region,
                                             const std::array<int, 2>& imager_px) {
  return compute_polygon_area(region) / ((imager_px[0] - 1.0) * (imager_px[1] - 1.0));
}

}  // namespace vlp
