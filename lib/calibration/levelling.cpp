// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/levelling.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "calibration/levelling_checks.h"
#include "calibration/map_gauge.h"
#include "calibration/measured_lamps.h"
#include "camera/lens.h"
#include "positioning/weighted_fix.h"

namespace vlp {
namespace {

using Capture = LampBundle::Capture;
using Seen = LampBundle::Seen;

/// What there is of one capture; empty when it is of no use.
using Measured = std::vector<std::vector<Seen>>;

struct Solution {
  LampBundle bundle;
  std::optional<BundleFit> fit;
};

LampBundle place(const Measured& measured, const std::vector<Eigen::Vector3d>& lamps_m,
                 const Eigen::Matrix3d& level_from_camera) {
  LampBundle bundle{level_from_camera, lamps_m, {}};
  for (const auto& seen : measured) {
    if (auto capture = placed_capture(seen, lamps_m, level_from_camera)) {
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
    for (const Seen& seen : capture.seen) {
      squares.push_back(whitened_residual(bundle, capture, seen).squaredNorm());
    }
  }
  const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
  std::nth_element(squares.begin(), middle, squares.end());
  const double median_of_unit_noise = 2 * std::log(2.0);
  const double share_left = fit.degrees_of_freedom / (2.0 * static_cast<double>(squares.size()));
  const double limit = limit_sigmas * limit_sigmas *
                       std::max(*middle / (median_of_unit_noise * share_left), rounding * rounding);
  bool any = false;
  for (Capture& capture : bundle.captures) {
    const auto square = [&](const Seen& seen) {
      return whitened_residual(bundle, capture, seen).squaredNorm();
    };
    const auto worst =
        std::max_element(capture.seen.begin(), capture.seen.end(),
                         [&](const Seen& a, const Seen& b) { return square(a) < square(b); });
    if (square(*worst) <= limit) continue;
    any = true;
    capture.seen.erase(worst);
  }
  std::erase_if(bundle.captures, [](const Capture& capture) { return capture.seen.size() < 3; });
  return any;
}

/// Least squares without what contradicts the rest.
Solution solve(LampBundle bundle, const LampMap& map, bool refine_map) {
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

/// Sees the captures anew with each tilt found, since a tilt makes good lamps look wrong, until
/// the same detections agree.
Solution solve_in_rounds(const Measured& measured, const LampMap& map,
                         const std::vector<Eigen::Vector3d>& lamps_m, bool refine_map) {
  constexpr int max_rounds = 6;
  Solution solution{{Eigen::Matrix3d::Identity(), lamps_m, {}}, {}};
  std::size_t detections = 0;
  for (int round = 0; round < max_rounds; ++round) {
    solution = solve(place(measured, lamps_m, solution.bundle.level_from_camera), map, refine_map);
    const std::size_t now = detections_in(solution.bundle);
    if (!solution.fit || now == detections) break;
    detections = now;
  }
  return solution;
}

double square_px(const Lens& lens, const Eigen::Vector2d& z, const Eigen::Vector2d& expected) {
  return lens.focal_px().cwiseProduct(z - expected).squaredNorm();
}

double residual_px(const LampBundle& bundle, const Lens& lens, int degrees_of_freedom) {
  double sum = 0;
  for (const Capture& capture : bundle.captures) {
    for (const Seen& seen : capture.seen) {
      const Eigen::Vector2d expected =
          seen.z_in_camera - seen.whitening.inverse() * whitened_residual(bundle, capture, seen);
      sum += square_px(lens, seen.z_in_camera, expected);
    }
  }
  return std::sqrt(sum / degrees_of_freedom);
}

/// Of the same detections if the camera were level and the map as it was.
double residual_before_px(const LampBundle& bundle, const std::vector<Eigen::Vector3d>& lamps_m,
                          const Lens& lens) {
  double sum = 0, degrees_of_freedom = 0;
  std::vector<Sighting> sightings;
  for (const Capture& capture : bundle.captures) {
    sightings.clear();
    for (const Seen& seen : capture.seen) {
      sightings.push_back({lamps_m[seen.lamp], seen.z_in_camera, seen.whitening, 1});
    }
    const auto fix = fix_weighted(sightings, capture.camera.pose());
    if (!fix) continue;
    const LevelPose camera(fix->pose);
    for (const Sighting& sighting : sightings) {
      sum += square_px(lens, sighting.z, predicted_z(camera, sighting.lamp_m));
    }
    degrees_of_freedom += 2 * static_cast<double>(sightings.size()) - 4;
  }
  return degrees_of_freedom > 0 ? std::sqrt(sum / degrees_of_freedom) : 0;
}

/// Of the image of the zenith u = level_from_camera^T e_z, which a tilt w moves by
/// level_from_camera^T (e_z x w).
RotationCenter center_of(const Eigen::Matrix3d& level_from_camera, const Matrix2& tilt_covariance,
                         const Lens& lens) {
  const Eigen::Vector3d zenith = level_from_camera.row(2).transpose();
  const Eigen::Vector2d z = zenith.head<2>() / zenith.z();
  Eigen::Matrix<double, 2, 3> d_z;
  d_z << 1 / zenith.z(), 0, -z.x() / zenith.z(), 0, 1 / zenith.z(), -z.y() / zenith.z();
  Eigen::Matrix<double, 3, 2> turn;
  turn << 0, -1, 1, 0, 0, 0;
  const Eigen::Matrix2d d_pixel =
      lens.focal_px().asDiagonal() * d_z * level_from_camera.transpose() * turn;
  Matrix2 covariance = d_pixel * tilt_covariance * d_pixel.transpose();
  covariance(1, 0) = covariance(0, 1);
  return {RotationModel::tilt, lens.center_px() + lens.focal_px().cwiseProduct(z),
          zenith.normalized(), covariance};
}

bool all_stated(std::span<const Frame> frames) {
  return std::all_of(frames.begin(), frames.end(), [](const Frame& frame) {
    return std::all_of(frame.detections.begin(), frame.detections.end(),
                       [](const Detection& detection) { return detection.sigma_px.has_value(); });
  });
}

void report_lamps(Levelling& result, const LampBundle& bundle, const LampMap& map,
                  const std::vector<Eigen::Vector3d>& lamps_m, const Eigen::MatrixXd& covariance) {
  const std::vector<bool> seen = lamps_seen(bundle);
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (!seen[i]) continue;
    const Eigen::Vector3d correction_m = bundle.lamps_m[i] - lamps_m[i];
    const Eigen::Vector3d sd_m =
        covariance.diagonal().segment<3>(static_cast<Eigen::Index>(2 + 3 * i)).cwiseSqrt();
    result.map.lamps[i].position_m += correction_m;
    result.corrections.push_back({map.lamps[i].id, correction_m, sd_m});
  }
}

}  // namespace

Levelling level_by_lamps(std::span<const Frame> frames, const LampMap& map, const Camera& camera,
                         const LevellingOptions& options) {
  const Lens lens(camera.lens_model, camera.intrinsics);
  Levelling result;
  result.map = map;
  // From their mean, so that a map in national coordinates loses no digits.
  std::vector<Eigen::Vector3d> lamps_m;
  lamps_m.reserve(map.lamps.size());
  Eigen::Vector3d mean_m = Eigen::Vector3d::Zero();
  for (const Lamp& lamp : map.lamps) mean_m += lamp.position_m - map.lamps.front().position_m;
  mean_m = map.lamps.front().position_m + mean_m / static_cast<double>(map.lamps.size());
  for (const Lamp& lamp : map.lamps) lamps_m.emplace_back(lamp.position_m - mean_m);
  Measured measured;
  for (const Frame& frame : frames) {
    auto seen = measured_lamps(frame.detections, map, lens);
    if (!seen) {
      ++result.captures_rejected;
    } else if (seen->size() < 3) {
      ++result.captures_of_few_lamps;
    } else {
      result.detections_rejected += static_cast<int>(seen->size());
      measured.push_back(std::move(*seen));
    }
  }

  const auto [bundle, fit] = solve_in_rounds(measured, map, lamps_m, options.refine_map);
  result.captures = static_cast<int>(bundle.captures.size());
  result.captures_rejected += static_cast<int>(measured.size()) - result.captures;
  result.detections = static_cast<int>(detections_in(bundle));
  result.detections_rejected -= result.detections;
  result.undetermined = undetermined_by(bundle, map, options.refine_map);
  if (!result.undetermined.empty()) return result;
  if (!fit || fit->degrees_of_freedom <= 0) {
    result.undetermined = kTooWeak;
    return result;
  }
  const double excess = fit->chi_squared / fit->degrees_of_freedom;
  const bool stated = all_stated(frames);
  const Eigen::MatrixXd covariance = fit->covariance * (stated ? std::max(excess, 1.0) : excess);
  if (stated) result.excess = std::sqrt(excess);
  result.center = center_of(bundle.level_from_camera, covariance.topLeftCorner<2, 2>(), lens);
  result.residual_px = residual_px(bundle, lens, fit->degrees_of_freedom);
  result.residual_before_px = residual_before_px(bundle, lamps_m, lens);
  if (options.refine_map) report_lamps(result, bundle, map, lamps_m, covariance);
  result.undetermined = too_loose(result, covariance.topLeftCorner<2, 2>(), options);
  return result;
}

}  // namespace vlp
