// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/lamps_below.h"

#include <array>
#include <cstddef>
#include <iterator>

namespace vlp {
namespace {

Eigen::Vector3d turn_over(const Eigen::Vector3d& v) { return {v.x(), -v.y(), -v.z()}; }
Eigen::Vector2d turn_over(const Eigen::Vector2d& v) { return {v.x(), -v.y()}; }

/// Signs of X, Y, Z, yaw, velocity, yaw rate, roll and pitch (BodyIndex).
constexpr std::array<double, kBodyStates> kSigns{1, -1, -1, -1, 1, -1, -1, 1, -1};

const Eigen::DiagonalMatrix<double, kBodyStates> kTurnedOver(
    Eigen::Map<const Eigen::Matrix<double, kBodyStates, 1>>(kSigns.data()));

}  // namespace

Inclination turn_over(const Inclination& inclination) {
  return {inclination.roll_rad, -inclination.pitch_rad};
}

CameraMount turn_over(const CameraMount& mount) {
  return {turn_over(mount.position_in_robot_m), -mount.yaw_in_robot_rad};
}

LampMap turn_over(LampMap map) {
  for (Lamp& lamp : map.lamps) lamp.position_m = turn_over(lamp.position_m);
  return map;
}

Calibration turn_over(Calibration calibration) {
  if (auto& joint = calibration.covariance) {
    Eigen::Index row = joint->first_lamp_row();
    for (JointCovariance::LampPosition& lamp : joint->lamps) {
      lamp.position_m = turn_over(lamp.position_m);
      joint->matrix.middleRows<2>(row + 1) *= -1;
      joint->matrix.middleCols<2>(row + 1) *= -1;
      row += 3;
    }
  }
  return calibration;
}

BodyState turn_over(const BodyState& state) {
  const auto& [pose, motion] = state;
  return {{turn_over(pose.position_m), -pose.yaw_rad},
          {turn_over(motion.velocity_m_per_s), -motion.yaw_rate_rad_per_s,
           turn_over(motion.inclination)}};
}

Sensors turn_over(Sensors sensors) {
  if (sensors.inclination) sensors.inclination = turn_over(*sensors.inclination);
  if (auto& known = sensors.height_and_yaw) {
    known->z_m *= -1;
    known->yaw_rad *= -1;
  }
  if (auto& motion = sensors.motion) {
    motion->velocity_m_per_s = turn_over(motion->velocity_m_per_s);
    motion->yaw_rate_rad_per_s *= -1;
  }
  if (sensors.height) sensors.height->z_m *= -1;
  if (auto& prior = sensors.prior) {
    prior = {turn_over(prior->mean), kTurnedOver * prior->covariance * kTurnedOver};
  }
  return sensors;
}

Fix turn_over(Fix fix) {
  fix.state = turn_over(fix.state);
  for (FixCandidate& candidate : fix.candidates) candidate.state = turn_over(candidate.state);
  fix.covariance = kTurnedOver * fix.covariance * kTurnedOver;
  fix.noise_covariance = kTurnedOver * fix.noise_covariance * kTurnedOver;
  return fix;
}

LampProjection turn_over(LampProjection projection) {
  projection.jacobian = projection.jacobian * kTurnedOver;
  return projection;
}

}  // namespace vlp
