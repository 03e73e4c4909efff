// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/circle_center.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

#include "calibration/rotation/rotation_fit.h"
#include "geometry/median.h"
#include "geometry/robust_scatter.h"
#include "geometry/symmetric.h"

namespace vlp {
namespace {

/// Observations of one lamp at one height, in units of the focal length.
struct Trace {
  std::vector<std::size_t> observations;
  std::vector<Eigen::Vector2d> points;
};

Trace collect_lamp_trace(const RotationCaptures& rotation, std::size_t lamp, std::size_t height) {
  Trace trace;
  for (std::size_t i = 0; i < rotation.observations.size(); ++i) {
    const RotationObservation& observation = rotation.observations[i];
    if (observation.lamp != lamp || rotation.captures[observation.capture].height != height)
      continue;
    if (!(observation.ray.z() > 0)) continue;
    trace.observations.push_back(i);
    trace.points.emplace_back(observation.ray.hnormalized());
  }
  return trace;
}

std::vector<double> compute_distances(const Circle& circle,
                                      const std::vector<Eigen::Vector2d>& points) {
  std::vector<double> off;
  off.reserve(points.size());
  for (const Eigen::Vector2d& point : points) {
    off.push_back(std::abs((point - circle.center).norm() - circle.radius));
  }
  return off;
}

/// Returns the circle through three of the points that has the smallest median distance to all
/// points (least median of squares, Rousseeuw 1984). Tries a fixed sequence of triples.
std::optional<Circle> fit_median_circle(const std::vector<Eigen::Vector2d>& points) {
  constexpr int triples = 200;
  std::optional<Circle> best;
  double min_median = 0;
  std::uint32_t state = 1;
  const auto next = [&] {
    state = state * 1664525 + 1013904223;
    return points[(state >> 8) % points.size()];
  };
  for (int i = 0; i < triples; ++i) {
    const std::array<Eigen::Vector2d, 3> triple{next(), next(), next()};
    const auto fit = fit_circle(triple);
    if (!fit) continue;
    const double median = upper_median(compute_distances(fit->circle, points));
    if (!best || median < min_median) best = fit->circle, min_median = median;
  }
  return best;
}

constexpr double kOutlierSigmas = 4.5;
/// Fewer points have too little redundancy to find an outlier.
constexpr std::size_t kMinPointsToTest = 8;

/// Moves a point of the trace to `outliers`.
void reject(Trace& trace, std::size_t point, double distance_px,
            std::vector<RotationOutlier>& outliers) {
  outliers.push_back({trace.observations[point], distance_px});
  trace.observations.erase(trace.observations.begin() + static_cast<std::ptrdiff_t>(point));
  trace.points.erase(trace.points.begin() + static_cast<std::ptrdiff_t>(point));
}

/// Rejects points far from the circle on which most points agree.
void reject_gross_outliers(Trace& trace, double focal_px, std::vector<RotationOutlier>& outliers) {
  constexpr double rounding = 1e-9;
  auto circle = fit_median_circle(trace.points);
  const double freedom = static_cast<double>(trace.points.size()) - 3;
  std::vector<double> off;
  double limit = 0;
  for (int iteration = 0; circle && iteration < 4; ++iteration) {
    off = compute_distances(*circle, trace.points);
    std::vector<double> squares;
    squares.reserve(off.size());
    for (const double one : off) squares.push_back(one * one);
    const double variance =
        std::max(estimate_robust_variance_1d(std::move(squares), freedom), rounding * rounding);
    limit = std::sqrt(compute_squared_outlier_bound_1d(kOutlierSigmas, freedom) * variance);
    std::vector<Eigen::Vector2d> near;
    near.reserve(off.size());
    for (std::size_t i = 0; i < off.size(); ++i) {
      if (off[i] <= limit) near.push_back(trace.points[i]);
    }
    const auto better = fit_circle(near);
    if (!better) break;
    circle = better->circle;
  }
  for (std::size_t i = off.size(); i-- > 0;) {
    if (off[i] > limit) reject(trace, i, off[i] * focal_px, outliers);
  }
}

/// Rejects the point that is farthest from the circle if the circle through the other points
/// contradicts it (Student's t of the deleted residual). Returns true if a point was rejected.
bool reject_worst_point_of_trace(Trace& trace, const Circle& circle, double focal_px,
                                 std::vector<RotationOutlier>& outliers) {
  constexpr double rounding = 1e-9;
  const std::vector<double> off = compute_distances(circle, trace.points);
  const auto worst =
      static_cast<std::size_t>(std::max_element(off.begin(), off.end()) - off.begin());
  std::vector<Eigen::Vector2d> others = trace.points;
  others.erase(others.begin() + static_cast<std::ptrdiff_t>(worst));
  const auto fit = fit_circle(others);
  if (!fit) return false;
  const double count = static_cast<double>(others.size()), freedom = count - 3;
  // The variance of the circle at the point is 3 / n of that of a point, on average.
  const double variance =
      std::max(fit->rms * fit->rms * count / freedom, rounding * rounding) * (1 + 3 / count);
  const double distance = compute_distances(fit->circle, {trace.points[worst]}).front();
  if (distance * distance <= compute_squared_student_t_bound(kOutlierSigmas, freedom) * variance)
    return false;
  reject(trace, worst, distance * focal_px, outliers);
  return true;
}

/// Fits a circle without outliers and moves them from `trace` to `outliers`. Returns std::nullopt
/// if the points do not determine a circle.
std::optional<CircleFit> fit_trimmed_circle(Trace& trace, double focal_px,
                                            std::vector<RotationOutlier>& outliers) {
  if (trace.points.size() >= kMinPointsToTest) reject_gross_outliers(trace, focal_px, outliers);
  auto fit = fit_circle(trace.points);
  while (fit && trace.points.size() >= kMinPointsToTest &&
         reject_worst_point_of_trace(trace, fit->circle, focal_px, outliers)) {
    fit = fit_circle(trace.points);
  }
  return fit;
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
bool is_circle_center_determined(const Circle& circle, const std::vector<Eigen::Vector2d>& points,
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
  const auto [values, axes] = eigendecompose_symmetric_matrix(information);
  const double variance = noise * noise / (circle.radius * circle.radius);
  for (Eigen::Index i = 0; i < 2; ++i) {
    const double from_noise = variance * axes.col(i).dot(tangents * axes.col(i));
    if (!(from_noise <= max_noise_fraction * values[i])) return false;
  }
  return true;
}

/// Circles of all lamps at one height.
struct HeightCircles {
  std::vector<LampCircle> circles;
  /// Observations of each circle, without outliers.
  std::vector<Trace> traces;
  std::vector<RotationOutlier> outliers;
  /// Number of lamps with three observations or more and no circle.
  int without_circle = 0;
  /// Sum of the squared distances from the circles, and its degrees of freedom.
  double squares = 0, freedom = 0;
};

HeightCircles fit_circles(const RotationCaptures& rotation, std::size_t height, double focal_px) {
  HeightCircles result;
  for (std::size_t lamp = 0; lamp < rotation.lamps.size(); ++lamp) {
    Trace trace = collect_lamp_trace(rotation, lamp, height);
    const auto fit = fit_trimmed_circle(trace, focal_px, result.outliers);
    if (trace.points.size() < 3) continue;
    if (!fit || !fit->converged) {
      ++result.without_circle;
      continue;
    }
    const double count = static_cast<double>(trace.points.size());
    result.circles.push_back({lamp, height, *fit});
    result.traces.push_back(std::move(trace));
    result.squares += fit->rms * fit->rms * count;
    result.freedom += count - 3;
  }
  return result;
}

/// Estimates the noise of a coordinate in units of the focal length. Uses the circles, or the
/// axis if all circles have three points. Returns at least the given noise, and std::nullopt if
/// neither residuals nor detections determine it.
std::optional<double> estimate_noise(const std::vector<HeightCircles>& heights,
                                     const RotationCaptures& rotation, const Camera& camera) {
  const double focal_px = camera.focal_px().x();
  double squares = 0, freedom = 0;
  for (const HeightCircles& height : heights) {
    squares += height.squares;
    freedom += height.freedom;
  }
  std::optional<double> noise;
  if (freedom > 0) {
    noise = std::sqrt(squares / freedom);
  } else if (const RotationFit axis = fit_rotation_axis(rotation, camera); axis.converged) {
    noise = axis.residual_px / focal_px;
  }
  if (rotation.median_sigma_px)
    noise = std::max(noise.value_or(0), *rotation.median_sigma_px / focal_px);
  return noise;
}

}  // namespace

CircleCenters fit_and_average_lamp_circle_centers(const RotationCaptures& rotation,
                                                  const Camera& camera) {
  assert(rotation.status == RotationStatus::ok);
  CircleCenters result;
  const double focal_px = camera.focal_px().x();
  std::vector<HeightCircles> heights;
  for (std::size_t height = 0; height < rotation.heights.size(); ++height) {
    heights.push_back(fit_circles(rotation, height, focal_px));
  }
  const std::optional<double> noise = estimate_noise(heights, rotation, camera);
  double squares = 0, freedom = 0;
  for (const HeightCircles& height : heights) {
    std::vector<LampCircle> determined;
    std::vector<std::size_t> observations;
    for (std::size_t i = 0; i < height.circles.size() && noise; ++i) {
      const LampCircle& circle = height.circles[i];
      const Trace& trace = height.traces[i];
      if (!is_circle_center_determined(circle.fit.circle, trace.points, *noise)) continue;
      determined.push_back(circle);
      observations.insert(observations.end(), trace.observations.begin(), trace.observations.end());
    }
    const int undetermined =
        height.without_circle + static_cast<int>(height.circles.size() - determined.size());
    result.undetermined += undetermined;
    if (std::ssize(determined) <= undetermined) continue;
    result.mean.used_observations.insert(result.mean.used_observations.end(), observations.begin(),
                                         observations.end());
    result.circles.insert(result.circles.end(), determined.begin(), determined.end());
    result.mean.outliers.insert(result.mean.outliers.end(), height.outliers.begin(),
                                height.outliers.end());
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
  result.mean.center = make_rotation_center_from_axis_point(mean, RotationModel::shift, camera);
  result.mean.residual_px = freedom > 0 ? focal_px * std::sqrt(squares / freedom) : 0;
  return result;
}

}  // namespace vlp
