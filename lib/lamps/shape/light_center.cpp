// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/light_center.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "lamps/shape/light_center_noise.h"
#include "rig/detection.h"

namespace vlp {
Eigen::Vector2d LightShape::swap_axes(const Eigen::Vector2d& at) const {
  return camera_.readout == Readout::rows ? at : Eigen::Vector2d(at.reverse());
}

std::vector<Eigen::Vector2d> LightShape::swap_axes(std::vector<Eigen::Vector2d> points) const {
  for (Eigen::Vector2d& point : points) point = swap_axes(point);
  return points;
}

std::optional<Eigen::Vector2d> LightShape::plane_from_pixel(const Eigen::Vector2d& pixel) const {
  if (!camera_.lens) return pixel;
  const auto ray = camera_.lens->unproject_pixel(pixel);
  if (!ray) return std::nullopt;
  const Eigen::Vector3d level = camera_.level_from_camera * ray->direction;
  if (!(level.z() > 0)) return std::nullopt;
  return level.head<2>() / level.z();
}

std::optional<Eigen::Vector2d> LightShape::pixel_from_plane(const Eigen::Vector2d& plane) const {
  if (!camera_.lens) return plane;
  return camera_.lens->project_point(camera_.level_from_camera.transpose() * plane.homogeneous());
}

bool LightShape::set_outline(const PlaneEllipse& outline, double radius_px,
                             MeasuredLight& light) const {
  constexpr int num_points = 64;
  const auto pixel = pixel_from_plane(outline.center);
  if (!pixel) return false;
  const Matrix2 rim_from_circle = outline.unit_from_plane.inverse();
  Eigen::AlignedBox2d box(*pixel);
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i < num_points; ++i) {
    const double angle = 2 * std::numbers::pi / num_points * i;
    const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
    const auto rim = pixel_from_plane(outline.center + rim_from_circle * direction);
    if (!rim) return false;
    box.extend(*rim);
    points.push_back(*rim);
  }
  light.pixel = *pixel;
  light.box = box;
  light.outline = std::move(points);
  light.plane_outline = outline;
  light.radius_px = radius_px;
  return true;
}

Eigen::Vector2d LightShape::compute_scanline_gradient(const Circle& circle) const {
  const auto line = [&](double x, double y) {
    const auto pixel = pixel_from_plane(circle.center + circle.radius / 2 * Eigen::Vector2d(x, y));
    return pixel ? swap_axes(*pixel).y() : std::numeric_limits<double>::quiet_NaN();
  };
  return Eigen::Vector2d(line(1, 0) - line(-1, 0), line(0, 1) - line(0, -1)) / circle.radius;
}

Eigen::Vector2d LightShape::compute_curved_line_offset(
    const Circle& circle, const Eigen::Vector2d& motion_per_line) const {
  constexpr int directions = 16;
  const auto center = pixel_from_plane(circle.center);
  Eigen::Vector2d off = Eigen::Vector2d::Zero();
  for (int i = 0; i < directions; ++i) {
    const double angle = 2 * std::numbers::pi / directions * i;
    const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
    const auto rim = pixel_from_plane(circle.center + circle.radius * direction);
    if (!center || !rim) return Eigen::Vector2d::Zero();
    const double later = swap_axes(*rim).y() - swap_axes(*center).y();
    off += 2.0 / directions * motion_per_line.dot(direction) * later * direction;
  }
  return off;
}

void LightShape::correct_center_for_motion(const Oval& oval, const Eigen::Vector2d& motion_per_line,
                                           MeasuredLight& light) const {
  const auto estimate = light.outline_equations->solve_with_oval_prior(oval);
  if (!estimate) return;
  const Circle& circle = light.outline_equations->circle;
  const auto pixel = pixel_from_plane(circle.center + circle.radius * estimate->p.head<2>() -
                                      compute_curved_line_offset(circle, motion_per_line));
  if (!pixel) return;
  light.pixel = *pixel;
  const double sigma_px =
      light.radius_px * compute_center_sd(estimate->covariance.topLeftCorner<2, 2>());
  light.sigma_px = std::clamp(sigma_px, kMinSigma_px, kMaxSigma_px);
}

}  // namespace vlp
