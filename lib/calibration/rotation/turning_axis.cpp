// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/turning_axis.h"

#include <ceres/ceres.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <memory>

#include "calibration/rotation/fit_parts.h"
#include "calibration/rotation/robust_fit.h"
#include "calibration/rotation/spot_residual.h"
#include "geometry/similarity.h"

namespace vlp {
namespace {

/// The residual of fit_turning_axis(). Parameters: the zenith's normalized point in the camera (2),
/// the lever arm (2), the lamp's place on the ceiling (2), the axis and the height of the camera
/// (3), the yaw (1); all in the world but the first two.
struct AxisResidual {
  SpotResidual in_image;
  double lamp_z_m;

  template <typename T>
  bool operator()(const T* zenith, const T* lever_arm_m, const T* lamp_m, const T* axis_m,
                  const T* yaw_rad, T* residual) const {
    using std::cos, std::sin, std::sqrt;
    const T x = lamp_m[0] - axis_m[0], y = lamp_m[1] - axis_m[1];
    const T c = cos(*yaw_rad), s = sin(*yaw_rad);
    const Eigen::Matrix<T, 3, 1> in_level(c * x + s * y - lever_arm_m[0],
                                          c * y - s * x - lever_arm_m[1], lamp_z_m - axis_m[2]);
    // camera_from_level: the transpose of level_from_zenith(), the smallest turn of n to +Z.
    const T nz = 1.0 / sqrt(1.0 + zenith[0] * zenith[0] + zenith[1] * zenith[1]);
    const Eigen::Matrix<T, 3, 1> n(zenith[0] * nz, zenith[1] * nz, nz);
    const T across = (n[0] * in_level[0] + n[1] * in_level[1]) / (1.0 + nz);
    const T lift = in_level[2] - across;
    const Eigen::Matrix<T, 3, 1> in_camera(in_level[0] + n[0] * lift, in_level[1] + n[1] * lift,
                                           nz * in_level[2] - across * (1.0 + nz));
    in_image(in_camera, residual);
    return true;
  }

  static std::unique_ptr<ceres::CostFunction> create(const SpotObservation& sighting,
                                                     double lamp_z_m) {
    return std::make_unique<ceres::AutoDiffCostFunction<AxisResidual, 2, 2, 2, 2, 3, 1>>(
        new AxisResidual{SpotResidual(sighting), lamp_z_m});
  }
};

/// What is estimated, in the world.
struct State {
  Eigen::Vector2d zenith;
  Eigen::Vector2d lever_arm_m;
  std::vector<Eigen::Vector2d> lamps_m;
  std::vector<Eigen::Vector3d> axes_m;
  std::vector<double> yaws_rad;
};

State start_from(const SpotCaptures& spot) {
  State state{spot.zenith_in_camera.hnormalized(), spot.lever_arm_m, {}, {}, yaws_of(spot)};
  for (const Lamp& lamp : spot.lamps) state.lamps_m.emplace_back(lamp.position_m.head<2>());
  for (const SpotHeight& height : spot.heights) {
    state.axes_m.emplace_back(height.axis_m.x(), height.axis_m.y(), height.z_m);
  }
  return state;
}

void add_residuals(RobustFit& fit, const SpotCaptures& spot, bool lever_arm, State& state) {
  for (const SpotObservation& sighting : spot.sightings) {
    const std::size_t height = spot.captures[sighting.capture].height;
    fit.add(AxisResidual::create(sighting, spot.lamps[sighting.lamp].position_m.z()),
            {state.zenith.data(), state.lever_arm_m.data(), state.lamps_m[sighting.lamp].data(),
             state.axes_m[height].data(), &state.yaws_rad[sighting.capture]});
  }
  // Nothing shows where the world is, how it is turned, and, of lamps at one height, how large.
  fit.hold(state.axes_m.front().data());
  fit.hold_one_of(pointers_to(state.yaws_rad));
  if (!lever_arm) fit.hold(state.lever_arm_m.data());
}

/// Gives the world the size that the map has. True when it had that already.
bool scale_to_map(const SpotCaptures& spot, State& state) {
  const auto similarity = fit_similarity(
      spot.lamps.size(), [&](std::size_t i) { return state.lamps_m[i]; },
      [&](std::size_t i) { return Eigen::Vector2d(spot.lamps[i].position_m.head<2>()); });
  if (!similarity) return true;
  double lamps_z_m = 0;
  for (const Lamp& lamp : spot.lamps) lamps_z_m += lamp.position_m.z();
  lamps_z_m /= static_cast<double>(spot.lamps.size());
  const double scale = similarity->factor.norm();
  const Eigen::Vector3d fixed(state.axes_m[0].x(), state.axes_m[0].y(), lamps_z_m);
  for (Eigen::Vector3d& axis_m : state.axes_m) axis_m = fixed + scale * (axis_m - fixed);
  for (Eigen::Vector2d& lamp_m : state.lamps_m) {
    lamp_m = fixed.head<2>() + scale * (lamp_m - fixed.head<2>());
  }
  state.lever_arm_m *= scale;
  constexpr double same = 1e-9;
  return std::abs(scale - 1) < same;
}

bool lamps_at_several_heights(const SpotCaptures& spot) {
  const auto [lowest, highest] = std::minmax_element(
      spot.lamps.begin(), spot.lamps.end(),
      [](const Lamp& a, const Lamp& b) { return a.position_m.z() < b.position_m.z(); });
  const double height_m = highest->position_m.z() - spot.heights.front().z_m;
  return highest->position_m.z() - lowest->position_m.z() > kLeastGap * height_m;
}

bool tells_lever_arm(const RotationCenter& center, const SpotCaptures& spot) {
  if (!center.covariance || !center.lever_arm_covariance) return false;
  const double height_m = spot.lamps.front().position_m.z() - spot.heights.front().z_m;
  return std::sqrt(center.lever_arm_covariance->diagonal().maxCoeff()) <= kLooseLeverArm * height_m;
}

/// With the lever arm estimated, or held at zero.
RotationFit fit_axis(const SpotCaptures& spot, const Camera& camera, bool lever_arm) {
  State state = start_from(spot);
  if (!lever_arm) state.lever_arm_m.setZero();
  RobustFit fit(spot.stated_px.has_value());
  add_residuals(fit, spot, lever_arm, state);
  RotationFit result;
  constexpr int rounds = 10;
  for (int round = 0; round < rounds; ++round) {
    result.converged = round == 0 ? fit.solve() : fit.refine();
    if (!result.converged) return result;
    if (!lever_arm || scale_to_map(spot, state)) break;
  }
  const auto zenith_covariance = fit.covariance(state.zenith.data());
  result.center = rotation_center_at(state.zenith, RotationModel::tilt, camera, zenith_covariance);
  if (lever_arm) {
    result.center.lever_arm_m = state.lever_arm_m;
    result.center.lever_arm_covariance = fit.covariance(state.lever_arm_m.data());
    const auto with_zenith = fit.covariance(state.lever_arm_m.data(), state.zenith.data());
    if (zenith_covariance && with_zenith) {
      result.center.lever_arm_by_zenith = *with_zenith * zenith_covariance->inverse();
    }
  }
  describe(result, fit, spot);
  result.yaws_rad = std::move(state.yaws_rad);
  return result;
}

}  // namespace

RotationFit fit_turning_axis(const SpotCaptures& spot, const Camera& camera) {
  assert(spot.status == SpotStatus::ok);
  RotationFit result;
  if (spot.heights.size() > 1) {
    result = fit_axis(spot, camera, true);
  } else {
    if (lamps_at_several_heights(spot)) result = fit_axis(spot, camera, true);
    if (!tells_lever_arm(result.center, spot)) result = fit_axis(spot, camera, false);
  }
  if (!result.converged) return result;
  // The method is exact: what is left is noise, or the captures are of no turn about one axis.
  constexpr double most_share = 0.007, most_times = 4;
  const double most_px =
      std::max(most_share * camera.focal_px().x(), most_times * spot.stated_px.value_or(0));
  return result.residual_px > most_px ? RotationFit() : result;
}

}  // namespace vlp
