// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/light_center.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>

#include "geometry/median.h"
#include "lamps/shape/light_center_noise.h"
#include "lamps/shape/robust_ellipse.h"
#include "rig/detection.h"

namespace vlp {
namespace {

double compute_median_rise_px(const std::vector<EdgePoint>& outline) {
  std::vector<double> rises;
  rises.reserve(outline.size());
  for (const EdgePoint& edge : outline) rises.push_back(edge.rise_px);
  return upper_median(std::move(rises));
}

/// Selects the points on the circle, without those next to an outlier: where the edge of an
/// occluder meets the outline, both are blurred.
std::vector<bool> select_points_on_circle(const std::vector<EdgePoint>& outline,
                                          const std::vector<bool>& inliers) {
  constexpr double reach_px = 4;
  std::vector<Eigen::Vector2d> others;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    if (!inliers[i]) others.push_back(outline[i].pixel);
  }
  std::vector<bool> clear = inliers;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    clear[i] = clear[i] && std::none_of(others.begin(), others.end(), [&](const auto& other) {
                 return (other - outline[i].pixel).squaredNorm() < reach_px * reach_px;
               });
  }
  const auto count = [](const std::vector<bool>& points) {
    return std::count(points.begin(), points.end(), true);
  };
  return 2 * count(clear) < count(inliers) ? inliers : clear;
}

/// Returns the axis ratio of an ellipse.
double compute_axis_ratio(const Matrix2& rim_from_circle) {
  const double half_square = rim_from_circle.squaredNorm() / 2;
  const double area = std::abs(rim_from_circle.determinant());
  const double difference = std::sqrt(std::max(0.0, half_square * half_square - area * area));
  return (half_square + difference) / area;
}

/// Outline of a light in the plane of LightShape.
struct WeightedOutline {
  /// Edge points that the plane covers, their positions in it, and their weights.
  std::vector<EdgePoint> edges;
  std::vector<Eigen::Vector2d> points;
  std::vector<double> weights;
  /// Level of the brightest edge point.
  double brightest;
  /// Size of a pixel in the plane.
  double per_px;
};

WeightedOutline make_weighted_outline(std::vector<EdgePoint> edges, const LightShape& shape) {
  WeightedOutline result{{}, {}, {}, 0, 0};
  std::vector<Eigen::Vector2d> pixels;
  std::erase_if(edges, [&](const EdgePoint& edge) {
    const auto plane =
        shape.level_plane_point_from_pixel(shape.swap_image_and_scanline_axes(edge.pixel));
    if (plane) {
      result.points.push_back(*plane);
      pixels.push_back(edge.pixel);
    }
    result.brightest = std::max(result.brightest, edge.level);
    return !plane;
  });
  result.weights.reserve(edges.size());
  for (const EdgePoint& edge : edges) {
    result.weights.push_back(std::pow(edge.level / result.brightest, 2));
  }
  result.per_px =
      compute_bounding_box_diagonal(result.points) / compute_bounding_box_diagonal(pixels);
  result.edges = std::move(edges);
  return result;
}

/// Fits a circle; without a lens an ellipse. Returns std::nullopt if too few points are on it or if
/// it is too slender.
std::optional<RobustEllipse> fit_circle_or_ellipse(const WeightedOutline& outline, double noise,
                                                   const DetectorCamera& camera) {
  // The half-level position is accurate to about half a pixel; noise and a soft edge increase its
  // error.
  const double tolerance_px =
      std::max({0.35, 8 * noise / outline.brightest, 0.4 * compute_median_rise_px(outline.edges)});
  const double tolerance = tolerance_px * outline.per_px;
  constexpr double nearly_round = 3;
  auto fit = camera.lens ? fit_robust_circle(outline.points, outline.weights, tolerance)
                         : fit_robust_ellipse(outline.points, outline.weights, tolerance);
  if (!fit && !camera.lens && camera.max_axis_ratio > nearly_round) {
    fit = fit_elongated_ellipse(outline.points, outline.weights, tolerance);
  }
  if (!fit || fit->count < static_cast<int>(kMinOutlinePoints)) return std::nullopt;
  if (!camera.lens && compute_axis_ratio(fit->rim_from_circle) > camera.max_axis_ratio)
    return std::nullopt;
  return fit;
}

}  // namespace

Eigen::Vector2d LightShape::swap_image_and_scanline_axes(const Eigen::Vector2d& at) const {
  return camera_.readout == Readout::rows ? at : Eigen::Vector2d(at.reverse());
}

std::vector<Eigen::Vector2d> LightShape::swap_image_and_scanline_axes(
    std::vector<Eigen::Vector2d> points) const {
  for (Eigen::Vector2d& point : points) point = swap_image_and_scanline_axes(point);
  return points;
}

std::optional<Eigen::Vector2d> LightShape::level_plane_point_from_pixel(
    const Eigen::Vector2d& pixel) const {
  if (!camera_.lens) return pixel;
  const auto ray = camera_.lens->unproject_pixel(pixel);
  if (!ray) return std::nullopt;
  const Eigen::Vector3d level = camera_.level_from_camera * ray->direction;
  if (!(level.z() > 0)) return std::nullopt;
  return level.head<2>() / level.z();
}

std::optional<Eigen::Vector2d> LightShape::pixel_from_level_plane_point(
    const Eigen::Vector2d& plane) const {
  if (!camera_.lens) return plane;
  return camera_.lens->project_point(camera_.level_from_camera.transpose() * plane.homogeneous());
}

bool LightShape::set_outline_of_light(const PlaneEllipse& outline, double radius_px,
                                      Light& light) const {
  const auto pixel = pixel_from_level_plane_point(outline.center);
  if (!pixel) return false;
  const Matrix2 rim_from_circle = outline.unit_from_plane.inverse();
  Eigen::Vector2d box_min = *pixel, box_max = *pixel;
  for (int i = 0; i < 16; ++i) {
    const double angle = std::numbers::pi / 8 * i;
    const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
    const auto rim = pixel_from_level_plane_point(outline.center + rim_from_circle * direction);
    if (!rim) return false;
    box_min = box_min.cwiseMin(*rim);
    box_max = box_max.cwiseMax(*rim);
  }
  light.pixel = *pixel;
  light.box_min = box_min;
  light.box_max = box_max;
  light.plane_outline = outline;
  light.radius_px = radius_px;
  return true;
}

std::optional<Light> LightShape::fit_light_to_outline(std::vector<EdgePoint> outline,
                                                      const Background& background) const {
  const WeightedOutline weighted = make_weighted_outline(std::move(outline), *this);
  if (weighted.points.size() < kMinOutlinePoints || !(weighted.per_px > 0)) return std::nullopt;
  const auto fit = fit_circle_or_ellipse(weighted, background.noise, camera_);
  Light light{};
  if (!fit) return std::nullopt;
  const double radius_px = std::sqrt(fit->rim_from_circle.determinant()) / weighted.per_px;
  if (!set_outline_of_light({fit->center, fit->rim_from_circle.inverse()}, radius_px, light))
    return std::nullopt;
  const std::vector<EdgePoint>& edges = weighted.edges;
  const std::vector<bool> selected = select_points_on_circle(edges, fit->inliers);
  const auto sigma_px =
      limit_center_sd(compute_center_sd(fit->center_covariance) / weighted.per_px);
  if (!sigma_px) return std::nullopt;
  light.sigma_px = *sigma_px;
  light.inlier_fraction = double(fit->count) / double(edges.size());
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (selected[i]) light.outline.push_back(edges[i]);
  }
  light.rise_px = compute_median_rise_px(light.outline);
  return light;
}

Eigen::Vector2d LightShape::compute_scanline_gradient_wrt_position(const Circle& circle) const {
  const auto line = [&](double x, double y) {
    const auto pixel =
        pixel_from_level_plane_point(circle.center + circle.radius / 2 * Eigen::Vector2d(x, y));
    return pixel ? swap_image_and_scanline_axes(*pixel).y()
                 : std::numeric_limits<double>::quiet_NaN();
  };
  return Eigen::Vector2d(line(1, 0) - line(-1, 0), line(0, 1) - line(0, -1)) / circle.radius;
}

Eigen::Vector2d LightShape::compute_center_offset_from_curved_scanlines(
    const Circle& circle, const Eigen::Vector2d& motion_per_line) const {
  constexpr int directions = 16;
  const auto center = pixel_from_level_plane_point(circle.center);
  Eigen::Vector2d off = Eigen::Vector2d::Zero();
  for (int i = 0; i < directions; ++i) {
    const double angle = 2 * std::numbers::pi / directions * i;
    const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
    const auto rim = pixel_from_level_plane_point(circle.center + circle.radius * direction);
    if (!center || !rim) return Eigen::Vector2d::Zero();
    const double later =
        swap_image_and_scanline_axes(*rim).y() - swap_image_and_scanline_axes(*center).y();
    off += 2.0 / directions * motion_per_line.dot(direction) * later * direction;
  }
  return off;
}

void LightShape::correct_light_for_motion(const Oval& oval, const Eigen::Vector2d& motion_per_line,
                                          Light& light) const {
  const auto estimate = light.outline_equations->solve_with_oval_prior(oval);
  if (!estimate) return;
  const Circle& circle = light.outline_equations->circle;
  const auto pixel = pixel_from_level_plane_point(
      circle.center + circle.radius * estimate->p.head<2>() -
      compute_center_offset_from_curved_scanlines(circle, motion_per_line));
  if (!pixel) return;
  light.pixel = *pixel;
  const double sigma_px =
      light.radius_px * compute_center_sd(estimate->covariance.topLeftCorner<2, 2>());
  light.sigma_px = std::clamp(sigma_px, kMinSigma_px, kMaxSigma_px);
}

std::vector<EdgePoint> LightShape::find_outline_points_outside_light(
    const Light& light, const std::vector<EdgePoint>& outline) const {
  // Uses the axis-aligned ellipse in the box, although the ellipse of the light may be rotated.
  constexpr double clear = 1.1, clear_px = 1.5;
  const Eigen::Vector2d center = (light.box_min + light.box_max) / 2;
  const Eigen::Vector2d half =
      clear * (light.box_max - light.box_min) / 2 + Eigen::Vector2d(clear_px, clear_px);
  std::vector<EdgePoint> result;
  std::copy_if(
      outline.begin(), outline.end(), std::back_inserter(result), [&](const EdgePoint& edge) {
        return (swap_image_and_scanline_axes(edge.pixel) - center).cwiseQuotient(half).norm() > 1;
      });
  return result;
}

}  // namespace vlp
