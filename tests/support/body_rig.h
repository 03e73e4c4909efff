// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "camera/lens.h"
#include "geometry/angles.h"
#include "positioning/pose_estimation.h"
#include "positioning/positioner.h"
#include "support/random.h"
#include "support/synthetic_rig.h"

namespace vlp {

/// A camera, or a robot with a camera, that moves and is tilted under lamps while the shutter
/// reads.
struct BodyRig {
  LampMap map;
  Calibration calibration;
  BodyState body;
  std::optional<CameraMount> mount;

  PositionerOptions options() const {
    PositionerOptions options;
    options.mount = mount;
    return options;
  }
  Positioner positioner() const { return {map, calibration, options()}; }
};

/// Returns a calibration with the lens of the synthetic rig, read in rows of 55 us.
inline Calibration rolling_calibration() {
  Calibration calibration{synthetic_camera(), {}, {}, {}, {}};
  calibration.camera.row_time_s = 55e-6;
  calibration.camera.readout = Readout::rows;
  return calibration;
}

inline Eigen::Isometry3d world_from_body(const BodyState& state, double time_s) {
  const BodyMotion& motion = state.motion;
  const Eigen::Vector2d velocity = Eigen::Rotation2Dd(state.pose.yaw_rad) * motion.velocity_m_per_s;
  Eigen::Isometry3d world_from_body = Eigen::Isometry3d::Identity();
  world_from_body.translation() =
      state.pose.position_m + time_s * Eigen::Vector3d(velocity.x(), velocity.y(), 0);
  world_from_body.linear() =
      rotation_about_z(state.pose.yaw_rad + motion.yaw_rate_rad_per_s * time_s) *
      level_rotation_from_inclination(motion.inclination);
  return world_from_body;
}

inline Eigen::Isometry3d body_from_camera(const BodyRig& rig) {
  Eigen::Isometry3d body_from_camera = Eigen::Isometry3d::Identity();
  body_from_camera.linear() = compute_level_from_camera_matrix(rig.calibration, Correction::all);
  // y and z of a camera that looks down are opposite to those of its image and its line of sight.
  if (rig.map.lamps_below_camera) body_from_camera.linear().bottomRows<2>() *= -1;
  if (!rig.mount) return body_from_camera;
  const Eigen::Matrix3d robot_from_level = rotation_about_z(rig.mount->yaw_in_robot_rad);
  body_from_camera.linear() = robot_from_level * body_from_camera.linear();
  body_from_camera.translation() = rig.mount->position_in_robot_m;
  return body_from_camera;
}

/// Returns the readout time of a pixel, relative to the middle row at `start_s`.
inline double read_s(const Camera& camera, const Eigen::Vector2d& pixel, double start_s = 0) {
  const bool rows = camera.readout == Readout::rows;
  const double middle = (camera.imager_px[rows ? 1 : 0] - 1) / 2.0;
  return start_s + *camera.row_time_s * ((rows ? pixel.y() : pixel.x()) - middle);
}

/// Projects the lamps at the readout times of their rows. Omits lamps outside the image.
inline std::vector<Detection> seen_from(const BodyRig& rig, double sigma_px, double start_s = 0) {
  const Camera& camera = rig.calibration.camera;
  const Lens lens(camera.lens_model, camera.intrinsics);
  const Eigen::Isometry3d body_from_cam = body_from_camera(rig);
  std::vector<Detection> detections;
  for (const Lamp& lamp : rig.map.lamps) {
    double time_s = start_s;
    std::optional<Eigen::Vector2d> pixel;
    for (int round = 0; round < 100; ++round) {
      const Eigen::Isometry3d world_from_camera = world_from_body(rig.body, time_s) * body_from_cam;
      pixel = lens.project_point(world_from_camera.inverse() * lamp.position_m);
      if (!pixel) break;
      time_s = read_s(camera, *pixel, start_s);
    }
    const bool in_image = pixel && pixel->minCoeff() > 0 && pixel->x() < camera.imager_px[0] &&
                          pixel->y() < camera.imager_px[1];
    if (in_image) detections.push_back({lamp.id, *pixel, sigma_px});
  }
  return detections;
}

/// Draws lamps all over the image that the camera takes at time 0, at least `min_rad` above the
/// horizon. The ceiling has one height or many.
inline LampMap draw_lamps_in_view(const BodyRig& rig, std::size_t count, bool one_height,
                                  double min_rad, Random& random) {
  const Camera& camera = rig.calibration.camera;
  const Lens lens(camera.lens_model, camera.intrinsics);
  const Eigen::Isometry3d world_from_camera = world_from_body(rig.body, 0) * body_from_camera(rig);
  std::vector<Eigen::Vector3d> positions_m;
  while (positions_m.size() < count) {
    const double u = random.uniform(60, 740), v = random.uniform(60, 540);
    const double ceiling_m = one_height ? 1.6 : random.uniform(1.4, 2.2);
    const Eigen::Vector3d ray =
        world_from_camera.linear() * lens.unproject_pixel({u, v})->direction.normalized();
    if (ray.z() < std::sin(min_rad)) continue;
    const Eigen::Vector3d from_m = world_from_camera.translation();
    const Eigen::Vector3d lamp_m = from_m + ray * ((ceiling_m - from_m.z()) / ray.z());
    // Far apart in the image, so that they determine the state.
    bool apart = true;
    for (const Eigen::Vector3d& other_m : positions_m) {
      const auto pixel = lens.project_point(world_from_camera.inverse() * other_m);
      apart = apart && (*pixel - Eigen::Vector2d(u, v)).norm() > 120;
    }
    if (apart) positions_m.push_back(lamp_m);
  }
  return make_lamp_map(positions_m);
}

}  // namespace vlp
