// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/rotation_fit.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

#include "calibration/adjustment/adjustment.h"
#include "geometry/frames.h"

namespace vlp {
namespace {

bool has_lamp_heights(const RotationCaptures& rotation) {
  const auto [lowest, highest] = std::minmax_element(
      rotation.lamps.begin(), rotation.lamps.end(),
      [](const Lamp& a, const Lamp& b) { return a.position_m.z() < b.position_m.z(); });
  const double height_m = highest->position_m.z() - rotation.heights.front().z_m;
  return highest->position_m.z() - lowest->position_m.z() > kMinHeightGapFraction * height_m;
}

bool determines_lever_arm(const RotationFit& fit, const RotationCaptures& rotation) {
  if (!fit.center.lever_arm_m) return false;
  const double height_m = rotation.lamps.front().position_m.z() - rotation.heights.front().z_m;
  return std::sqrt(fit.covariance->diagonal().tail<2>().maxCoeff()) <=
         kMaxLeverArmSdFraction * height_m;
}

AdjustmentInput make_adjustment_input(const RotationCaptures& rotation, const Camera& camera,
                                      const std::optional<MatrixX>& lens_covariance,
                                      bool lever_arm) {
  AdjustmentInput input{{}, {rotation.lamps}, {}};
  input.calibration.camera = camera;
  input.calibration.intrinsics_report.emplace().covariance = lens_covariance;
  input.lens_is_held = true;
  RotationCenter& center = input.calibration.rotation_center.emplace();
  center.zenith_in_camera = rotation.zenith_in_camera;
  if (lever_arm) center.lever_arm_m = rotation.lever_arm_m;
  input.map_prior = MapPrior::heights;
  input.estimates_lever_arm = lever_arm;
  for (const RotationCapture& capture : rotation.captures) {
    const RotationHeight& height = rotation.heights[capture.height];
    Pose pose{{height.axis_m.x(), height.axis_m.y(), height.z_m}, capture.yaw_rad};
    if (lever_arm) {
      pose.position_m.head<2>() +=
          rotation_about_z(capture.yaw_rad).topLeftCorner<2, 2>() * rotation.lever_arm_m;
    }
    AdjustmentCapture& added = input.captures.emplace_back();
    added.name = capture.image;
    added.pivot = std::to_string(capture.height);
    added.initial_pose = pose;
  }
  for (const RotationObservation& observation : rotation.observations) {
    input.captures[observation.capture].detections.push_back(
        {rotation.lamps[observation.lamp].id, observation.pixel, observation.sigma_px});
  }
  return input;
}

/// Fits the axis with an estimated lever arm, or with a lever arm of zero.
RotationFit fit_axis(const RotationCaptures& rotation, const Camera& camera,
                     const std::optional<MatrixX>& lens_covariance, bool lever_arm) {
  constexpr double no_limit = std::numeric_limits<double>::infinity();
  const AdjustmentResult adjusted = adjust_bundle(
      make_adjustment_input(rotation, camera, lens_covariance, lever_arm), {no_limit, no_limit});
  RotationFit result;
  result.converged = adjusted.has_succeeded();
  if (!result.converged) return result;
  result.center = adjusted.center;
  result.covariance = adjusted.center_covariance;
  if (lens_covariance) result.joint_covariance = adjusted.lens_and_center_covariance();
  result.residual_px = adjusted.residual_px;
  for (const AdjustmentResult::DetectionResidual& residual : adjusted.residuals) {
    const auto is_same = [&](const RotationObservation& observation) {
      return observation.capture == residual.capture &&
             rotation.lamps[observation.lamp].id == residual.lamp;
    };
    const auto index = static_cast<std::size_t>(
        std::ranges::find_if(rotation.observations, is_same) - rotation.observations.begin());
    if (residual.is_used) {
      result.used_observations.push_back(index);
    } else {
      result.outliers.push_back({index, residual.distance_px});
    }
  }
  return result;
}

}  // namespace

Tilt compute_tilt(const RotationCenter& center) {
  const Eigen::Vector3d& up = center.zenith_in_camera;
  return {std::atan2(up.head<2>().norm(), up.z()), std::atan2(up.y(), up.x())};
}

Eigen::Vector2d ideal_pixel_from_point(const Camera& camera, const Eigen::Vector2d& z) {
  const Eigen::Vector2d focal_px = camera.focal_px();
  return focal_px.cwiseProduct(z) + camera.principal_point_px();
}

RotationCenter make_rotation_center(const Eigen::Vector2d& z, RotationModel model,
                                    const Camera& camera) {
  return {model, ideal_pixel_from_point(camera, z), z.homogeneous().normalized()};
}

RotationFit fit_rotation_axis(const RotationCaptures& rotation, const Camera& camera,
                              const std::optional<MatrixX>& lens_covariance) {
  assert(rotation.status == RotationStatus::ok);
  RotationFit result;
  if (rotation.heights.size() > 1) {
    result = fit_axis(rotation, camera, lens_covariance, true);
  } else {
    if (has_lamp_heights(rotation)) result = fit_axis(rotation, camera, lens_covariance, true);
    if (!determines_lever_arm(result, rotation))
      result = fit_axis(rotation, camera, lens_covariance, false);
  }
  if (!result.converged) return result;
  // The model is exact. Large residuals mean that the captures are no rotation about one axis.
  constexpr double max_residual_fraction = 0.007, max_noise_ratio = 4;
  const double max_px = std::max(max_residual_fraction * camera.focal_px().x(),
                                 max_noise_ratio * rotation.median_sigma_px.value_or(0));
  return result.residual_px > max_px ? RotationFit() : result;
}

}  // namespace vlp
