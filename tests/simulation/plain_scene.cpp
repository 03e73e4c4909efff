// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "simulation/plain_scene.h"

namespace vlp {
namespace {

Camera camera(LensModel model, std::vector<double> intrinsics) {
  return {"test", {800, 600}, model, std::move(intrinsics), {}, 3e-5, Readout::rows};
}

}  // namespace

Camera paper_rig_camera() {
  return camera(LensModel::opencv8, {520, 520.6, 402.3, 297.4, -0.25, 0.08, 0.0002, -0.0001, -0.012,
                                     0.01, 0.002, 0.0001});
}

Camera wide_camera() {
  return camera(LensModel::opencv8, {416.7, 416.9, 398.2, 302.1, 0.733348, 0.0897113, 0.0001,
                                     0.0002, 0.0009234, 1.06639, 0.246743, 0.00924612});
}

Camera stereographic_camera() { return camera(LensModel::stereographic, {400, 401, 396, 303}); }

Camera pinhole_camera() { return camera(LensModel::pinhole, {500, 500, 399.5, 299.5}); }

Scene plain_scene() {
  Scene scene{};
  scene.seed = 1;
  scene.camera = paper_rig_camera();
  scene.sensor = {16, 1, 0, 60000, 0, false, {}};
  scene.mount = {Eigen::Matrix3d::Identity(), Eigen::Vector2d::Zero()};
  scene.lamps = {{1,
                  {{0, 0, 1.6}, make_disc_lamp_shape(0.18), 1e9, 1},
                  1000,
                  1,
                  0.0,
                  Eigen::Vector3d::Zero()}};
  return scene;
}

LampShot shot_at(const Scene& scene, const Eigen::Vector3d& position_m, double yaw_rad) {
  LampShot shot{"0000.png", 0, 5e-5, {position_m, Eigen::Vector2d::Zero(), yaw_rad, 0, scene.mount},
                {},         1};
  for (const SceneLamp& lamp : scene.lamps) {
    shot.waves.push_back({lamp.frequency_hz, lamp.duty, lamp.phase.value_or(0)});
  }
  for (const ForeignLight& light : scene.clutter.foreign_lights) {
    shot.foreign_waves.push_back(copy_with_phase(light.wave, light.phase.value_or(0)));
  }
  return shot;
}

SceneBoard plain_board() {
  return {{"tag36h11", 6, 5, 0.02, 1, 1, false, 0, {false, BoardCorner::top_left}},
          0.02,
          Eigen::Vector2d::Zero(),
          1e6,
          0,
          1e6};
}

CaptureSet board_views(int count, double distance_m, double tilt_rad, double roll_rad,
                       double spread) {
  return {
      "boards",
      1e-3,
      {},
      BoardViews{
          count, {distance_m, distance_m}, tilt_rad, roll_rad, spread, Eigen::Vector3d::Zero()}};
}

Brightness measure_brightness(const cv::Mat1f& image) {
  Brightness brightness{0, Eigen::Vector2d::Zero()};
  for (int v = 0; v < image.rows; ++v) {
    for (int u = 0; u < image.cols; ++u) {
      brightness.sum += image(v, u);
      brightness.centroid_px += image(v, u) * Eigen::Vector2d(u, v);
    }
  }
  brightness.centroid_px /= brightness.sum;
  return brightness;
}

}  // namespace vlp
