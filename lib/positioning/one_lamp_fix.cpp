// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/one_lamp_fix.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace vlp {

namespace {

/// Returns the lamp relative to the center of rotation at the readout time of its row, along the
/// axes of the camera in the middle of the image.
Eigen::Vector2d compute_lamp_from_center_m(const Sighting& sighting, double height_m,
                                           const MotionAtReadout& readout) {
  const double turn_rad = readout.motion.yaw_rate_rad_per_s * readout.time_s;
  return Eigen::Rotation2Dd(turn_rad) * (height_m * sighting.z + readout.arm_m);
}

}  // namespace

std::optional<Pose> compute_pose_at_known_height_and_yaw(const Sighting& sighting,
                                                         const HeightAndYaw& known,
                                                         const MotionAtReadout& readout) {
  const double height_m = sighting.lamp_m.z() - known.z_m;
  if (!(height_m > 0)) return std::nullopt;
  const Eigen::Vector2d lamp_from_camera_m =
      compute_lamp_from_center_m(sighting, height_m, readout) - readout.arm_m +
      readout.motion.velocity_m_per_s * readout.time_s;
  const Eigen::Vector2d s =
      sighting.lamp_m.head<2>() - Eigen::Rotation2Dd(known.yaw_rad) * lamp_from_camera_m;
  return Pose{{s.x(), s.y(), known.z_m}, known.yaw_rad};
}

Matrix4 compute_one_lamp_covariance(const Sighting& sighting, const Pose& pose) {
  const Eigen::Matrix2d d_pixel_d_xy =
      sighting.d_pixel_d_z * predict(LevelPose(pose), sighting.lamp_m).d_z_d_state.leftCols<2>();
  const Eigen::Matrix2d d_xy_d_pixel = d_pixel_d_xy.inverse();
  Matrix4 covariance = Matrix4::Zero();
  covariance.topLeftCorner<2, 2>() =
      sighting.sigma_px * sighting.sigma_px * d_xy_d_pixel * d_xy_d_pixel.transpose();
  return covariance;
}

Matrix4 compute_one_lamp_sensor_covariance(const Sighting& sighting, const Pose& pose,
                                           const HeightAndYaw& known,
                                           const MotionAtReadout& readout) {
  const double height_m = sighting.lamp_m.z() - pose.position_m.z();
  const double time_s = readout.time_s;
  const Eigen::Rotation2Dd world_from_level(pose.yaw_rad);
  const Eigen::Vector2d read_m = compute_lamp_from_center_m(sighting, height_m, readout);
  const Eigen::Vector2d lamp_m = (sighting.lamp_m - pose.position_m).head<2>();
  const auto quarter_turn = [](const Eigen::Vector2d& v) { return Eigen::Vector2d(-v.y(), v.x()); };
  // One column each: height, yaw, velocity along x and y, yaw rate.
  Eigen::Matrix<double, 4, 5> effect = Eigen::Matrix<double, 4, 5>::Zero();
  effect.col(0) << world_from_level *
                       (Eigen::Rotation2Dd(readout.motion.yaw_rate_rad_per_s * time_s) *
                        sighting.z),
      1, 0;
  effect.col(1) << -quarter_turn(lamp_m), 0, 1;
  effect.block<2, 2>(0, 2) = -time_s * world_from_level.toRotationMatrix();
  effect.block<2, 1>(0, 4) = -time_s * (world_from_level * quarter_turn(read_m));
  Eigen::Matrix<double, 5, 1> sd;
  sd << known.z_sd_m, known.yaw_sd_rad, readout.motion.velocity_sd_m_per_s,
      readout.motion.velocity_sd_m_per_s, readout.motion.yaw_rate_sd_rad_per_s;
  const Eigen::Matrix<double, 4, 5> by_sd = effect * sd.asDiagonal();
  return by_sd * by_sd.transpose();
}

Eigen::Matrix<double, 4, 3> compute_one_lamp_rotation_jacobian(const Sighting& sighting,
                                                               const Pose& pose) {
  Eigen::Matrix<double, 2, 3> d_z;
  d_z << tilt_jacobian(sighting.z), Eigen::Vector2d(-sighting.z.y(), sighting.z.x());
  const LevelPose camera(pose);
  Eigen::Matrix<double, 4, 3> effect = Eigen::Matrix<double, 4, 3>::Zero();
  effect.topRows<2>() =
      -height_above(camera, sighting.lamp_m) * product_matrix(camera.heading) * d_z;
  return effect;
}

}  // namespace vlp
