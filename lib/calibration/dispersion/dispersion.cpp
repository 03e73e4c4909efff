// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/dispersion/dispersion.h"

#include <algorithm>
#include <cmath>

#include "calibration/dispersion/offset_separation.h"
#include "calibration/dispersion/station_fixes.h"
#include "geometry/angles.h"
#include "geometry/enclosing_circle.h"
#include "geometry/plane.h"

namespace vlp {
namespace {

using Fixes = std::vector<std::optional<StationFixes::At>>;

constexpr double kFar = 0.2;  // of the lamps' height: more than 11 degrees of tilt
constexpr double kOneYaw_rad = rad_from_deg(10);

/// Means over the fixes that are used.
struct Typical {
  Eigen::Vector2d heading = Eigen::Vector2d::Zero();
  double height_m = 0;
  int count = 0;

  /// Root of the mean squared sine, about, of the yaws from their mean.
  double yaw_variety() const { return std::sqrt(std::max(0.0, 1 - heading.squaredNorm())); }
};

Typical typical_of(const Fixes& fixes, const std::vector<bool>& used) {
  Typical typical;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    if (!fixes[i] || !used[i]) continue;
    typical.heading += Eigen::Vector2d(std::cos(fixes[i]->yaw_rad), std::sin(fixes[i]->yaw_rad));
    typical.height_m += fixes[i]->height_m;
    ++typical.count;
  }
  typical.heading /= typical.count;
  typical.height_m /= typical.count;
  return typical;
}

bool far_from_all(const Fixes& fixes) {
  return std::all_of(fixes.begin(), fixes.end(), [](const auto& fix) {
    return !fix || fix->error_m.norm() > kFar * fix->height_m;
  });
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Those within five standard deviations of the median fix, at one yaw.
std::vector<bool> near_median(const Fixes& fixes) {
  std::vector<double> x, y, squares;
  for (const auto& fix : fixes) {
    if (!fix) continue;
    x.push_back(fix->error_m.x());
    y.push_back(fix->error_m.y());
  }
  const Eigen::Vector2d middle_m(median(x), median(y));
  for (const auto& fix : fixes) {
    if (fix) squares.push_back((fix->error_m - middle_m).squaredNorm());
  }
  const double limit = kOutlierVariances * robust_variance(squares);
  std::vector<bool> near;
  near.reserve(fixes.size());
  for (const auto& fix : fixes) {
    near.push_back(fix && (fix->error_m - middle_m).squaredNorm() <= limit);
  }
  return near;
}

Circle circle_of(const std::vector<Eigen::Vector2d>& points, DispersionCircle kind) {
  if (kind == DispersionCircle::enclosing) return enclosing_circle(points);
  Circle circle{Eigen::Vector2d::Zero(), 0};
  for (const auto& point : points) circle.center += point / static_cast<double>(points.size());
  for (const auto& point : points) {
    circle.radius = std::max(circle.radius, (point - circle.center).norm());
  }
  return circle;
}

/// Fills in what the offset makes of the fixes.
void apply(DispersionFit& fit, const StationFixes& station, const std::vector<bool>& used,
           DispersionCircle kind) {
  const Fixes before = station.at({0, 0}), after = station.at(fit.dispersion.offset_px);
  std::vector<Eigen::Vector2d> before_m, after_m;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (!before[i] || !after[i]) continue;
    fit.fixes.push_back({i, before[i]->error_m, after[i]->error_m, used[i]});
    if (!used[i]) continue;
    before_m.push_back(before[i]->error_m);
    after_m.push_back(after[i]->error_m);
  }
  fit.before = circle_of(before_m, kind);
  fit.after = circle_of(after_m, kind);
  fit.dispersion.radius_m = fit.before.radius;
  fit.dispersion.center_m = fit.before.center;
  fit.dispersion.captures = static_cast<int>(before_m.size());
}

bool all_stated(std::span<const StationCapture> captures) {
  return std::all_of(captures.begin(), captures.end(), [](const StationCapture& capture) {
    return std::all_of(capture.detections.begin(), capture.detections.end(),
                       [](const Detection& detection) { return detection.sigma_px.has_value(); });
  });
}

/// eq. 10 and 11 on the floor, taken back to the image by f / H and the yaw.
void fit_paper(DispersionFit& fit, const StationFixes& station, const Eigen::Vector2d& focal_px,
               DispersionCircle kind) {
  const Fixes fixes = station.at({0, 0});
  const std::vector<bool> used = near_median(fixes);
  const Typical typical = typical_of(fixes, used);
  if (typical.yaw_variety() > std::sin(kOneYaw_rad)) {
    fit.status = DispersionStatus::many_yaws;
    return;
  }
  std::vector<Eigen::Vector2d> errors_m;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    if (used[i]) errors_m.push_back(fixes[i]->error_m);
  }
  const Circle circle = circle_of(errors_m, kind);
  const Eigen::Vector2d heading = typical.heading.normalized();
  const Eigen::Matrix2d image_from_floor =
      focal_px.asDiagonal() *
      Eigen::Matrix2d(times_matrix(heading).transpose() / -typical.height_m);
  fit.dispersion.offset_px = image_from_floor * circle.center;
  if (kind == DispersionCircle::mean) {
    Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
    for (const auto& error_m : errors_m) {
      scatter += (error_m - circle.center) * (error_m - circle.center).transpose();
    }
    const double n = static_cast<double>(errors_m.size());
    Matrix2 covariance = image_from_floor * scatter * image_from_floor.transpose() / (n * (n - 1));
    covariance(1, 0) = covariance(0, 1);
    fit.dispersion.covariance = covariance;
  }
  apply(fit, station, used, kind);
}

/// Of the yaws whatever single fix is left out: one alone is not to tell camera from world.
double yaw_variety_without_one(const Fixes& fixes, std::vector<bool> used) {
  double least = 1;
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (!fixes[i] || !used[i]) continue;
    used[i] = false;
    least = std::min(least, typical_of(fixes, used).yaw_variety());
    used[i] = true;
  }
  return least;
}

void fit_camera(DispersionFit& fit, const StationFixes& station, bool noise_is_stated,
                DispersionCircle kind) {
  const auto separation = separate_offsets(station);
  if (!separation) {
    fit.status = DispersionStatus::diverged;
    return;
  }
  const Fixes fixes = station.at({0, 0});
  if (typical_of(fixes, separation->used).count < 3) {
    fit.status = DispersionStatus::too_few_captures;
    return;
  }
  if (yaw_variety_without_one(fixes, separation->used) < std::sin(kOneYaw_rad)) {
    fit.status = DispersionStatus::one_yaw;
    return;
  }
  const double excess = noise_is_stated ? std::max(1.0, separation->excess) : separation->excess;
  fit.dispersion.offset_px = separation->offset_px;
  Matrix2 covariance = excess * separation->covariance.topLeftCorner<2, 2>();
  covariance(1, 0) = covariance(0, 1);
  fit.dispersion.covariance = covariance;
  fit.world_offset_m = separation->world_m;
  fit.world_covariance = excess * separation->covariance.bottomRightCorner<2, 2>();
  apply(fit, station, separation->used, kind);
}

}  // namespace

std::string_view explanation_of(DispersionStatus status) {
  switch (status) {
    case DispersionStatus::ok:
      return "ok";
    case DispersionStatus::no_fix:
      return "no capture has a fix";
    case DispersionStatus::too_few_captures:
      return "too few captures have a fix that agrees with the others: three or more are needed "
             "(two "
             "for --method paper); add captures";
    case DispersionStatus::station_far:
      return "every fix is farther from the station than a fifth of the lamps' height: is it in "
             "metres, and in the frame of the lamp map? Are these the captures taken there?";
    case DispersionStatus::one_yaw:
      return "all captures, or all but one, are at one yaw, where an error of the camera and one "
             "of "
             "the station or the lamp map look alike: turn the camera at the station and add those "
             "captures, or "
             "take --method paper, which supposes that station and map are right";
    case DispersionStatus::many_yaws:
      return "the captures are at different yaws, over which the paper's circle averages the "
             "camera's error away: hold the yaw, or take --method camera";
    case DispersionStatus::diverged:
      return "no offset explains the fixes: are all captures from the station, and is the "
             "calibration this camera's? Add captures at other yaws";
  }
  return "";
}

DispersionFit fit_dispersion(std::span<const StationCapture> captures, const LampMap& map,
                             const Calibration& calibration, DispersionMethod method,
                             DispersionCircle circle) {
  const StationFixes station(captures, map, calibration);
  const Fixes fixes = station.at({0, 0});
  const auto count =
      std::count_if(fixes.begin(), fixes.end(), [](const auto& fix) { return fix.has_value(); });
  DispersionFit fit;
  fit.captures_without_fix = static_cast<int>(std::ssize(fixes) - count);
  fit.no_fix_status = station.first_refusal();
  if (count == 0) return fit;
  const bool paper = method == DispersionMethod::paper;
  const std::vector<bool> all(fixes.size(), true);
  if (far_from_all(fixes)) {
    fit.status = DispersionStatus::station_far;
  } else if (count < (paper ? 2 : 3)) {
    fit.status = DispersionStatus::too_few_captures;
  } else if (!paper && typical_of(fixes, all).yaw_variety() < std::sin(kOneYaw_rad)) {
    fit.status = DispersionStatus::one_yaw;
  } else {
    fit.status = DispersionStatus::ok;
    const Eigen::Vector2d focal_px(calibration.camera.intrinsics[0],
                                   calibration.camera.intrinsics[1]);
    if (paper) {
      fit_paper(fit, station, focal_px, circle);
    } else {
      fit_camera(fit, station, all_stated(captures), circle);
    }
  }
  return fit;
}

}  // namespace vlp
