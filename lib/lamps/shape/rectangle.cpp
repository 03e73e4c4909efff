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
#include "lamps/shape/straight_edge.h"

namespace vlp {
namespace {

using Corners = std::array<Eigen::Vector2d, 4>;
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

std::optional<Eigen::Vector2d> find_center(const Sides& sides) {
  const auto corners = find_corners(sides);
  if (!corners) return std::nullopt;
  return find_intersection({(*corners)[0], (*corners)[2]}, {(*corners)[1], (*corners)[3]});
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

double square(double value) { return value * value; }

/// Returns the standard deviation of the angles and of the log aspect ratio in the plane: a
/// calibrated tilt is accurate to some tenths of a degree. Every given tilt counts as calibrated,
/// and an identity rotation as an unknown tilt.
double get_tilt_sd(const LightShape& shape) {
  return shape.is_camera_tilted() ? kUnknownTiltSd / 30 : kUnknownTiltSd;
}

/// Returns the variance of the distance of an edge's middle, in square pixels.
double compute_middle_variance(const StraightEdge& edge) { return edge.covariance_px.sum() / 4; }

/// Returns the distance of the middle of side `to` from side `from`.
double compute_distance_from_line(const Side& from, const Side& to) {
  return std::abs(((to.from + to.to) / 2 - (from.from + from.to) / 2).dot(from.inward_normal()));
}

/// Returns the standard deviation of the logarithm of compute_aspect().
double compute_aspect_sd(const std::array<StraightEdge, 4>& edges, double per_px) {
  constexpr double blur_sd_fraction = 0.25;
  double variance = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const StraightEdge &edge = edges[i], &opposite = edges[(i + 2) % 4];
    const double apart_px = compute_distance_from_line(edge.side, opposite.side) / per_px;
    variance += (compute_middle_variance(edge) + square(blur_sd_fraction * edge.profile.blur_px)) /
                square(apart_px);
  }
  return std::sqrt(variance);
}

/// Computes the minimum-area rectangle around the points, with the light on the left of its sides:
/// tries directions 3 degrees apart, and then halves this step.
Corners fit_min_area_rectangle(const std::vector<Eigen::Vector2d>& points) {
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

std::size_t find_nearest_side(const Sides& sides, const Eigen::Vector2d& point) {
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
    const std::size_t i = find_nearest_side(before, point);
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
    const auto axes = eigendecompose_symmetric_matrix(spread);
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
  Corners corners = fit_min_area_rectangle(points);
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
    return distance_outside_px(sides[find_nearest_side(sides, point)], point) < near_px * per_px;
  });
  if (double(near) < min_fraction * double(points.size())) return std::nullopt;
  return FirstCorners{corners, double(near) / double(points.size())};
}

/// Returns the corners of a slender rectangle whose sides an unknown lens curves. Tries many
/// curvatures, straightens the points by each of them, which does not change the ends, and selects
/// the best corners.
std::optional<FirstCorners> find_corners_of_curved_sides(
    const std::vector<Eigen::Vector2d>& points) {
  constexpr double max_px = 6, step_px = 0.5, min_aspect = 3;
  const Sides around = make_sides(fit_min_area_rectangle(points));
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

/// Offset of the image of the center from the intersection of the diagonals under an unknown lens,
/// and its standard deviation.
///
/// The lens model is p (1 + k |p|^2), p relative to the image center. To first order of k an edge
/// of half-length h at the position p is curved by -k h^2 p . n across it. The diagonals intersect
/// k (a^2 + b^2) p from the center, with a and b half of the sides. The prior of k has the standard
/// deviation of an equidistant lens of 115 degrees from corner to corner.
struct CenterOffset {
  Eigen::Vector2d shift;
  double sd_px;
};

CenterOffset estimate_center_offset(const std::array<StraightEdge, 4>& edges,
                                    const Eigen::Vector2d& center, const Eigen::Vector2d& middle) {
  constexpr double curvature_sd_ratio = 2,
                   higher_order_ratio = 0.1;  // ratio to that of the ends; higher orders
  const double focal_px = middle.norm(), known_sd = 1 / (3 * focal_px * focal_px);
  double information = 1 / (known_sd * known_sd), moment = 0;
  Eigen::Vector2d d_shift_d_k = Eigen::Vector2d::Zero();
  for (const StraightEdge& edge : edges) {
    const Eigen::Vector2d direction = edge.side.to - edge.side.from, in = edge.side.inward_normal();
    const double half_square = direction.squaredNorm() / 4;
    const Eigen::Vector2d at = (edge.side.from + edge.side.to) / 2 - middle;
    const double slope = -half_square * at.dot(in);
    const double variance =
        curvature_sd_ratio * curvature_sd_ratio * edge.covariance_px.trace() / 2;
    information += slope * slope / variance;
    moment += slope * edge.sagitta_px / variance;
    d_shift_d_k -= half_square / 2 * (center - middle);
  }
  const double k = moment / information;
  const double sd_px =
      std::hypot(1 / std::sqrt(information), higher_order_ratio * k) * d_shift_d_k.norm();
  return {k * d_shift_d_k, sd_px / std::numbers::sqrt2};
}

/// Returns the polygon at the depth `inset` inside the sides, (u, v); empty if the lens does not
/// cover it.
std::vector<Eigen::Vector2d> make_polygon(const Sides& sides, double inset,
                                          const LightShape& shape) {
  constexpr int pieces = 8;
  Sides inside = sides;
  for (Side& side : inside) {
    const Eigen::Vector2d in = inset * side.inward_normal();
    side.from += in;
    side.to += in;
  }
  const auto corners = find_corners(inside);
  std::vector<Eigen::Vector2d> face;
  if (!corners) return face;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d &from = (*corners)[i], &to = (*corners)[(i + 1) % 4];
    for (int piece = 0; piece < pieces; ++piece) {
      const auto pixel = shape.pixel_from_level_plane_point(from + (to - from) * piece / pieces);
      if (!pixel) return {};
      face.push_back(*pixel);
    }
  }
  return face;
}

/// Covariance of the distances of the ends from the edges: from and to of edge 0, from and to of
/// edge 1, and so on.
using EndsCovariance = Eigen::Matrix<double, 8, 8>;

/// Returns the covariance of the two ends of an edge.
auto get_block(EndsCovariance& ends, std::size_t edge) {
  return ends.block<2, 2>(2 * Eigen::Index(edge), 2 * Eigen::Index(edge));
}

/// Moves the sides to the most probable rectangle, and updates the covariance (Kalman's update). A
/// tilt error makes opposite sides converge by its product with their distance, in the plane at
/// height 1, and changes right angles by get_tilt_sd(). Makes no correction if the angles
/// contradict, because an object may hide a part.
void apply_right_angles(const LightShape& shape, double per_px, Sides& sides,
                        EndsCovariance& covariance) {
  constexpr double clear = 16;      // chi-square of three angles: one in a thousand
  constexpr double per_lean = 1.5;  // tilt error in rad over get_tilt_sd()
  constexpr std::array<std::array<std::size_t, 2>, 3> pairs = {{{0, 2}, {1, 3}, {0, 1}}};
  Eigen::Matrix<double, 3, 8> slope = Eigen::Matrix<double, 3, 8>::Zero();
  Eigen::Vector3d angles, sds;
  for (int i = 0; i < 3; ++i) {
    const auto [a, b] = pairs[std::size_t(i)];
    const Side &side = sides[a], &other = sides[b];
    const bool opposite = b - a == 2;
    const Eigen::Vector2d expected = opposite ? -side.edge_direction() : side.inward_normal();
    angles[i] = std::atan2(cross_product(expected, other.edge_direction()),
                           expected.dot(other.edge_direction()));
    sds[i] =
        get_tilt_sd(shape) * (opposite ? per_lean * compute_distance_from_line(side, other) : 1);
    const double length_px = (side.to - side.from).norm() / per_px;
    const double other_px = (other.to - other.from).norm() / per_px;
    slope.block<1, 2>(i, 2 * Eigen::Index(a)) << 1 / length_px, -1 / length_px;
    slope.block<1, 2>(i, 2 * Eigen::Index(b)) << -1 / other_px, 1 / other_px;
  }
  Eigen::Matrix3d spread = slope * covariance * slope.transpose();
  spread.diagonal() += sds.cwiseAbs2();
  const Eigen::LDLT<Eigen::Matrix3d> factor(spread);
  if (!(angles.dot(factor.solve(angles)) < clear)) return;
  const Eigen::Matrix<double, 8, 3> gain = factor.solve(slope * covariance).transpose();
  const Eigen::Matrix<double, 8, 1> moved_px = -gain * angles;
  covariance -= gain * slope * covariance;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d inwards = sides[i].inward_normal() * per_px;
    sides[i].from += moved_px[2 * Eigen::Index(i)] * inwards;
    sides[i].to += moved_px[2 * Eigen::Index(i) + 1] * inwards;
  }
}

/// Computes the covariance of the image of the center, in square pixels, from that of the ends.
std::optional<Matrix2> center_covariance(const Sides& sides, const EndsCovariance& ends,
                                         double per_px, const LightShape& shape) {
  constexpr double moved_px = 0.05;
  const auto pixel_with = [&](const Sides& moved) -> std::optional<Eigen::Vector2d> {
    const auto center = find_center(moved);
    return center ? shape.pixel_from_level_plane_point(*center) : std::nullopt;
  };
  const auto here = pixel_with(sides);
  Eigen::Matrix<double, 2, 8> slope;
  for (int end = 0; end < 8; ++end) {
    Sides moved = sides;
    Side& side = moved[std::size_t(end / 2)];
    (end % 2 == 0 ? side.from : side.to) += moved_px * per_px * side.inward_normal();
    const auto there = pixel_with(moved);
    if (!here || !there) return std::nullopt;
    slope.col(end) = (*there - *here) / moved_px;
  }
  return slope * ends * slope.transpose();
}

/// Returns true if the outline extends into the corners, unlike that of a disc: (2 u / length)^2 +
/// (2 v / width)^2 is 1 on an ellipse inside the sides, and up to 2 on the sides.
bool does_outline_reach_corners(const std::vector<Eigen::Vector2d>& points, const Sides& sides,
                                const Eigen::Vector2d& center) {
  constexpr double beyond = 1.35, min_fraction = 0.1;
  const auto off_middle = [&](const Eigen::Vector2d& at, std::size_t i) {
    const double length = (sides[i].to - sides[i].from).norm();
    return std::pow(2 * (at - center).dot(sides[i].edge_direction()) / length, 2);
  };
  const auto far = std::count_if(points.begin(), points.end(), [&](const Eigen::Vector2d& at) {
    return off_middle(at, 0) + off_middle(at, 1) > beyond;
  });
  return double(far) >= min_fraction * double(points.size());
}

/// Makes a light of four edges; `points` are the outline in the plane.
std::optional<MeasuredLight> fit_light(std::array<StraightEdge, 4>& edges, double per_px,
                                       const std::vector<Eigen::Vector2d>& points,
                                       const Eigen::Vector2d& middle, const LightShape& shape) {
  constexpr double outlier_px = 3, max_outside = 0.25;
  Sides sides;
  EndsCovariance ends = EndsCovariance::Zero();
  for (std::size_t i = 0; i < 4; ++i) {
    sides[i] = edges[i].side;
    get_block(ends, i) = edges[i].covariance_px;
  }
  if (shape.has_known_lens()) apply_right_angles(shape, per_px, sides, ends);
  const auto corners = find_corners(sides);
  if (!corners || !is_rectangular(sides)) return std::nullopt;
  const auto center = find_center(sides);
  if (!center || !does_outline_reach_corners(points, sides, *center)) return std::nullopt;
  const auto covariance = center_covariance(sides, ends, per_px, shape);
  sides = make_sides(*corners);
  auto pixel = shape.pixel_from_level_plane_point(*center);
  const auto around = make_polygon(sides, 0, shape);
  if (!pixel || !covariance || around.empty()) return std::nullopt;
  MeasuredLight light{};
  double lens_sd_px = 0;
  if (!shape.has_known_lens()) {
    const CenterOffset behind =
        estimate_center_offset(edges, *center, shape.swap_image_and_scanline_axes(middle));
    *pixel += behind.shift;
    lens_sd_px = behind.sd_px;
  }
  light.outline_kind = LightOutline::rectangle;
  light.pixel = *pixel;
  light.box = Eigen::AlignedBox2d(*pixel);
  for (const Eigen::Vector2d& at : around) light.box.extend(at);
  light.radius_px = std::sqrt(compute_polygon_area(around) / std::numbers::pi);
  double sagitta_px = 0, end_sd_px = 0;
  light.inlier_fraction = 1;
  for (StraightEdge& edge : edges) {
    end_sd_px = std::max(end_sd_px, std::sqrt(edge.covariance_px.diagonal().maxCoeff()));
    sagitta_px = std::max(sagitta_px, std::abs(edge.sagitta_px));
    light.rise_px = std::max(light.rise_px, kRisePerBlur * edge.profile.blur_px);
    light.inlier_fraction = std::min(light.inlier_fraction, edge.explained_fraction);
    for (const Eigen::Vector2d& point : edge.points)
      light.outline.push_back(shape.swap_image_and_scanline_axes(point));
  }
  light.box.min().array() -= 2 * end_sd_px;
  light.box.max().array() += 2 * end_sd_px;
  const auto sigma_px = limit_center_sd(std::hypot(compute_center_sd(*covariance), lens_sd_px));
  if (!sigma_px) return std::nullopt;
  light.sigma_px = *sigma_px;
  const auto outliers = std::count_if(points.begin(), points.end(), [&](const Eigen::Vector2d& at) {
    return std::any_of(sides.begin(), sides.end(), [&](const Side& side) {
      return (at - side.from).dot(side.inward_normal()) < -(outlier_px + sagitta_px) * per_px;
    });
  });
  if (double(outliers) > max_outside * double(points.size())) return std::nullopt;
  light.inner_polygon = make_polygon(sides, outlier_px * per_px, shape);
  light.aspect = compute_aspect(sides);
  light.aspect_sd = compute_aspect_sd(edges, per_px);
  return light.inner_polygon.empty() ? std::nullopt : std::optional(std::move(light));
}

/// Edges of a rectangle in the order of its sides; std::nullopt for edges that are not found.
using FoundEdges = std::array<std::optional<StraightEdge>, 4>;

/// Returns the profile of the edge with the smallest variance. @pre At least one edge exists.
EdgeProfile find_most_certain_profile(const FoundEdges& edges) {
  const StraightEdge* surest = nullptr;
  for (const auto& edge : edges) {
    if (!edge) continue;
    if (surest == nullptr || compute_middle_variance(*edge) < compute_middle_variance(*surest))
      surest = &*edge;
  }
  return surest->profile;
}

/// Offset of an edge's middle from its fitted position, inside positive.
struct Place {
  double offset_px, sd_px;
};

/// Predicts the position of edge i from the other three by the aspect ratio of the only size that
/// agrees with its fitted position. Returns std::nullopt if several sizes or none agree.
std::optional<Place> predict_edge_position(const EdgeImage& image, const FoundEdges& edges,
                                           std::size_t i,
                                           const std::vector<Eigen::Vector2d>& sizes_m) {
  constexpr double size_sd_m = 0.001;  // sizes are given to the millimeter
  constexpr double bounds = 2,
                   clear = 3;  // standard deviations: a uniform distribution ends at sqrt(3)
  const StraightEdge &edge = *edges[i], &opposite = *edges[(i + 2) % 4];
  const StraightEdge &left = *edges[(i + 1) % 4], &right = *edges[(i + 3) % 4];
  const double length_px = compute_distance_from_line(left.side, right.side) / image.per_px;
  const double depth_px = compute_distance_from_line(opposite.side, edge.side) / image.per_px;
  std::optional<Place> place;
  // The variance of the opposite edge counts three times. Edges are assumed to be independent,
  // but its error moves both edges.
  for (const Eigen::Vector2d& size_m : sizes_m) {
    for (const double ratio : {size_m[0] / size_m[1], size_m[1] / size_m[0]}) {
      const double relative_variance = square(get_tilt_sd(image.shape)) +
                                       square(size_sd_m) * size_m.cwiseAbs2().cwiseInverse().sum();
      const double variance =
          relative_variance * square(ratio * length_px) + 3 * compute_middle_variance(opposite) +
          square(ratio) * (compute_middle_variance(left) + compute_middle_variance(right));
      const Place here{depth_px - ratio * length_px, std::sqrt(variance)};
      const double reach_px =
          bounds * std::sqrt(compute_middle_variance(edge)) + clear * here.sd_px;
      if (std::abs(here.offset_px) > reach_px) continue;
      if (place && std::abs(place->offset_px - here.offset_px) > 0.1 * here.sd_px) return {};
      place = here;
    }
  }
  return place;
}

/// Returns half the distance between a side and the opposite one, in pixels.
double compute_reach_px(const Sides& sides, std::size_t i, double per_px) {
  return compute_distance_from_line(sides[i], sides[(i + 2) % 4]) / per_px / 2;
}

/// Adds hidden edges from the visible ones, see fit_rectangular_light(). Returns false if two
/// neighboring edges are missing or a missing edge is not found.
bool add_hidden_edges(const EdgeImage& image, const Sides& sides, EdgeSearch search,
                      const std::vector<Eigen::Vector2d>& sizes_m, FoundEdges& edges) {
  constexpr double ramp_lines = 3, unknown_sd_px = 100;
  const FoundEdges visible = edges;
  search.positions = 24;
  for (std::size_t i = 0; i < 4; ++i) {
    if (!visible[i] && !visible[(i + 1) % 4]) return false;
  }
  search.profile = find_most_certain_profile(visible);
  Sides expected = sides;
  EndsCovariance ends = square(unknown_sd_px) * EndsCovariance::Identity();
  for (std::size_t i = 0; i < 4; ++i) {
    if (!visible[i]) continue;
    expected[i] = visible[i]->side;
    get_block(ends, i) = visible[i]->covariance_px;
  }
  apply_right_angles(image.shape, image.per_px, expected, ends);
  const auto corners = find_corners(expected);
  if (!corners) return false;
  expected = make_sides(*corners);
  for (std::size_t i = 0; i < 4; ++i) {
    if (visible[i]) continue;
    const Side& side = expected[i];
    // The window extends to the next stripe, but not to the opposite edge.
    search.reach_px = std::min(image.levels.stripe_period_lines() + ramp_lines,
                               compute_reach_px(expected, i, image.per_px));
    const Eigen::Vector2d difference(-1, 1);
    // Twice the sd, because apply_right_angles() uses the angles again.
    const double slant_sd_px = std::sqrt(difference.dot(get_block(ends, i) * difference));
    const auto find = [&](double offset_px, double offset_sd_px) {
      return estimate_position_of_edge_in_dark_stripe(image, side, search,
                                                      {offset_px, offset_sd_px, slant_sd_px});
    };
    edges[i] = find(0, std::numeric_limits<double>::infinity());
    if (!edges[i]) return false;
    if (!visible[(i + 2) % 4]) continue;
    const auto place = predict_edge_position(image, edges, i, sizes_m);
    if (!place) continue;
    const Eigen::Vector2d moved =
        (edges[i]->side.from + edges[i]->side.to) / 2 - (side.from + side.to) / 2;
    edges[i] =
        find(place->offset_px + moved.dot(side.inward_normal()) / image.per_px, place->sd_px);
    if (!edges[i]) return false;
  }
  return true;
}

/// Outline of a light in the plane of LightShape, and the size of a pixel there.
struct PlaneOutline {
  std::vector<Eigen::Vector2d> points;
  double per_px;
};

/// Returns std::nullopt if the plane does not cover a point of the outline.
std::optional<PlaneOutline> project_outline_to_plane(const std::vector<Eigen::Vector2d>& outline,
                                                     const LightShape& shape) {
  PlaneOutline result;
  result.points.reserve(outline.size());
  Eigen::AlignedBox2d in_plane, in_image;
  for (const Eigen::Vector2d& pixel : outline) {
    const auto point =
        shape.level_plane_point_from_pixel(shape.swap_image_and_scanline_axes(pixel));
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
  const auto curved = find_corners_of_curved_sides(outline.points);
  if (curved && (!first || curved->near > first->near)) first = curved;
  return first;
}

/// Returns the chords of the face at the depth `inset` inside the sides. Returns an empty vector if
/// there are too few, or if they are not on consecutive scanlines, because LineLevels assigns
/// levels by index.
std::vector<PixelRun> find_chords_inside_sides(const Sides& sides, double inset,
                                               const ImageSize& size, const LightShape& shape) {
  constexpr std::size_t min_lines = 8;
  auto chords = find_chords_in_polygon(
      shape.swap_image_and_scanline_axes(make_polygon(sides, inset, shape)), size);
  if (chords.size() < min_lines) return {};
  const int rows = chords.back().row - chords.front().row + 1;
  if (rows != static_cast<int>(chords.size())) return {};
  return chords;
}

/// Rectangle with the edges of a pass, from which the next pass starts.
struct FittedRectangle {
  std::array<StraightEdge, 4> edges;
  Corners corners;
  /// Largest curvature of an edge.
  double sagitta_px;
  /// Levels across the most certain edge.
  std::optional<EdgeProfile> profile;
};

/// Returns std::nullopt if the edges do not form a rectangle.
/// @pre all edges were found
std::optional<FittedRectangle> assemble_rectangle(FoundEdges found) {
  FittedRectangle result{{}, {}, 0, find_most_certain_profile(found)};
  Sides sides;
  for (std::size_t i = 0; i < 4; ++i) {
    result.edges[i] = std::move(*found[i]);
    sides[i] = result.edges[i].side;
    result.sagitta_px = std::max(result.sagitta_px, std::abs(result.edges[i].sagitta_px));
  }
  const auto corners = is_rectangular(sides) ? find_corners(sides) : std::nullopt;
  if (!corners) return std::nullopt;
  result.corners = *corners;
  return result;
}

}  // namespace

std::vector<PixelRun> find_chords_in_polygon(const std::vector<Eigen::Vector2d>& polygon,
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
                                                   const Background& background,
                                                   const LightShape& shape,
                                                   const std::vector<Eigen::Vector2d>& sizes_m) {
  constexpr double min_px = 6, max_aspect = 40;
  constexpr std::size_t min_points = 10;
  const PixelBox box = blob.blob_bounding_box();
  if (outline.size() < min_points || std::min(box.width, box.height) < min_px) return {};
  const auto in_plane = project_outline_to_plane(outline, shape);
  if (!in_plane) return std::nullopt;
  const double per_px = in_plane->per_px;
  const auto first = find_initial_corners(*in_plane, shape.has_known_lens());
  if (!first) return std::nullopt;

  // A disc that stripes partly hide is less slender than this.
  constexpr double min_aspect = 3, max_round_off_px = 1;
  const auto is_rather_round = [&](const Sides& sides) {
    if (compute_aspect(sides) > min_aspect) return false;
    const auto disc = fit_circle(in_plane->points);
    if (!disc) return false;
    const auto near = std::ranges::count_if(in_plane->points, [&](const Eigen::Vector2d& at) {
      const double off = (at - disc->circle.center).norm() - disc->circle.radius;
      return std::abs(off) < max_round_off_px * per_px;
    });
    return double(near) >= first->near * double(in_plane->points.size());
  };
  FittedRectangle rectangle{{}, first->corners, 0, {}};
  struct Pass {
    double inset_px;
    EdgeSearch search;
  };
  for (auto [inset_px, search] : {Pass{5, {7, 48}}, Pass{3.5, {5, 48}}, Pass{3.5, {4, 96}}}) {
    const Sides sides = make_sides(rectangle.corners);
    const double min_side =
        std::min((sides[0].to - sides[0].from).norm(), (sides[1].to - sides[1].from).norm());
    if (!(min_side > min_px * per_px) || compute_aspect(sides) > max_aspect) return std::nullopt;
    const double inset = std::min((inset_px + rectangle.sagitta_px) * per_px, min_side / 3);
    const auto chords = find_chords_inside_sides(sides, inset, lines.size(), shape);
    if (chords.empty()) return std::nullopt;
    const LineLevels levels(lines, chords, background);
    const double max_reach_px = search.reach_px + rectangle.sagitta_px;
    search.profile = rectangle.profile;
    const EdgeImage image{lines, levels, background.level, per_px, shape};
    FoundEdges found_edges;
    for (std::size_t i = 0; i < 4; ++i) {
      search.reach_px = std::min(max_reach_px, compute_reach_px(sides, i, per_px));
      found_edges[i] = fit_straight_edge(image, sides[i], search);
    }
    if (!std::ranges::all_of(found_edges, [](const auto& edge) { return edge.has_value(); })) {
      if (!shape.has_known_lens() ||
          !add_hidden_edges(image, sides, search, sizes_m, found_edges) || is_rather_round(sides)) {
        return std::nullopt;
      }
    }
    auto fitted = assemble_rectangle(std::move(found_edges));
    if (!fitted) return std::nullopt;
    rectangle = std::move(*fitted);
  }
  const Eigen::Vector2d middle((lines.width - 1) / 2.0, (lines.height - 1) / 2.0);
  return fit_light(rectangle.edges, per_px, in_plane->points, middle, shape);
}

}  // namespace vlp
