// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/adjustment/adjustment_room.h"

#include <array>
#include <cmath>
#include <stdexcept>

#include "support/synthetic_rig.h"

namespace vlp {
namespace {

/// Returns the index of a capture's known position in the order of their first captures.
std::size_t known_position_index(std::size_t capture) {
  constexpr std::array<std::size_t, 12> indices{0, 0, 9, 1, 1, 2, 2, 3, 4, 5, 6, 7};
  return indices.at(capture);
}

}  // namespace

AdjustmentRoom::AdjustmentRoom() {
  Camera& camera = input.calibration.camera;
  camera = synthetic_camera();
  camera.row_time_s = 4e-5;
  camera.readout = Readout::columns;
  Eigen::MatrixXd root = Eigen::MatrixXd::Zero(12, 3);
  root.row(0) << 2, 0, 0;
  root.row(1) << 0.5, 1.5, 0;
  root.row(3) << -0.7, 0.4, 1.1;
  input.calibration.intrinsics_report =
      IntrinsicsReport{40, 1000, 0, 0.2, {}, {}, MatrixX(root * root.transpose())};
  const std::vector<Eigen::Vector3d> lamps_m{{-0.8, -0.4, 1.60}, {0.8, -0.45, 1.7},
                                             {0.75, 0.5, 1.55},  {-0.7, 0.4, 1.65},
                                             {0.1, 0.1, 1.8},    {3, 3, 1.6}};
  const std::vector<double> sds_m{0.003, 0, 0.002, 0.004, 0.003, 0.005};
  for (std::size_t i = 0; i < kLamps; ++i) {
    const double n = static_cast<double>(i);
    true_lamps_m.push_back(kOrigin_m + lamps_m[i]);
    Lamp lamp{11 + static_cast<int>(i), true_lamps_m.back(), {}, {}, {}, sds_m[i]};
    lamp.position_m += 0.7 * sds_m[i] * Eigen::Vector3d(std::sin(5 * n), std::cos(3 * n), -0.5);
    input.lamps.lamps.push_back(lamp);
  }
  const Eigen::Vector3d first_m(0.3, -0.2, 0.05), second_m(-0.35, 0.15, 0.3);
  add_at_pivot("b", first_m, 0.4, KnownPosition{MeasuredPoint::axis, {}, 0, 0.001});
  add_at_pivot("b", first_m, 2.1, KnownPosition{MeasuredPoint::axis, {}, 0, 0.001});
  add_at_pivot("a", second_m, -1.2, {});
  input.captures.back().motion = {{0, 0}, 0.5, 0, 0.1};
  add_at_pivot("a", second_m, 1, KnownPosition{MeasuredPoint::camera, {}, {}, 0.02});
  add_at_pivot("a", second_m, -2.5, KnownPosition{MeasuredPoint::camera, {}, {}, 0.02});
  const KnownPosition camera_place{MeasuredPoint::camera, {}, 0, 0.002};
  add("fifth", {{0.2, 0.1, 0}, -1.9}, camera_place);
  input.captures.back().inclination = Inclination{0.03, -0.02};
  input.captures.back().motion = {{0.3, -0.2}, 0.4, 0, 0};
  add("again", {{0.2, 0.1, 0}, 0.3}, camera_place);
  add("other x", {{-0.1, 0.1, 0}, 0.8}, camera_place);
  add("other y", {{0.2, 0.3, 0}, 1.7}, camera_place);
  add("other z", {{0.2, 0.1, 0.2}, -0.6}, camera_place);
  add("no height", {{0.2, 0.1, 0}, 2.7}, KnownPosition{MeasuredPoint::camera, {}, {}, 0.002});
  add("axis", {{0.2, 0.1, 0}, -2.2}, KnownPosition{MeasuredPoint::axis, {}, 0, 0.002});
  add("moving", {{-0.2, -0.1, 0.1}, 0.1}, {});
  input.captures.back().motion = {{0.4, 0.1}, -0.3, 0.2, 0.3};
}

void AdjustmentRoom::scale_survey(double factor) {
  for (std::size_t i = 0; i < kLamps; ++i) {
    Lamp& lamp = input.lamps.lamps[i];
    lamp.position_m = true_lamps_m[i] + factor * (lamp.position_m - true_lamps_m[i]);
    *lamp.sd_m *= factor;
  }
}

void AdjustmentRoom::add_at_pivot(const std::string& pivot, const Eigen::Vector3d& axis_m,
                                  double yaw_rad, const std::optional<KnownPosition>& place) {
  AdjustmentCapture capture{pivot + std::to_string(input.captures.size()), {}};
  capture.pivot = pivot;
  capture.known_position = place;
  input.captures.push_back(capture);
  true_poses.push_back({kOrigin_m + axis_m, yaw_rad});
}

void AdjustmentRoom::add(const std::string& name, const Pose& camera,
                         const std::optional<KnownPosition>& place) {
  AdjustmentCapture capture{name, {}};
  capture.known_position = place;
  input.captures.push_back(capture);
  true_poses.push_back({kOrigin_m + camera.position_m, camera.yaw_rad});
}

AdjustmentProblem AdjustmentRoom::make_problem(double sigma_px, double noise_px) {
  const Calibration& calibration = input.calibration;
  AdjustmentProblem problem(
      calibration.camera.lens_model,
      LensParametrization(calibration.camera, calibration.intrinsics_report->covariance), kLamps,
      2);
  const AdjustmentLayout& at = problem.state_vector_layout();
  problem.has_lever_arm = true;
  problem.state_vector().segment<2>(at.zenith) << 0.04, -0.03;
  problem.state_vector().segment<2>(at.lever_arm) = kArm_m;
  problem.state_vector().segment<3>(at.pivot_state_index(0)) = true_poses[0].position_m;
  problem.state_vector().segment<3>(at.pivot_state_index(1)) = true_poses[2].position_m;
  for (std::size_t i = 0; i < kLamps; ++i) {
    const Lamp& lamp = input.lamps.lamps[i];
    problem.state_vector().segment<3>(at.lamp_state_index(i)) = true_lamps_m[i];
    problem.lamps.push_back({lamp.position_m, *lamp.sd_m});
  }
  problem.is_known_position_used.assign(8, true);
  constexpr std::array<double, 8> captures_of_place{2, 2, 2, 1, 1, 1, 1, 1};
  for (std::size_t k = 0; k < input.captures.size(); ++k) {
    AdjustmentCapture& capture = input.captures[k];
    Eigen::Matrix3d base_from_level = Eigen::Matrix3d::Identity();
    if (capture.inclination) {
      base_from_level = level_rotation_from_inclination(*capture.inclination).transpose();
    }
    std::optional<std::size_t> pivot;
    if (!capture.pivot.empty()) pivot = capture.pivot == "b" ? 0 : 1;
    problem.add_capture_with_initial_pose({pivot, base_from_level, capture.motion}, true_poses[k]);
    add_sightings(problem, k, sigma_px, noise_px);
    if (!capture.known_position) continue;
    KnownPosition& place = *capture.known_position;
    const std::size_t index = known_position_index(k);
    AdjustmentProblem::PositionObservation observation{
        k,
        index,
        place.measured_point == MeasuredPoint::axis,
        {},
        place.z_m ? 3 : 2,
        place.sd_m * std::sqrt(captures_of_place.at(index))};
    const double n = static_cast<double>(index);
    observation.measured_m =
        problem.predict_camera_or_axis_position(observation) +
        0.5 * place.sd_m * Eigen::Vector3d(std::sin(2 * n + 1), std::cos(n), 0.7);
    place.xy_m = observation.measured_m.head<2>();
    if (place.z_m) place.z_m = observation.measured_m.z();
    problem.position_observations.push_back(observation);
  }
  return problem;
}

void AdjustmentRoom::add_sightings(AdjustmentProblem& problem, std::size_t capture, double sigma_px,
                                   double noise_px) {
  AdjustmentCapture& measured = input.captures[capture];
  measured.detections.clear();
  const Lens lens(input.calibration.camera.lens_model, input.calibration.camera.intrinsics);
  for (std::size_t lamp = capture == 3 ? 1 : 0; lamp < 5; ++lamp) {
    AdjustmentProblem::Sighting sighting{
        capture, lamp, {0, 0}, sigma_px, Eigen::Matrix2d::Identity(), 0};
    const double n = static_cast<double>(7 * capture + lamp);
    for (int iteration = 0; iteration < 3; ++iteration) {
      sighting.pixel.setZero();
      const auto at = problem.linearize_lamp_observation(sighting, lens);
      if (!at) throw std::logic_error("the lens images no lamp");
      sighting.pixel = -at->value + noise_px * Eigen::Vector2d(std::sin(9 * n), std::cos(4 * n));
      sighting.time_s = 4e-5 * (sighting.pixel.x() - 399.5);
    }
    sighting.whitening /= sigma_px;
    problem.sightings.push_back(sighting);
    measured.detections.push_back({11 + static_cast<int>(lamp), sighting.pixel, sigma_px});
  }
}

Eigen::MatrixXd AdjustmentRoom::parameters_from_state(const AdjustmentProblem& problem) {
  const Eigen::Index rest = 4 + 3 * static_cast<Eigen::Index>(kLamps);
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(12 + rest, problem.state_vector_layout().global);
  matrix.topLeftCorner(12, 3) = problem.lens_parametrization().directions;
  matrix.block(12, 3, rest, rest).setIdentity();
  return matrix;
}

double AdjustmentRoom::sum_squares(const AdjustmentProblem& problem) {
  double sum = 0;
  const Lens lens = problem.current_lens().value();
  for (const auto& sighting : problem.sightings) {
    sum += problem.linearize_lamp_observation(sighting, lens).value().value.squaredNorm();
  }
  return sum;
}

AdjustmentProblem::GlobalCovariance AdjustmentRoom::solve_with_noise(AdjustmentProblem& problem,
                                                                     double min_scale) {
  for (int iteration = 0; iteration < 20; ++iteration) {
    EXPECT_TRUE(problem.solve_adjustment(false));
    const auto found = problem.compute_global_unknowns_covariance();
    const double ratio = std::sqrt(sum_squares(problem) / found.degrees_of_freedom);
    const double next = std::max(problem.noise_scale * ratio, min_scale);
    if (std::abs(next / problem.noise_scale - 1) <= 0.01) return found;
    problem.noise_scale = next;
  }
  ADD_FAILURE() << "the noise does not converge";
  return {};
}

}  // namespace vlp
