// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/calibration_error.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <iterator>
#include <utility>

#include "camera/lens_table.h"
#include "camera/spline_grid.h"

namespace vlp {
namespace {

/// Updates center_px to the pixel of the zenith in the undistorted image.
void update_center_pixel(Calibration& calibration) {
  if (!calibration.rotation_center) return;
  RotationCenter& center = *calibration.rotation_center;
  center.center_px = compute_zenith_point(center).cwiseProduct(calibration.camera.focal_px()) +
                     calibration.camera.principal_point_px();
}

}  // namespace

Eigen::Index count_intrinsics(const Camera& camera) {
  constexpr Eigen::Index core = 4;
  return is_splined_lens_model(camera.lens_model) ? core : std::ssize(camera.intrinsics);
}

std::vector<std::string> list_intrinsics_names(const Camera& camera) {
  std::vector<std::string> names{"fx", "fy", "cx", "cy"};
  for (const auto& distortion : list_distortions(camera.lens_model)) {
    names.emplace_back(distortion.name);
  }
  return names;
}

std::array<std::string, 3> list_lamp_parameters(int id) {
  const std::string prefix = "lamp_" + std::to_string(id);
  return {prefix + "_x_m", prefix + "_y_m", prefix + "_z_m"};
}

std::array<std::string, 2> list_pair_names(std::string_view first) {
  std::string second(first);
  second[first.find('x')] = 'y';
  return {std::string(first), second};
}

Eigen::Vector2d compute_zenith_point(const RotationCenter& center) {
  return center.zenith_in_camera.hnormalized();
}

JointCovariance make_lens_covariance(const Calibration& calibration) {
  JointCovariance joint;
  const auto& report = calibration.intrinsics_report;
  if (report && report->covariance) {
    append_parameters(joint, list_intrinsics_names(calibration.camera),
                      MatrixX(report->covariance->rows(), 0), *report->covariance);
  }
  return joint;
}

JointCovariance make_covariance(const Camera& camera,
                                std::vector<JointCovariance::LampPosition> lamps,
                                const MatrixX& matrix) {
  JointCovariance joint{std::move(lamps), {}, matrix};
  if (matrix.rows() > 4 + 3 * std::ssize(joint.lamps))
    joint.parameters = list_intrinsics_names(camera);
  for (const std::string_view first : {kZenithParameter, kLeverArmParameter})
    std::ranges::move(list_pair_names(first), std::back_inserter(joint.parameters));
  for (const auto& lamp : joint.lamps)
    std::ranges::move(list_lamp_parameters(lamp.id), std::back_inserter(joint.parameters));
  return joint;
}

void append_parameters(JointCovariance& joint, std::span<const std::string> names,
                       const MatrixX& jacobian, const MatrixX& own) {
  const Eigen::Index before = joint.matrix.rows(), added = std::ssize(names);
  MatrixX extended(before + added, before + added);
  extended.topLeftCorner(before, before) = joint.matrix;
  extended.bottomLeftCorner(added, before) = jacobian * joint.matrix;
  extended.topRightCorner(before, added) = extended.bottomLeftCorner(added, before).transpose();
  extended.bottomRightCorner(added, added) =
      extended.bottomLeftCorner(added, before) * jacobian.transpose() + own;
  joint.matrix = 0.5 * (extended + extended.transpose());
  joint.parameters.insert(joint.parameters.end(), names.begin(), names.end());
}

std::optional<Matrix2> find_parameter_covariance(const Calibration& calibration,
                                                 std::string_view first_parameter) {
  const auto& joint = calibration.covariance;
  const auto& report = calibration.intrinsics_report;
  const auto row = joint ? joint->find_row(first_parameter) : std::nullopt;
  if (!row || (report && report->covariance && !joint->find_row("fx"))) return std::nullopt;
  return Matrix2(joint->matrix.block<2, 2>(*row, *row));
}

std::optional<Matrix2> compute_center_covariance(const Calibration& calibration) {
  if (!find_parameter_covariance(calibration, kZenithParameter)) return std::nullopt;
  const JointCovariance& joint = *calibration.covariance;
  MatrixX jacobian = MatrixX::Zero(2, joint.matrix.rows());
  const Eigen::Vector2d focal_px = calibration.camera.focal_px();
  jacobian.middleCols<2>(*joint.find_row(kZenithParameter)) = focal_px.asDiagonal();
  if (joint.find_row("fx")) {
    const Eigen::Vector2d zenith = compute_zenith_point(*calibration.rotation_center);
    jacobian.leftCols<2>() = zenith.asDiagonal();
    jacobian.middleCols<2>(2).setIdentity();
  }
  return Matrix2(jacobian * joint.matrix * jacobian.transpose());
}

std::optional<Matrix2> compute_offset_covariance(const Calibration& calibration) {
  const auto covariance = find_parameter_covariance(calibration, kOffsetParameter);
  if (!covariance) return std::nullopt;
  const Eigen::Vector2d focal_px = calibration.camera.focal_px();
  return Matrix2(focal_px.asDiagonal() * *covariance * focal_px.asDiagonal());
}

Calibration add_intrinsics_error(Calibration calibration, const Eigen::VectorXd& error) {
  auto& intrinsics = calibration.camera.intrinsics;
  Eigen::Map<Eigen::VectorXd>(intrinsics.data(), error.size()) += error;
  update_center_pixel(calibration);
  return calibration;
}

Calibration add_zenith_error(Calibration calibration, const Eigen::Vector2d& error) {
  RotationCenter& center = *calibration.rotation_center;
  center.zenith_in_camera = (compute_zenith_point(center) + error).homogeneous().normalized();
  update_center_pixel(calibration);
  return calibration;
}

Calibration add_offset_error(Calibration calibration, const Eigen::Vector2d& error) {
  calibration.dispersion->offset_px += error.cwiseProduct(calibration.camera.focal_px());
  return calibration;
}

}  // namespace vlp
