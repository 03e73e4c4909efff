// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "support/synthetic_rig.h"

#include <Eigen/LU>
#include <cmath>

#include "camera/lens.h"
#include "camera/spline_grid.h"

namespace vlp {

Camera synthetic_camera() {
  Camera camera;
  camera.id = "synthetic";
  camera.imager_px = {800, 600};
  camera.lens_model = LensModel::opencv8;
  camera.intrinsics = {520, 522, 403, 296, -0.28, 0.09, 1e-4, -2e-4, -0.010, 0.020, 0.010, 0.001};
  return camera;
}

Camera splined_camera() {
  Camera camera = synthetic_camera();
  camera.lens_model = splined_lens_model({3, 12, 10, 130});
  camera.intrinsics.resize(4);
  camera.intrinsics.resize(num_lens_parameters(camera.lens_model));
  for (std::size_t i = 4; i < camera.intrinsics.size(); ++i) {
    camera.intrinsics[i] = 0.01 * std::sin(static_cast<double>(i * i));
  }
  return camera;
}

Camera fisheye_camera() {
  Camera camera = synthetic_camera();
  camera.lens_model = LensModel::fisheye;
  camera.intrinsics = {290, 291, 403, 296, 0.03, -0.012, 0.004, -0.0006};
  return camera;
}

LampMap make_lamp_map(const std::vector<Eigen::Vector3d>& positions_m) {
  LampMap map;
  for (const auto& position_m : positions_m) {
    map.lamps.push_back({static_cast<int>(map.lamps.size()) + 1, position_m, {}, {}, {}});
  }
  return map;
}

LampMap synthetic_lamps() {
  return make_lamp_map({{-0.8, -0.4, 1.6},
                        {0.8, -0.4, 1.6},
                        {0.8, 0.4, 1.6},
                        {-0.8, 0.4, 1.6},
                        {0.1, 0.5, 1.6},
                        {-0.3, -0.5, 1.6},
                        {0.5, 0.05, 1.6},
                        {-0.4, 0.1, 1.6}});
}

RotationCenter tilted_by(const Camera& camera, double tilt_rad, double azimuth_rad) {
  RotationCenter center;
  center.model = RotationModel::tilt;
  center.zenith_in_camera = {std::sin(tilt_rad) * std::cos(azimuth_rad),
                             std::sin(tilt_rad) * std::sin(azimuth_rad), std::cos(tilt_rad)};
  const Eigen::Vector2d focal_px = camera.focal_px();
  center.center_px =
      camera.principal_point_px() +
      focal_px.cwiseProduct(center.zenith_in_camera.head<2>() / center.zenith_in_camera.z());
  return center;
}

std::vector<Detection> seen_from(const SyntheticRig& rig, double sigma_px) {
  const Camera& camera = rig.calibration.camera;
  const Lens lens(camera.lens_model, camera.intrinsics);
  Eigen::Matrix3d level_from_camera =
      vlp::compute_level_from_camera_matrix(rig.calibration, Correction::all);
  if (rig.inclination) {
    level_from_camera = level_rotation_from_inclination(*rig.inclination) * level_from_camera;
  }
  std::vector<Detection> detections;
  for (const Lamp& lamp : rig.map.lamps) {
    const Eigen::Vector3d x_in_camera =
        level_from_camera.inverse() * level_point_from_world(rig.camera, lamp.position_m);
    if (const auto pixel = lens.project_point(x_in_camera)) {
      detections.push_back({lamp.id, *pixel, sigma_px});
    }
  }
  return detections;
}

std::vector<Detection> with_noise(std::vector<Detection> detections, Random& random) {
  for (Detection& detection : detections) {
    detection.pixel.x() += *detection.sigma_px * random.normal();
    detection.pixel.y() += *detection.sigma_px * random.normal();
  }
  return detections;
}

}  // namespace vlp
