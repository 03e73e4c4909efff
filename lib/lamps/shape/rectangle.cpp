// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/rectangle.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "geometry/angles.h"
#include "geometry/circle_fit.h"
#include "geometry/polygon.h"
#include "geometry/symmetric.h"
#include "lamps/shape/light_center_noise.h"
#include "lamps/shape/outline_fit.h"
#include "lamps/signal/stripes.h"

namespace vlp {
namespace {

using Corners = std::array<Eigen::Vector2d, 4>;

/// Side of a rectangle in the plane of LightShape, from one corner to the next; the light is on its
/// left.
struct Side {
  Eigen::Vector2d from, to;

  Eigen::Vector2d edge_direction() const { return (to - from).normalized(); }
  Eigen::Vector2d inward_normal() const {
    const Eigen::Vector2d along = edge_direction();
    return {-along.y(), along.x()};
  }
};
using Sides = std::array<Side, 4>;

double cross_product(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

std::optional<Eigen::Vector2d> find_intersection(const Side& a, const Side& b) {
  constexpr double flattest = 0.05;
  const Eigen::Vector2d along = a.edge_direction(), other = b.edge_direction();
  const double sine = cross_product(along, other);
  if (!(std::abs(sine) > flattest)) return std::nullopt;
  return a.from + cross_product(b.from - a.from, other) / sine * along;
}

Sides make_sides(const Corners& corners) {
  return {Side{corners[0], corners[1]},
          {corners[1], corners[2]},
          {corners[2], corners[3]},
          {corners[3], corners[0]}};
}

/// Returns the corners; corner i is the begin of side i. Returns std::nullopt if neighboring sides
/// are nearly parallel.
std::optional<Corners> find_corners(const Sides& sides) {
  Corners corners;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto corner = find_intersection(sides[(i + 3) % 4], sides[i]);
    if (!corner) return std::nullopt;
    corners[i] = *corner;
  }
  return corners;
}

/// Returns true if all angles are right angles within 20 degrees.
bool is_rectangular(const Sides& sides) {
  const double max_off = std::sin(rad_from_deg(20));
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d direction = sides[i].edge_direction(),
                          next = sides[(i + 1) % 4].edge_direction();
    if (!(std::abs(direction.dot(next)) < max_off && cross_product(direction, next) > 0))
      return false;
  }
  return true;
}

/// Returns the ratio of the long to the short side.
double compute_aspect(const Sides& sides) {
  const auto length = [&](std::size_t i) { return (sides[i].to - sides[i].from).norm(); };
  const double ratio = (length(0) + length(2)) / (length(1) + length(3));
  return std::max(ratio, 1 / ratio);
}

/// Computes the minimum-area rectangle around the points, with the light on the left of its sides:
/// tries directions 3 degrees apart, and then halves this step.
Corners fit_min_rectangle(const std::vector<Eigen::Vector2d>& points) {
  constexpr double coarse_rad = rad_from_deg(3), fine_rad = 1e-4;
  const auto box_at = [&](double angle_rad) {
    const Eigen::Rotation2Dd turn(-angle_rad);
    Eigen::AlignedBox2d box;
    for (const Eigen::Vector2d& point : points) box.extend(turn * point);
    return box;
  };
  double best_rad = 0, min_area = std::numeric_limits<double>::infinity();
  const auto improve = [&](double angle_rad) {
    const double area = box_at(angle_rad).volume();
    if (area < min_area) min_area = area, best_rad = angle_rad;
  };
  for (double angle_rad = 0; angle_rad < std::numbers::pi / 2; angle_rad += coarse_rad) {
    improve(angle_rad);
  }
  for (double step_rad = coarse_rad / 2; step_rad > fine_rad; step_rad /= 2) {
    const double middle_rad = best_rad;
    improve(middle_rad - step_rad);
    improve(middle_rad + step_rad);
  }
  const Eigen::AlignedBox2d box = box_at(best_rad);
  const Eigen::Rotation2Dd turn(best_rad);
  return {turn * box.corner(box.BottomLeft), turn * box.corner(box.BottomRight),
          turn * box.corner(box.TopRight), turn * box.corner(box.TopLeft)};
}

double distance_outside_px(const Side& side, const Eigen::Vector2d& point) {
  return std::abs((point - side.from).dot(side.inward_normal()));
}

std::size_t get_nearest_side(const Sides& sides, const Eigen::Vector2d& point) {
  const auto closer = [&](const Side& a, const Side& b) {
    return distance_outside_px(a, point) < distance_outside_px(b, point);
  };
  return static_cast<std::size_t>(std::min_element(sides.begin(), sides.end(), closer) -
                                  sides.begin());
}

/// Fits each side to the points next to it. A side along the scanlines has too few points and is
/// unchanged.
Sides fit_sides(const std::vector<Eigen::Vector2d>& points, Sides sides, double within) {
  constexpr std::size_t min_points = 6;
  constexpr double min_spread = 0.25;
  const Sides before = sides;
  std::array<std::vector<Eigen::Vector2d>, 4> side_points;
  for (const Eigen::Vector2d& point : points) {
    const std::size_t i = get_nearest_side(before, point);
    if (distance_outside_px(before[i], point) < within) side_points[i].push_back(point);
  }
  for (std::size_t i = 0; i < 4; ++i) {
    if (side_points[i].size() < min_points) continue;
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& point : side_points[i])
      mean += point / double(side_points[i].size());
    Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
    for (const Eigen::Vector2d& point : side_points[i]) {
      spread += (point - mean) * (point - mean).transpose();
    }
    const auto axes = eigendecompose(spread);
    Eigen::Vector2d direction = axes.vectors.col(1);
    const double length = std::sqrt(axes.values[1] / double(side_points[i].size()) * 12);
    if (length < min_spread * (sides[i].to - sides[i].from).norm()) continue;
    if (direction.dot(before[i].edge_direction()) < 0) direction = -direction;
    sides[i] = {mean - direction * length / 2, mean + direction * length / 2};
  }
  return sides;
}

/// Corners of a rectangle from its outline, before its edges are fitted, and the fraction of the
/// points next to its sides.
struct FirstCorners {
  Corners corners;
  double near;
};

std::optional<FirstCorners> find_first_corners(const std::vector<Eigen::Vector2d>& points,
                                               double per_px) {
  constexpr double near_px = 2, min_fraction = 0.7;
  constexpr double coarse_fraction = 0.08;
  Corners corners = fit_min_rectangle(points);
  const double size = std::min((corners[1] - corners[0]).norm(), (corners[2] - corners[1]).norm());
  double within = std::max(4 * per_px, coarse_fraction * size);
  for (int iteration = 0; iteration < 3; ++iteration) {
    const auto better = find_corners(fit_sides(points, make_sides(corners), within));
    if (!better) return std::nullopt;
    corners = *better;
    within = std::max(within / 2, near_px * per_px);
  }
  const Sides sides = make_sides(corners);
  if (!is_rectangular(sides)) return std::nullopt;
  const auto near = std::count_if(points.begin(), points.end(), [&](const Eigen::Vector2d& point) {
    return distance_outside_px(sides[get_nearest_side(sides, point)], point) < near_px * per_px;
  });
  if (double(near) < min_fraction * double(points.size())) return std::nullopt;
  return FirstCorners{corners, double(near) / double(points.size())};
}

/// Returns the corners of a slender rectangle whose sides an unknown lens curves. Tries many
/// curvatures, straightens the points by each of them, which does not change the ends, and selects
/// the best corners.
std::optional<FirstCorners> find_curved_corners(const std::vector<Eigen::Vector2d>& points) {
  constexpr double max_px = 6, step_px = 0.5, min_aspect = 3;
  const Sides around = make_sides(fit_min_rectangle(points));
  if (compute_aspect(around) < min_aspect) return std::nullopt;
  const bool first =
      (around[0].to - around[0].from).norm() > (around[1].to - around[1].from).norm();
  const Side& side = around[first ? 0 : 1];
  const double length = (side.to - side.from).norm();
  std::optional<FirstCorners> best;
  std::vector<Eigen::Vector2d> straight = points;
  for (double sagitta_px = -max_px; sagitta_px <= max_px; sagitta_px += step_px) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double along = 2 * (points[i] - side.from).dot(side.edge_direction()) / length - 1;
      straight[i] = points[i] - sagitta_px * (1 - along * along) * side.inward_normal();
    }
    const auto corners = find_first_corners(straight, 1);
    if (corners && (!best || corners->near > best->near)) best = corners;
  }
  return best;
}

/// Returns true if the outline extends into the corners, unlike that of a disc: the squared
/// distance from the center is 1 on an ellipse inside the sides, and up to 2 on the sides.
bool has_corner_points(const std::vector<Eigen::Vector2d>& points,
                       const PlaneRectangle& rectangle) {
  constexpr double beyond = 1.35, min_fraction = 0.1;
  const auto far = std::ranges::count_if(points, [&](const Eigen::Vector2d& at) {
    return rectangle.unit_from_plane_point(at).squaredNorm() > beyond;
  });
  return double(far) >= min_fraction * double(points.size());
}

/// Returns half of the sides, in pixels.
Eigen::Vector2d compute_half_sides_px(const PlaneRectangle& rectangle, double per_px) {
  return (per_px * rectangle.unit_from_plane.rowwise().norm()).cwiseInverse();
}

/// Returns the polygon at the depth `inset_px` inside the sides, (u, v); empty if the lens does not
/// cover it.
std::vector<Eigen::Vector2d> make_polygon(const PlaneRectangle& rectangle, double inset_px,
                                          double per_px, const LightShape& shape) {
  constexpr int pieces = 8;
  constexpr std::array<std::array<int, 2>, 5> corners = {
      {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}, {-1, -1}}};
  const Eigen::Array2d half_px = compute_half_sides_px(rectangle, per_px);
  if (!(half_px.minCoeff() > inset_px)) return {};
  std::vector<Eigen::Vector2d> face;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Array2d from(corners[i][0], corners[i][1]),
        to(corners[i + 1][0], corners[i + 1][1]);
    for (int piece = 0; piece < pieces; ++piece) {
      const Eigen::Vector2d at = (from + (to - from) * piece / pieces) * (1 - inset_px / half_px);
      const auto pixel = shape.pixel_from_plane(rectangle.plane_point_from_unit(at));
      if (!pixel) return {};
      face.push_back(*pixel);
    }
  }
  return face;
}

/// Returns the largest standard deviation of the distance of a side, in pixels.
double compute_side_sd_px(const RectangleFit& fit, const Eigen::Vector2d& half_px) {
  double variance_px2 = 0;
  for (const int side : {0, 1}) {
    const Eigen::Vector2d normal = fit.outline.unit_from_plane.row(side).normalized();
    const double growth = half_px[side] / fit.radius_px;
    const Eigen::Vector4d slope(normal.x(), normal.y(), growth, side == 0 ? growth : -growth);
    variance_px2 =
        std::max(variance_px2, slope.dot(fit.covariance_px.topLeftCorner<4, 4>() * slope));
  }
  return std::sqrt(variance_px2);
}

/// Makes a light of a fitted rectangle; `points` are the outline in the plane. Returns std::nullopt
/// if the points contradict it.
std::optional<MeasuredLight> make_light(const RectangleFit& fit, double per_px,
                                        const std::vector<Eigen::Vector2d>& points,
                                        const LightShape& shape) {
  constexpr double outlier_px = 3, max_outside = 0.25, blur_sd_fraction = 0.25;
  const PlaneRectangle& rectangle = fit.outline;
  if (!has_corner_points(points, rectangle)) return std::nullopt;
  const Eigen::Vector2d half_px = compute_half_sides_px(rectangle, per_px);
  const auto outliers = std::ranges::count_if(points, [&](const Eigen::Vector2d& at) {
    const Eigen::Vector2d u = rectangle.unit_from_plane_point(at);
    return ((u.array().abs() - 1) * half_px.array()).maxCoeff() > outlier_px;
  });
  if (double(outliers) > max_outside * double(points.size())) return std::nullopt;
  const auto pixel =
      shape.pixel_from_plane(rectangle.plane_point_from_unit(Eigen::Vector2d::Zero()));
  const auto sigma_px = limit_center_sd(fit.center_sd_px);
  MeasuredLight light{};
  light.outline = make_polygon(rectangle, 0, per_px, shape);
  light.inner_polygon = make_polygon(rectangle, outlier_px, per_px, shape);
  if (!pixel || !sigma_px || light.outline.empty() || light.inner_polygon.empty())
    return std::nullopt;
  light.outline_kind = LightOutline::rectangle;
  light.pixel = *pixel;
  light.sigma_px = *sigma_px;
  light.box = Eigen::AlignedBox2d(*pixel);
  for (const Eigen::Vector2d& at : light.outline) light.box.extend(at);
  const double side_sd_px = compute_side_sd_px(fit, half_px);
  light.box.min().array() -= 2 * side_sd_px;
  light.box.max().array() += 2 * side_sd_px;
  light.radius_px = std::sqrt(compute_polygon_area(light.outline) / std::numbers::pi);
  light.rise_px = kRisePerBlur * fit.blur_px;
  light.inlier_fraction = fit.inlier_fraction;
  const double aspect = rectangle.aspect();
  light.aspect = std::max(aspect, 1 / aspect);
  // Elongation is half of the log aspect ratio.
  light.aspect_sd = std::hypot(
      2 * std::sqrt(fit.covariance_px(3, 3)) / fit.radius_px,
      blur_sd_fraction * fit.blur_px / std::numbers::sqrt2 * half_px.cwiseInverse().norm());
  return light;
}

/// Outline of a light in the plane of LightShape, and the size of a pixel there.
struct PlaneOutline {
  std::vector<Eigen::Vector2d> points;
  double per_px;
};

/// Returns std::nullopt if the plane does not cover a point of the outline.
std::optional<PlaneOutline> project_outline(const std::vector<Eigen::Vector2d>& outline,
                                            const LightShape& shape) {
  PlaneOutline result;
  result.points.reserve(outline.size());
  Eigen::AlignedBox2d in_plane, in_image;
  for (const Eigen::Vector2d& pixel : outline) {
    const auto point = shape.plane_from_pixel(shape.swap_axes(pixel));
    if (!point) return std::nullopt;
    result.points.push_back(*point);
    in_plane.extend(*point);
    in_image.extend(pixel);
  }
  result.per_px = in_plane.diagonal().norm() / in_image.diagonal().norm();
  return result;
}

/// Finds the corners from which the edges are searched. Without a lens the sides may be curved.
std::optional<FirstCorners> find_initial_corners(const PlaneOutline& outline, bool has_known_lens) {
  auto first = find_first_corners(outline.points, outline.per_px);
  if (has_known_lens) return first;
  const auto curved = find_curved_corners(outline.points);
  if (curved && (!first || curved->near > first->near)) first = curved;
  return first;
}

}  // namespace

std::vector<PixelRun> list_chords_in_polygon(const std::vector<Eigen::Vector2d>& polygon,
                                             const ImageSize& size) {
  constexpr int min_px = 2;
  double top = size.height, bottom = -1;
  for (const Eigen::Vector2d& point : polygon) {
    top = std::min(top, point.y());
    bottom = std::max(bottom, point.y());
  }
  std::vector<PixelRun> chords;
  const int first = std::max(0, static_cast<int>(std::ceil(top)));
  const int last = std::min(size.height - 1, static_cast<int>(std::floor(bottom)));
  for (int row = first; row <= last; ++row) {
    double left = size.width, right = -1;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Eigen::Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
      if ((a.y() - row) * (b.y() - row) > 0 || a.y() == b.y()) continue;
      const double at = a.x() + (row - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
      left = std::min(left, at);
      right = std::max(right, at);
    }
    const int begin = std::max(0, static_cast<int>(std::ceil(left)));
    const int end = std::min(size.width, static_cast<int>(std::floor(right)) + 1);
    if (end - begin >= min_px) chords.push_back({row, begin, end});
  }
  return chords;
}

std::optional<MeasuredLight> fit_rectangular_light(const ImageView& lines, const Blob& blob,
                                                   const std::vector<Eigen::Vector2d>& outline,
                                                   double period_lines,
                                                   const Background& background,
                                                   const LightShape& shape,
                                                   const std::vector<Eigen::Vector2d>& sizes_m) {
  constexpr double min_px = 6, max_aspect = 40, start_blur_px = 1.5, inset_px = 2;
  constexpr std::size_t min_points = 10;
  const PixelBox box = blob.blob_bounding_box();
  if (outline.size() < min_points || std::min(box.width, box.height) < min_px) return {};
  const auto in_plane = project_outline(outline, shape);
  if (!in_plane) return std::nullopt;
  const double per_px = in_plane->per_px;
  const auto first = find_initial_corners(*in_plane, shape.has_known_lens());
  if (!first) return std::nullopt;
  const Corners& corners = first->corners;
  Matrix2 half_sides;
  half_sides << (corners[1] - corners[0]) / 2, (corners[3] - corners[0]) / 2;
  const PlaneEllipse start{(corners[0] + corners[1] + corners[2] + corners[3]) / 4,
                           half_sides.inverse()};
  const auto chords = list_chords_in_polygon(
      shape.swap_axes(make_polygon(PlaneRectangle{start}, inset_px, per_px, shape)), lines.size());
  const Stripes stripes =
      measure_stripes(compute_scanline_signal(lines, chords, background.level, false));
  if (stripes.contrast >= kMinContrast) period_lines = stripes.period_lines;
  const auto fit =
      fit_rectangle_outline(lines, start, start_blur_px, period_lines, background, shape, sizes_m);
  if (!fit || 2 * compute_half_sides_px(fit->outline, per_px).minCoeff() < min_px ||
      std::max(fit->outline.aspect(), 1 / fit->outline.aspect()) > max_aspect) {
    return std::nullopt;
  }
  return make_light(*fit, per_px, in_plane->points, shape);
}

}  // namespace vlp
