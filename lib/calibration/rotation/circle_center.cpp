// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/circle_center.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>

#include "geometry/symmetric.h"

namespace vlp {
namespace {

/// Inliers among the observations of one lamp at one height, in units of the focal length.
struct Trace {
  std::vector<std::size_t> observations;
  std::vector<Eigen::Vector2d> points;
};

Trace collect_lamp_trace(const RotationCaptures& rotation, const RotationFit& axis,
                         std::size_t lamp, std::size_t height) {
  Trace trace;
  for (const std::size_t i : axis.used_observations) {
    const RotationObservation& observation = rotation.observations[i];
    if (observation.lamp != lamp || rotation.captures[observation.capture].height != height)
      continue;
    if (!(observation.ray.z() > 0)) continue;
    trace.observations.push_back(i);
    trace.points.emplace_back(observation.ray.hnormalized());
  }
  return trace;
}

/// Returns true if the yaws of the points, and not only their noise, determine the center of a
/// circle.
///
/// With unit vectors u from the center, M = sum of (u - mean u)(u - mean u)' is the information on
/// the center for unit noise. Noise of standard deviation s rotates each u by s / R. It adds (s /
/// R)^2 sum of (t . w)^2 along w, where t is the tangent. For points at two opposite yaws, the
/// smallest eigenvalue of M contains only noise.
///
/// @param noise  standard deviation of a coordinate, in the unit of the points
bool is_center_determined(const Circle& circle, const std::vector<Eigen::Vector2d>& points,
                          double noise) {
  // A standard deviation from M is then about 1 / sqrt(1 - 0.25) = 1.15 times too small.
  constexpr double max_noise_fraction = 0.25;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const auto& point : points) mean += (point - circle.center).normalized();
  mean /= static_cast<double>(points.size());
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero(), tangents = Eigen::Matrix2d::Zero();
  for (const auto& point : points) {
    const Eigen::Vector2d radial = (point - circle.center).normalized();
    const Eigen::Vector2d tangent(-radial.y(), radial.x());
    information += (radial - mean) * (radial - mean).transpose();
    tangents += tangent * tangent.transpose();
  }
  const auto [values, axes] = eigendecompose(information);
  const double variance = noise * noise / (circle.radius * circle.radius);
  for (Eigen::Index i = 0; i < 2; ++i) {
    const double from_noise = variance * axes.col(i).dot(tangents * axes.col(i));
    if (!(from_noise <= max_noise_fraction * values[i])) return false;
  }
  return true;
}

/// Circles of one height.
struct HeightCircles {
  /// Circles whose centers are determined, and their observations.
  std::vector<LampCircle> circles;
  std::vector<std::size_t> observations;
  /// Number of other lamps with three observations or more.
  int undetermined = 0;
  /// Sum of the squared distances from the circles, and its degrees of freedom.
  double squares = 0, freedom = 0;
};

HeightCircles fit_circles(const RotationCaptures& rotation, const RotationFit& axis,
                          std::size_t height, double noise) {
  HeightCircles result;
  for (std::size_t lamp = 0; lamp < rotation.lamps.size(); ++lamp) {
    const Trace trace = collect_lamp_trace(rotation, axis, lamp, height);
    if (trace.points.size() < 3) continue;
    const auto fit = fit_circle(trace.points);
    if (!fit || !fit->converged || !is_center_determined(fit->circle, trace.points, noise)) {
      ++result.undetermined;
      continue;
    }
    const double count = static_cast<double>(trace.points.size());
    result.circles.push_back({lamp, height, *fit});
    result.observations.insert(result.observations.end(), trace.observations.begin(),
                               trace.observations.end());
    result.squares += fit->rms * fit->rms * count;
    result.freedom += count - 3;
  }
  return result;
}

}  // namespace

CircleCenters fit_circle_centers(const RotationCaptures& rotation, const Camera& camera,
                                 const RotationFit& axis) {
  assert(rotation.status == RotationStatus::ok);
  CircleCenters result;
  if (!axis.converged) return result;
  result.mean.outliers = axis.outliers;
  const double focal_px = camera.focal_px().x();
  const double noise = std::max(axis.residual_px, rotation.median_sigma_px.value_or(0)) / focal_px;
  double squares = 0, freedom = 0;
  for (std::size_t i = 0; i < rotation.heights.size(); ++i) {
    const HeightCircles height = fit_circles(rotation, axis, i, noise);
    result.undetermined += height.undetermined;
    if (std::ssize(height.circles) <= height.undetermined) continue;
    result.mean.used_observations.insert(result.mean.used_observations.end(),
                                         height.observations.begin(), height.observations.end());
    result.circles.insert(result.circles.end(), height.circles.begin(), height.circles.end());
    squares += height.squares;
    freedom += height.freedom;
  }
  if (result.circles.empty()) return result;
  const double count = static_cast<double>(result.circles.size());
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  for (const LampCircle& circle : result.circles) {
    mean += circle.fit.circle.center / count;
    covariance += circle.fit.center_covariance / (count * count);
  }
  if (covariance.allFinite()) result.mean.covariance = covariance;
  double spread = 0;
  for (const LampCircle& circle : result.circles) {
    spread += (circle.fit.circle.center - mean).squaredNorm();
  }
  result.spread_px = focal_px * std::sqrt(spread / count);
  result.mean.converged = true;
  result.mean.center = make_rotation_center(mean, RotationModel::shift, camera);
  result.mean.residual_px = freedom > 0 ? focal_px * std::sqrt(squares / freedom) : 0;
  return result;
}

}  // namespace vlp
