// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/adjustment/survey.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <numbers>

#include "camera/lens.h"

namespace vlp {

Survey::Survey(double map_sd_m)
    : truth{make_lamp_map({{-0.8, -0.4, 1.60},
                           {0.8, -0.4, 1.62},
                           {0.8, 0.4, 1.58},
                           {-0.8, 0.4, 1.60},
                           {0.1, 0.5, 1.61},
                           {-0.3, -0.5, 1.60},
                           {0.5, 0.05, 1.59},
                           {-0.4, 0.1, 1.60}}),
            {},
            {{0, 0, 0}, 0},
            {}} {
  truth.calibration.camera = synthetic_camera();
  truth.calibration.rotation_center = tilted_by(truth.calibration.camera, 0.02, 0.7);
  for (Lamp& lamp : truth.map.lamps) lamp.sd_m = map_sd_m;
  input.lamps = truth.map;
  input.calibration.camera = truth.calibration.camera;
}

void Survey::turn(const Eigen::Vector3d& axis_m, int captures, double position_sd_m,
                  MeasuredPoint of) {
  const std::string spot = "spot-" + std::to_string(input.captures.size());
  for (int k = 0; k < captures; ++k) {
    const double yaw_rad = 0.3 + 2 * std::numbers::pi * k / captures;
    const Eigen::Vector2d arm_m = rotation_about_z(yaw_rad).topLeftCorner<2, 2>() * lever_arm_m;
    truth.camera = {axis_m + Eigen::Vector3d(arm_m.x(), arm_m.y(), 0), yaw_rad};
    AdjustmentCapture capture{spot + "/" + std::to_string(k), seen_from(truth, sigma_px)};
    capture.pivot = spot;
    if (position_sd_m > 0) {
      const Eigen::Vector3d stated_m = of == MeasuredPoint::axis ? axis_m : truth.camera.position_m;
      capture.known_position = KnownPosition{of, stated_m.head<2>(), stated_m.z(), position_sd_m};
    }
    input.captures.push_back(capture);
  }
}

void Survey::stand(const Pose& camera) {
  truth.camera = camera;
  input.captures.push_back(
      {"capture-" + std::to_string(input.captures.size()), seen_from(truth, sigma_px)});
}

void Survey::five_places(double position_sd_m) {
  const std::vector<Eigen::Vector3d> axes_m{
      {0, 0, 0}, {0.5, 0.25, 0}, {-0.5, 0.25, 0.1}, {-0.5, -0.25, 0}, {0.5, -0.25, 0.2}};
  for (const Eigen::Vector3d& axis_m : axes_m) turn(axis_m, 12, position_sd_m);
}

void Survey::add_noise(Random& random, bool pixels, bool map, bool axes) {
  std::string spot;
  Eigen::Vector3d error_m = Eigen::Vector3d::Zero();
  for (AdjustmentCapture& capture : input.captures) {
    if (pixels) capture.detections = with_noise(std::move(capture.detections), random);
    if (!axes || !capture.known_position) continue;
    if (capture.pivot != spot) {
      for (double& one : error_m) one = capture.known_position->sd_m * random.normal();
    }
    spot = capture.pivot;
    capture.known_position->xy_m += error_m.head<2>();
    *capture.known_position->z_m += error_m.z();
  }
  if (!map) return;
  for (Lamp& lamp : input.lamps.lamps) {
    for (double& one : lamp.position_m) one += *lamp.sd_m * random.normal();
  }
}

Eigen::MatrixXd lens_covariance(const Camera& camera, double sigma_px, int rays_across) {
  const Lens lens(camera.lens_model, camera.intrinsics);
  const Eigen::Index n = std::ssize(camera.intrinsics);
  // The orientation of the camera relative to the boards is unknown, so that a rotation is
  // marginalized.
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(n + 3, n + 3);
  for (int i = 0; i < rays_across; ++i) {
    for (int j = 0; j < rays_across; ++j) {
      const Eigen::Vector2d pixel(camera.imager_px[0] * (i + 0.5) / rays_across,
                                  camera.imager_px[1] * (j + 0.5) / rays_across);
      const auto ray = lens.unproject_pixel(pixel);
      if (!ray) continue;
      const auto seen = lens.project_with_jacobians(ray->direction);
      if (!seen) continue;
      const Eigen::Vector3d& d = ray->direction;
      Eigen::Matrix3d turned;
      turned << 0, d.z(), -d.y(), -d.z(), 0, d.x(), d.y(), -d.x(), 0;
      Eigen::MatrixXd row(2, n + 3);
      row << seen->d_pixel_d_parameters, seen->d_pixel_d_point * turned;
      information += row.transpose() * row / (sigma_px * sigma_px);
    }
  }
  // Regularization as in mrcal: coefficients that boards do not determine stay small.
  constexpr double coefficient_sd = 0.01;
  information.diagonal().segment(4, n - 4).array() += 1 / (coefficient_sd * coefficient_sd);
  return information.inverse().topLeftCorner(n, n);
}

void draw_lens(Calibration& calibration, const Eigen::MatrixXd& covariance, Random& random) {
  const Eigen::MatrixXd root = covariance.llt().matrixL();
  Eigen::VectorXd draw(covariance.rows());
  for (double& one : draw) one = random.normal();
  Eigen::Map<Eigen::VectorXd>(calibration.camera.intrinsics.data(), draw.size()) += root * draw;
  calibration.intrinsics_report = IntrinsicsReport{40, 4000, 0, 0.1, {}, {}, covariance};
}

}  // namespace vlp
