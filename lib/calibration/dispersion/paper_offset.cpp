// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/dispersion/paper_offset.h"

#include <Eigen/LU>
#include <algorithm>

#include "calibration/dispersion/station_statistics.h"
#include "geometry/enclosing_circle.h"
#include "geometry/plane.h"

namespace vlp {
namespace {

std::vector<Eigen::Vector2d> errors_at(const StationFixes& station,
                                       const Eigen::Vector2d& offset_px,
                                       const std::vector<bool>& used) {
  const OptionalFixes fixes = station.at(offset_px);
  std::vector<Eigen::Vector2d> errors_m;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    if (fixes[i] && used[i]) errors_m.push_back(fixes[i]->error_m);
  }
  return errors_m;
}

Eigen::Vector2d mean_of(const std::vector<Eigen::Vector2d>& points) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const auto& point : points) sum += point;
  return sum / static_cast<double>(points.size());
}

/// How the offset moves the mean fix, from differences; not finite where there is no fix.
Eigen::Matrix2d floor_from_image(const StationFixes& station, const Eigen::Vector2d& at_px,
                                 const std::vector<bool>& used) {
  constexpr double step_px = 0.25;  // fixes are smooth over it, and far above their rounding
  Eigen::Matrix2d derivative;
  for (Eigen::Index axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d step = step_px * Eigen::Vector2d::Unit(axis);
    derivative.col(axis) = (mean_of(errors_at(station, at_px + step, used)) -
                            mean_of(errors_at(station, at_px - step, used))) /
                           (2 * step_px);
  }
  return derivative;
}

Matrix2 covariance_of_mean(const std::vector<Eigen::Vector2d>& points) {
  const Eigen::Vector2d mean = mean_of(points);
  Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
  for (const auto& point : points) scatter += (point - mean) * (point - mean).transpose();
  const double n = static_cast<double>(points.size());
  return scatter / (n * (n - 1));
}

}  // namespace

Circle circle_of(const std::vector<Eigen::Vector2d>& points, DispersionCircle kind) {
  if (kind == DispersionCircle::enclosing) return enclosing_circle(points);
  Circle circle{mean_of(points), 0};
  for (const auto& point : points) {
    circle.radius = std::max(circle.radius, (point - circle.center).norm());
  }
  return circle;
}

PaperOffset find_paper_offset(const StationFixes& station, const Eigen::Vector2d& focal_px,
                              DispersionCircle kind) {
  const OptionalFixes fixes = station.at({0, 0});
  const std::vector<bool> used = near_median(fixes);
  const TypicalFix typical = typical_of(fixes, used);
  if (!typical.at_one_yaw()) return {DispersionStatus::many_yaws};
  Eigen::Matrix2d image_from_floor =
      focal_px.asDiagonal() *
      Eigen::Matrix2d(product_matrix(typical.heading.normalized()).transpose() / typical.height_m);
  constexpr int max_rounds = 30;
  constexpr double settled_m = 1e-10;  // far below any noise
  Eigen::Vector2d offset_px = Eigen::Vector2d::Zero();
  for (int round = 0; round < max_rounds; ++round) {
    const auto errors_m = errors_at(station, offset_px, used);
    if (errors_m.size() < 2) break;
    const Eigen::Vector2d center_m = circle_of(errors_m, kind).center;
    if (round > 0) {
      image_from_floor = floor_from_image(station, offset_px, used).inverse();
      if (!image_from_floor.allFinite()) break;
    }
    if (center_m.norm() > settled_m) {
      offset_px -= image_from_floor * center_m;
      continue;
    }
    PaperOffset found{DispersionStatus::ok, offset_px, {}, used};
    if (kind == DispersionCircle::mean) {
      Matrix2 covariance =
          image_from_floor * covariance_of_mean(errors_m) * image_from_floor.transpose();
      covariance(1, 0) = covariance(0, 1);
      found.covariance = covariance;
    }
    return found;
  }
  return {DispersionStatus::diverged};
}

}  // namespace vlp
