// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/lamps_below.h"

#include <array>
#include <cstddef>
#include <iterator>

namespace vlp {
namespace {

Eigen::Vector3d rotate_upside_down(const Eigen::Vector3d& v) { return {v.x(), -v.y(), -v.z()}; }
Eigen::Vector2d rotate_upside_down(const Eigen::Vector2d& v) { return {v.x(), -v.y()}; }

/// Signs of X, Y, Z, yaw, velocity, yaw rate, roll and pitch (BodyIndex).
constexpr std::array<double, kBodyStates> kSigns{1, -1, -1, -1, 1, -1, -1, 1, -1};

const Eigen::DiagonalMatrix<double, kBodyStates> kTurnedOver(
    Eigen::Map<const Eigen::Matrix<double, kBodyStates, 1>>(kSigns.data()));

}  // namespace

Inclination rotate_upside_down(const Inclination& inclination) {
  return {inclination.roll_rad, -inclination.pitch_rad};
}

CameraMount rotate_upside_down(const CameraMount& mount) {
  return {rotate_upside_down(mount.position_in_robot_m), -mount.yaw_in_robot_rad};
}

LampMap rotate_upside_down(LampMap map) {
  for (Lamp& lamp : map.lamps) lamp.position_m = rotate_upside_down(lamp.position_m);
  return map;
}

Calibration rotate_upside_down(Calibration calibration) {
  if (auto& joint = calibration.covariance) {
    Eigen::Index row = joint->first_lamp_row();
    for (JointCovariance::LampPosition& lamp : joint->lamps) {
      lamp.position_m = rotate_upside_down(lamp.position_m);
      joint->matrix.middleRows<2>(row + 1) *= -1;
      joint->matrix.middleCols<2>(row + 1) *= -1;
      row += 3;
    }
  }
  return calibration;
}

BodyState rotate_upside_down(const BodyState& state) {
  const auto& [pose, motion] = state;
  return {{rotate_upside_down(pose.position_m), -pose.yaw_rad},
          {rotate_upside_down(motion.velocity_m_per_s), -motion.yaw_rate_rad_per_s,
           rotate_upside_down(motion.inclination)}};
}

Sensors rotate_upside_down(Sensors sensors) {
  if (sensors.inclination) sensors.inclination = rotate_upside_down(*sensors.inclination);
  if (auto& known = sensors.height_and_yaw) {
    known->z_m *= -1;
    known->yaw_rad *= -1;
  }
  if (auto& motion = sensors.motion) {
    motion->velocity_m_per_s = rotate_upside_down(motion->velocity_m_per_s);
    motion->yaw_rate_rad_per_s *= -1;
  }
  if (sensors.height) sensors.height->z_m *= -1;
  if (auto& prior = sensors.prior) {
    prior = {rotate_upside_down(prior->mean), kTurnedOver * prior->covariance * kTurnedOver};
  }
  return sensors;
}

Fix rotate_upside_down(Fix fix) {
  fix.state = rotate_upside_down(fix.state);
  for (FixCandidate& candidate : fix.candidates)
    candidate.state = rotate_upside_down(candidate.state);
  fix.covariance = kTurnedOver * fix.covariance * kTurnedOver;
  fix.noise_covariance = kTurnedOver * fix.noise_covariance * kTurnedOver;
  return fix;
}

LampProjection rotate_upside_down(LampProjection projection) {
  projection.jacobian = projection.jacobian * kTurnedOver;
  return projection;
}

}  // namespace vlp
