// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/levelling/levelling_rounds.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "calibration/levelling/levelling_checks.h"
#include "calibration/levelling/map_gauge.h"
#include "calibration/levelling/measured_lamps.h"
#include "geometry/robust_scatter.h"

namespace vlp {
namespace {

using Capture = LampBundle::Capture;
using Observation = LampBundle::Observation;

LampBundle place(const std::vector<MeasuredCapture>& measured,
                 const std::vector<Eigen::Vector3d>& lamps_m,
                 const Eigen::Matrix3d& level_from_camera) {
  LampBundle bundle{level_from_camera, lamps_m, {}};
  for (const MeasuredCapture& one : measured) {
    if (auto capture = placed_capture(one, lamps_m, level_from_camera)) {
      bundle.captures.push_back(std::move(*capture));
    }
  }
  return bundle;
}

/// Tilt, and the map's free directions where it is to be refined.
Eigen::MatrixXd free_directions(const LampBundle& bundle, bool refine_map) {
  const auto rows = static_cast<Eigen::Index>(2 + 3 * bundle.lamps_m.size());
  const Eigen::MatrixXd map = refine_map ? map_directions(bundle.lamps_m, lamps_seen(bundle))
                                         : Eigen::MatrixXd(rows - 2, 0);
  Eigen::MatrixXd free = Eigen::MatrixXd::Zero(rows, 2 + map.cols());
  free.topLeftCorner<2, 2>().setIdentity();
  free.bottomRightCorner(rows - 2, map.cols()) = map;
  return free;
}

/// Takes the worst detection of each capture out that is beyond the limit; a capture left with
/// fewer than three lamps goes. Whether there was one.
bool take_out_worst(LampBundle& bundle, const BundleFit& fit) {
  constexpr double limit_sigmas = 5;
  constexpr double rounding = 1e-6;  // of a standard deviation: residuals without noise
  std::vector<double> squares;
  squares.reserve(detections_in(bundle));
  for (const Capture& capture : bundle.captures) {
    for (const Observation& seen : capture.seen) {
      squares.push_back(whitened_residual(bundle, capture, seen).squaredNorm());
    }
  }
  const double variance = robust_planar_variance(std::move(squares), fit.redundancy);
  const double limit =
      planar_outlier_bound(limit_sigmas, fit.redundancy) * std::max(variance, rounding * rounding);
  bool any = false;
  for (Capture& capture : bundle.captures) {
    const auto square = [&](const Observation& seen) {
      return whitened_residual(bundle, capture, seen).squaredNorm();
    };
    const auto worst = std::max_element(
        capture.seen.begin(), capture.seen.end(),
        [&](const Observation& a, const Observation& b) { return square(a) < square(b); });
    if (square(*worst) <= limit) continue;
    any = true;
    capture.seen.erase(worst);
  }
  std::erase_if(bundle.captures, [](const Capture& capture) { return capture.seen.size() < 3; });
  return any;
}

/// Least squares without what contradicts the rest.
LevellingSolution solve(LampBundle bundle, const LampMap& map, bool refine_map) {
  const std::vector<Eigen::Vector3d> lamps_m = bundle.lamps_m;
  for (;;) {
    bundle.lamps_m = lamps_m;
    if (!undetermined_by(bundle, map, refine_map).empty()) return {std::move(bundle), {}};
    auto fit = adjust(bundle, free_directions(bundle, refine_map));
    if (!fit || fit->degrees_of_freedom <= 0 || !take_out_worst(bundle, *fit)) {
      return {std::move(bundle), std::move(fit)};
    }
  }
}

}  // namespace

LevellingSolution solve_in_rounds(const std::vector<MeasuredCapture>& measured, const LampMap& map,
                                  const std::vector<Eigen::Vector3d>& lamps_m, bool refine_map) {
  constexpr int max_rounds = 6;
  LevellingSolution solution{{Eigen::Matrix3d::Identity(), lamps_m, {}}, {}};
  std::size_t detections = 0;
  for (int round = 0; round < max_rounds; ++round) {
    solution = solve(place(measured, lamps_m, solution.bundle.level_from_camera), map, refine_map);
    const std::size_t now = detections_in(solution.bundle);
    if (!solution.fit || now == detections) break;
    detections = now;
  }
  return solution;
}

}  // namespace vlp
