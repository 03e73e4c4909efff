// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/levelling/levelling.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "calibration/levelling/lamp_equations.h"
#include "calibration/levelling/levelling_checks.h"
#include "calibration/levelling/levelling_rounds.h"
#include "calibration/levelling/measured_lamps.h"
#include "camera/lens.h"
#include "geometry/plane.h"
#include "positioning/least_squares_fix.h"

namespace vlp {
namespace {

using Capture = LampBundle::Capture;
using Observation = LampBundle::Observation;

double square_px(const Lens& lens, const Eigen::Vector2d& z, const Eigen::Vector2d& expected) {
  return lens.focal_px().cwiseProduct(z - expected).squaredNorm();
}

double residual_px(const LampBundle& bundle, const Lens& lens, double degrees_of_freedom) {
  double sum = 0;
  for (const Capture& capture : bundle.captures) {
    for (const Observation& seen : capture.seen) {
      const Eigen::Vector2d expected =
          seen.z_in_camera - seen.whitening.inverse() * whitened_residual(bundle, capture, seen);
      sum += square_px(lens, seen.z_in_camera, expected);
    }
  }
  return std::sqrt(sum / degrees_of_freedom);
}

/// Where a camera that stands there would see the lamp as this one does.
Eigen::Vector3d where_seen(const Capture& capture, const Observation& seen,
                           const Eigen::Vector3d& lamp_m) {
  if (capture.velocity_m_per_s.isZero(0) && capture.yaw_rate_rad_per_s == 0) return lamp_m;
  const Eigen::Vector3d level = x_in_level(capture, seen, lamp_m);
  Eigen::Vector3d seen_m = lamp_m;
  seen_m.head<2>() = capture.camera.position_m.head<2>() +
                     complex_product(capture.camera.heading, level.head<2>());
  return seen_m;
}

/// Of the same detections if the camera were level and the map as it was.
double residual_before_px(const LampBundle& bundle, const std::vector<Eigen::Vector3d>& lamps_m,
                          const Lens& lens) {
  double sum = 0, degrees_of_freedom = 0;
  std::vector<Sighting> sightings;
  for (const Capture& capture : bundle.captures) {
    sightings.clear();
    for (const Observation& seen : capture.seen) {
      sightings.push_back(
          {where_seen(capture, seen, lamps_m[seen.lamp]), seen.z_in_camera, seen.whitening, 1});
    }
    const auto fix = fix_least_squares(sightings, capture.camera.pose());
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

/// Covariance of tilt and lamps from pixel noise, which follows the residuals, and, if the map is
/// held, from the errors that it states. Their part of the residuals is no noise.
Eigen::MatrixXd covariance_of(const BundleFit& fit, const LampMap& map, bool noise_is_stated,
                              bool refine_map) {
  Eigen::VectorXd lamp_variances = Eigen::VectorXd::Zero(fit.covariance.rows() - 2);
  for (std::size_t i = 0; i < map.lamps.size() && !refine_map; ++i) {
    const double sd_m = map.lamps[i].sd_m.value_or(0);
    lamp_variances.segment<3>(static_cast<Eigen::Index>(3 * i)).setConstant(sd_m * sd_m);
  }
  const double of_map = fit.d_chi_squared_d_lamp_squares.dot(lamp_variances);
  const double noise =
      std::max((fit.chi_squared - of_map) / fit.degrees_of_freedom, noise_is_stated ? 1.0 : 0.0);
  Eigen::MatrixXd covariance = noise * fit.covariance;
  covariance.topLeftCorner<2, 2>() +=
      fit.d_tilt_d_lamps * lamp_variances.asDiagonal() * fit.d_tilt_d_lamps.transpose();
  return covariance;
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
  const auto row_clock = row_clock_of(camera);
  std::vector<MeasuredCapture> measured;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    auto seen = measured_lamps(frames[i].detections, map, lens, row_clock);
    if (!seen) {
      ++result.captures_rejected;
    } else if (seen->size() < 3) {
      ++result.captures_of_few_lamps;
    } else {
      result.detections_rejected += static_cast<int>(seen->size());
      measured.push_back(
          {std::move(*seen), options.motions.empty() ? KnownMotion() : options.motions[i]});
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
  const Eigen::MatrixXd covariance = covariance_of(*fit, map, stated, options.refine_map);
  if (stated) result.excess = std::sqrt(excess);
  result.center = center_of(bundle.level_from_camera, covariance.topLeftCorner<2, 2>(), lens);
  result.residual_px = residual_px(bundle, lens, fit->redundancy);
  result.residual_before_px = residual_before_px(bundle, lamps_m, lens);
  if (options.refine_map) report_lamps(result, bundle, map, lamps_m, covariance);
  result.undetermined = too_loose(result, covariance.topLeftCorner<2, 2>(), options);
  return result;
}

}  // namespace vlp
