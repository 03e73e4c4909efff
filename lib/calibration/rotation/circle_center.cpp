// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/circle_center.h"

#include <Eigen/Geometry>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <optional>

#include "calibration/rotation/fit_parts.h"
#include "geometry/median.h"

namespace vlp {
namespace {

/// The places of one lamp at one height, in units of the focal length.
struct Trace {
  std::vector<std::size_t> sightings;
  std::vector<Eigen::Vector2d> points;
};

Trace trace_of(const SpotCaptures& spot, std::size_t lamp, std::size_t height) {
  Trace trace;
  for (std::size_t i = 0; i < spot.sightings.size(); ++i) {
    const SpotObservation& sighting = spot.sightings[i];
    if (sighting.lamp != lamp || spot.captures[sighting.capture].height != height) continue;
    if (!(sighting.ray.z() > 0)) continue;
    trace.sightings.push_back(i);
    trace.points.emplace_back(sighting.ray.hnormalized());
  }
  return trace;
}

std::vector<double> distances(const Circle& circle, const std::vector<Eigen::Vector2d>& points) {
  std::vector<double> off;
  off.reserve(points.size());
  for (const Eigen::Vector2d& point : points) {
    off.push_back(std::abs((point - circle.center).norm() - circle.radius));
  }
  return off;
}

/// Of circles through three of the points, the one with the least median distance of all (least
/// median of squares, Rousseeuw 1984), from a fixed choice of triples.
std::optional<Circle> typical_circle(const std::vector<Eigen::Vector2d>& points) {
  constexpr int triples = 200;
  std::optional<Circle> best;
  double least = 0;
  std::uint32_t state = 1;
  const auto next = [&] {
    state = state * 1664525 + 1013904223;
    return points[(state >> 8) % points.size()];
  };
  for (int i = 0; i < triples; ++i) {
    const std::array<Eigen::Vector2d, 3> triple{next(), next(), next()};
    const auto fit = fit_circle(triple);
    if (!fit) continue;
    const double median = upper_median(distances(fit->circle, points));
    if (!best || median < least) best = fit->circle, least = median;
  }
  return best;
}

/// The circle without the points that contradict it, which are added to `outliers` and leave
/// `trace`.
std::optional<CircleFit> trimmed_circle(Trace& trace, double focal_px,
                                        std::vector<SpotOutlier>& outliers) {
  constexpr double rounding = 1e-9, far = 4.5, sigma_over_median = 1.4826;
  auto fit = fit_circle(trace.points);
  // Of fewer the median distance from a circle through three of them says too little.
  constexpr std::size_t least_to_judge = 8;
  if (!fit || trace.points.size() < least_to_judge) return fit;
  auto circle = typical_circle(trace.points);
  const double count = static_cast<double>(trace.points.size());
  std::vector<double> off;
  double limit = 0;
  for (int round = 0; circle && round < 4; ++round) {
    off = distances(*circle, trace.points);
    // Rousseeuw's factor for few points.
    limit = far * std::max(sigma_over_median * (1 + 5 / (count - 3)) * upper_median(off), rounding);
    std::vector<Eigen::Vector2d> near;
    near.reserve(off.size());
    for (std::size_t i = 0; i < off.size(); ++i) {
      if (off[i] <= limit) near.push_back(trace.points[i]);
    }
    const auto better = fit_circle(near);
    if (!better) break;
    fit = better;
    circle = better->circle;
  }
  for (std::size_t i = off.size(); i-- > 0;) {
    if (off[i] <= limit) continue;
    outliers.push_back({trace.sightings[i], off[i] * focal_px});
    trace.points.erase(trace.points.begin() + static_cast<std::ptrdiff_t>(i));
  }
  return fit;
}

}  // namespace

CircleCenters fit_circle_centers(const SpotCaptures& spot, const Camera& camera) {
  assert(spot.status == SpotStatus::ok);
  CircleCenters result;
  const double focal_px = camera.focal_px().x();
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  double squares = 0, freedom = 0;
  for (std::size_t height = 0; height < spot.heights.size(); ++height) {
    for (std::size_t lamp = 0; lamp < spot.lamps.size(); ++lamp) {
      Trace trace = trace_of(spot, lamp, height);
      const auto fit = trimmed_circle(trace, focal_px, result.mean.outliers);
      if (!fit || !fit->converged) continue;
      result.circles.push_back({lamp, height, *fit});
      sum += fit->circle.center;
      covariance += fit->center_covariance;
      squares += fit->rms * fit->rms * static_cast<double>(trace.points.size());
      freedom += static_cast<double>(trace.points.size()) - 3;
    }
  }
  if (result.circles.empty()) return result;
  const double count = static_cast<double>(result.circles.size());
  const Eigen::Vector2d mean = sum / count;
  covariance /= count * count;
  std::optional<Matrix2> measured;
  if (covariance.allFinite()) measured = covariance;
  double spread = 0;
  for (const LampCircle& circle : result.circles) {
    spread += (circle.fit.circle.center - mean).squaredNorm();
  }
  result.spread_px = focal_px * std::sqrt(spread / count);
  result.mean.converged = true;
  result.mean.center = rotation_center_at(mean, RotationModel::shift, camera, measured);
  result.mean.residual_px = freedom > 0 ? focal_px * std::sqrt(squares / freedom) : 0;
  result.mean.yaws_rad = yaws_of(spot);
  return result;
}

}  // namespace vlp
