// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/spot.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "geometry/angles.h"

namespace vlp {

std::vector<Frame> RotationScene::frames(double sigma_px) const {
  std::vector<Frame> frames;
  for (std::size_t height = 0; height < heights_m.size(); ++height) {
    for (int k = 0; k < captures; ++k) {
      const double uneven = k + 0.3 * std::sin(5.0 * k + static_cast<double>(height));
      const double yaw_rad =
          first_rad + static_cast<double>(height) + arc_rad * uneven / (captures - 0.7);
      SyntheticRig rig{map, {}, {}, {}};
      rig.calibration.camera = camera;
      rig.calibration.rotation_center = truth();
      Eigen::Vector3d position_m(axis_m.x(), axis_m.y(), heights_m[height]);
      position_m.head<2>() += (rotation_about_z(yaw_rad).topLeftCorner<2, 2>() * lever_arm_m);
      rig.camera = {position_m, yaw_rad};
      Frame frame{std::to_string(frames.size()) + ".png", {}};
      for (const Detection& detection : seen_from(rig, sigma_px)) {
        const Eigen::Array2d pixel = detection.pixel.array();
        const bool inside = pixel.minCoeff() >= 0 && pixel.x() < camera.imager_px[0] &&
                            pixel.y() < camera.imager_px[1];
        if (inside || !only_in_image) frame.detections.push_back(detection);
      }
      frames.push_back(frame);
    }
  }
  return frames;
}

RotationScene tilted_scene(const Eigen::Vector2d& lever_arm_m,
                           const std::vector<double>& heights_m) {
  RotationScene scene;
  scene.tilt_rad = rad_from_deg(1.5);
  scene.lever_arm_m = lever_arm_m;
  scene.heights_m = heights_m;
  return scene;
}

RotationFit fit_axis(const RotationScene& scene, const std::vector<Frame>& frames) {
  const RotationCaptures rotation = detect_pivots(frames, scene.map, scene.camera);
  EXPECT_EQ(rotation.status, RotationStatus::ok) << describe_status(rotation.status);
  return rotation.status == RotationStatus::ok ? fit_rotation_axis(rotation, scene.camera)
                                               : RotationFit();
}

std::vector<Frame> with_noise(std::vector<Frame> frames, Random& random) {
  for (Frame& frame : frames) frame.detections = with_noise(frame.detections, random);
  return frames;
}

double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace vlp
