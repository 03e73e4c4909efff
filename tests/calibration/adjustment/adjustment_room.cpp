// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/adjustment/adjustment_room.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "support/least_squares_oracle.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

/// Index of each capture's known position, and their numbers of captures.
constexpr std::array<std::size_t, 13> kPlaces{0, 0, 9, 1, 1, 2, 2, 3, 4, 5, 6, 7, 9};
constexpr std::array<double, 8> kCapturesOfPlace{2, 2, 2, 1, 1, 1, 1, 1};

}  // namespace

AdjustmentRoom::AdjustmentRoom() {
  Camera& camera = input.calibration.camera;
  camera = synthetic_camera();
  camera.row_time_s = 4e-5;
  camera.readout = Readout::columns;
  lens_root_.row(0) << 2, 0, 0;
  lens_root_.row(1) << 0.5, 1.5, 0;
  lens_root_.row(3) << -0.7, 0.4, 1.1;
  input.calibration.intrinsics_report =
      IntrinsicsReport{40, 1000, 0, 0.2, {}, {}, MatrixX(lens_root_ * lens_root_.transpose())};
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
  const KnownPosition axis{MeasuredPoint::axis, {}, 0, 0.001};
  const KnownPosition camera_without_height{MeasuredPoint::camera, {}, {}, 0.02};
  add("b0", "b", {first_m, 0.4}, axis);
  add("b1", "b", {first_m, 2.1}, axis);
  add("a2", "a", {second_m, -1.2}, {});
  input.captures.back().motion = {{0, 0}, 0.5, 0, 0.1};
  add("a3", "a", {second_m, 1}, camera_without_height);
  add("a4", "a", {second_m, -2.5}, camera_without_height);
  const KnownPosition place{MeasuredPoint::camera, {}, 0, 0.002};
  add("fifth", "", {{0.2, 0.1, 0}, -1.9}, place);
  input.captures.back().inclination = Inclination{0.03, -0.02};
  input.captures.back().motion = {{0.3, -0.2}, 0.4, 0, 0};
  add("again", "", {{0.2, 0.1, 0}, 0.3}, place);
  add("other x", "", {{-0.1, 0.1, 0}, 0.8}, place);
  add("other y", "", {{0.2, 0.3, 0}, 1.7}, place);
  add("other z", "", {{0.2, 0.1, 0.2}, -0.6}, place);
  add("no height", "", {{0.2, 0.1, 0}, 2.7}, KnownPosition{MeasuredPoint::camera, {}, {}, 0.002});
  add("axis", "", {{0.2, 0.1, 0}, -2.2}, KnownPosition{MeasuredPoint::axis, {}, 0, 0.002});
  add("moving", "", {{-0.2, -0.1, 0.1}, 0.1}, {});
  input.captures.back().motion = {{0.4, 0.1}, -0.3, 0.2, 0.3};
}

void AdjustmentRoom::add(const std::string& name, const std::string& pivot, const Pose& pose,
                         const std::optional<KnownPosition>& place) {
  AdjustmentCapture capture{name, {}};
  capture.pivot = pivot;
  capture.known_position = place;
  input.captures.push_back(capture);
  true_poses_.push_back({kOrigin_m + pose.position_m, pose.yaw_rad});
}

void AdjustmentRoom::scale_survey(double factor) {
  for (std::size_t i = 0; i < kLamps; ++i) {
    Lamp& lamp = input.lamps.lamps[i];
    lamp.position_m = true_lamps_m[i] + factor * (lamp.position_m - true_lamps_m[i]);
    *lamp.sd_m *= factor;
  }
}

AdjustmentRoom::State AdjustmentRoom::make_true_state() const {
  State state{{0, 0, 0}, {0.04, -0.03}, {0.03, -0.02}, true_lamps_m, true_poses_, {}, {}};
  for (const AdjustmentCapture& capture : input.captures) {
    state.velocities_m_per_s.push_back(capture.pivot.empty() ? capture.motion.velocity_m_per_s
                                                             : Eigen::Vector2d(0, 0));
    state.yaw_rates_rad_per_s.push_back(capture.motion.yaw_rate_rad_per_s);
  }
  return state;
}

template <typename Visit>
void AdjustmentRoom::visit_unknowns(State& state, const Visit& visit) const {
  const auto visit_all = [&](auto& values) {
    for (double& value : values) visit(value);
  };
  visit_all(state.lens);
  visit_all(state.zenith);
  visit_all(state.arm_m);
  for (const std::size_t lamp : {0U, 2U, 3U, 4U}) visit_all(state.lamps_m[lamp]);
  for (std::size_t k = 0; k < input.captures.size(); ++k) {
    // Captures of a pivot have the position of the first one.
    const std::string& pivot = input.captures[k].pivot;
    if (k == 0 || pivot.empty() || pivot != input.captures[k - 1].pivot) {
      visit_all(state.poses[k].position_m);
    } else {
      state.poses[k].position_m = state.poses[k - 1].position_m;
    }
    visit(state.poses[k].yaw_rad);
    const KnownMotion& motion = input.captures[k].motion;
    if (motion.velocity_sd_m_per_s > 0) visit_all(state.velocities_m_per_s[k]);
    if (motion.yaw_rate_sd_rad_per_s > 0) visit(state.yaw_rates_rad_per_s[k]);
  }
}

Eigen::VectorXd AdjustmentRoom::pack(const State& state) const {
  std::vector<double> unknowns;
  State copy = state;
  visit_unknowns(copy, [&](double value) { unknowns.push_back(value); });
  return Eigen::Map<Eigen::VectorXd>(unknowns.data(), std::ssize(unknowns));
}

AdjustmentRoom::State AdjustmentRoom::unpack(const Eigen::VectorXd& unknowns) const {
  State state = make_true_state();
  state.lamps_m[1] = input.lamps.lamps[1].position_m;  // exact
  Eigen::Index next = 0;
  visit_unknowns(state, [&](double& value) { value = unknowns[next++]; });
  return state;
}

Lens AdjustmentRoom::make_lens(const State& state) const {
  const Eigen::VectorXd intrinsics = compute_intrinsics(state);
  return Lens(input.calibration.camera.lens_model,
              std::vector<double>(intrinsics.begin(), intrinsics.end()));
}

Eigen::VectorXd AdjustmentRoom::compute_intrinsics(const State& state) const {
  const std::vector<double>& start = input.calibration.camera.intrinsics;
  return Eigen::Map<const Eigen::VectorXd>(start.data(), std::ssize(start)) +
         lens_root_ * state.lens;
}

Eigen::Vector2d AdjustmentRoom::predict_pixel(const State& state, const Lens& lens,
                                              std::size_t capture,
                                              const Detection& detection) const {
  const double time_s = 4e-5 * (detection.pixel.x() - 399.5);
  const Pose& pose = state.poses[capture];
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d x =
      Eigen::AngleAxisd(-pose.yaw_rad, z) *
      (state.lamps_m[static_cast<std::size_t>(detection.lamp - 11)] - pose.position_m);
  x.head<2>() -= state.velocities_m_per_s[capture] * time_s;
  x = Eigen::AngleAxisd(-state.yaw_rates_rad_per_s[capture] * time_s, z) * x;
  if (!input.captures[capture].pivot.empty()) x.head<2>() -= state.arm_m;
  if (const auto& inclination = input.captures[capture].inclination) {
    const Eigen::Quaterniond level_from_base =
        Eigen::AngleAxisd(inclination->pitch_rad, Eigen::Vector3d::UnitY()) *
        Eigen::AngleAxisd(inclination->roll_rad, Eigen::Vector3d::UnitX());
    x = level_from_base.inverse() * x;
  }
  // Smallest rotation of Z to the zenith.
  const Eigen::Vector3d zenith = state.zenith.homogeneous().normalized();
  x = Eigen::Quaterniond(1 + zenith.z(), -zenith.y(), zenith.x(), 0).normalized() * x;
  return lens.project_point(x).value();
}

Eigen::Vector3d AdjustmentRoom::predict_position(const State& state, std::size_t capture) const {
  const bool is_axis =
      input.captures[capture].known_position->measured_point == MeasuredPoint::axis;
  const bool is_at_pivot = !input.captures[capture].pivot.empty();
  const Pose& pose = state.poses[capture];
  Eigen::Vector3d position_m = pose.position_m;
  const double arms = (is_at_pivot && !is_axis ? 1 : 0) - (!is_at_pivot && is_axis ? 1 : 0);
  position_m.head<2>() += arms * (Eigen::Rotation2Dd(pose.yaw_rad) * state.arm_m);
  return position_m;
}

void AdjustmentRoom::measure(double sigma_px, double noise_px) {
  const State truth = make_true_state();
  const Lens lens = make_lens(truth);
  for (std::size_t k = 0; k < input.captures.size(); ++k) {
    AdjustmentCapture& capture = input.captures[k];
    capture.detections.clear();
    for (int lamp = k == 3 ? 1 : 0; lamp < 5; ++lamp) {  // one capture lacks a lamp
      const double n = static_cast<double>(7 * k) + lamp;
      Detection detection{11 + lamp, {400, 300}, sigma_px};
      for (int iteration = 0; iteration < 3; ++iteration) {
        detection.pixel = predict_pixel(truth, lens, k, detection) +
                          noise_px * Eigen::Vector2d(std::sin(9 * n), std::cos(4 * n));
      }
      capture.detections.push_back(detection);
    }
    if (!capture.known_position) continue;
    KnownPosition& place = *capture.known_position;
    const double n = static_cast<double>(kPlaces[k]);
    const Eigen::Vector3d measured_m =
        predict_position(truth, k) +
        0.5 * place.sd_m * Eigen::Vector3d(std::sin(2 * n + 1), std::cos(n), 0.7);
    place.xy_m = measured_m.head<2>();
    if (place.z_m) place.z_m = measured_m.z();
  }
}

Eigen::VectorXd AdjustmentRoom::compute_residuals(
    const State& state, double noise_scale, const std::vector<Eigen::Matrix2d>& whitening) const {
  std::vector<double> rows;
  const auto add_rows = [&](const Eigen::VectorXd& values) {
    rows.insert(rows.end(), values.begin(), values.end());
  };
  const Lens lens = make_lens(state);
  std::size_t count = 0;
  for (std::size_t k = 0; k < input.captures.size(); ++k) {
    for (const Detection& detection : input.captures[k].detections) {
      Eigen::Vector2d residual = detection.pixel - predict_pixel(state, lens, k, detection);
      if (!whitening.empty()) residual = (whitening[count++] * residual).eval();
      if (whitening.empty()) residual /= *detection.sigma_px;
      add_rows(residual / noise_scale);
    }
  }
  add_rows(state.lens);
  for (const std::size_t i : {0U, 2U, 3U, 4U}) {
    const Lamp& lamp = input.lamps.lamps[i];
    add_rows((state.lamps_m[i] - lamp.position_m) / *lamp.sd_m);
  }
  for (std::size_t k = 0; k < input.captures.size(); ++k) {
    const KnownMotion& motion = input.captures[k].motion;
    if (motion.velocity_sd_m_per_s > 0) {
      add_rows((state.velocities_m_per_s[k] - motion.velocity_m_per_s) /
               motion.velocity_sd_m_per_s);
    }
    if (motion.yaw_rate_sd_rad_per_s > 0) {
      rows.push_back((state.yaw_rates_rad_per_s[k] - motion.yaw_rate_rad_per_s) /
                     motion.yaw_rate_sd_rad_per_s);
    }
    if (const auto& place = input.captures[k].known_position) {
      const Eigen::Vector3d position_m = predict_position(state, k);
      const double sd_m = place->sd_m * std::sqrt(kCapturesOfPlace[kPlaces[k]]);
      add_rows((position_m.head<2>() - place->xy_m) / sd_m);
      if (place->z_m) rows.push_back((position_m.z() - *place->z_m) / sd_m);
    }
  }
  return Eigen::Map<Eigen::VectorXd>(rows.data(), std::ssize(rows));
}

AdjustmentRoom::Solution AdjustmentRoom::solve(
    double min_scale, const std::vector<Eigen::Matrix2d>& whitening) const {
  constexpr Eigen::Index detection_rows = 2 * (13 * 5 - 1);
  Solution found{};
  found.noise_scale = 1;
  DenseSolution dense{pack(make_true_state()), {}, {}, {}};
  for (double ratio = 2; std::abs(ratio - 1) > 0.01;) {
    dense = solve_least_squares(
        [&](const Eigen::VectorXd& unknowns) {
          return compute_residuals(unpack(unknowns), found.noise_scale, whitening);
        },
        dense.unknowns);
    found.degrees_of_freedom = dense.degrees_of_freedom(detection_rows);
    found.residual =
        std::sqrt(dense.residuals.head(detection_rows).squaredNorm() / found.degrees_of_freedom);
    ratio = std::max(found.noise_scale * found.residual, min_scale) / found.noise_scale;
    if (std::abs(ratio - 1) > 0.01) found.noise_scale *= ratio;
  }
  const State state = unpack(dense.unknowns);
  found.lens = state.lens;
  found.lens_covariance = dense.covariance.topLeftCorner<3, 3>();
  // The exact lamp, with rows 19 to 21, is no unknown.
  Eigen::MatrixXd from_unknowns = Eigen::MatrixXd::Zero(31, 19);
  from_unknowns.topLeftCorner(12, 3) = lens_root_;
  from_unknowns.block(12, 3, 7, 7).setIdentity();
  from_unknowns.bottomRightCorner(9, 9).setIdentity();
  found.covariance =
      from_unknowns * dense.covariance.topLeftCorner(19, 19) * from_unknowns.transpose();
  found.parameters.resize(31);
  found.parameters << compute_intrinsics(state), state.zenith, state.arm_m, state.lamps_m[0],
      state.lamps_m[1], state.lamps_m[2], state.lamps_m[3], state.lamps_m[4];
  found.position_residuals_m.assign(8, Eigen::Vector3d(0, 0, 0));
  for (std::size_t k = 0; k < input.captures.size(); ++k) {
    for (const Detection& detection : input.captures[k].detections) {
      found.lamp_height_m += (state.lamps_m[static_cast<std::size_t>(detection.lamp - 11)].z() -
                              state.poses[k].position_m.z()) /
                             (detection_rows / 2);
    }
    const auto& place = input.captures[k].known_position;
    if (!place) continue;
    Eigen::Vector3d residual_m = predict_position(state, k);
    residual_m -=
        Eigen::Vector3d(place->xy_m.x(), place->xy_m.y(), place->z_m.value_or(residual_m.z()));
    found.position_residuals_m[kPlaces[k]] += residual_m / kCapturesOfPlace[kPlaces[k]];
  }
  return found;
}

}  // namespace vlp
