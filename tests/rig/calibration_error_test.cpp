// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/calibration_error.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "support/matchers.h"

namespace vlp {
namespace {

Calibration leaning() {
  const Eigen::Vector2d zenith(0.02, -0.01);
  Calibration calibration{
      {"", {800, 600}, LensModel::pinhole, {500, 510, 400, 300}, {}, {}, {}}, {}, {}, {}, {}};
  calibration.rotation_center =
      RotationCenter{RotationModel::tilt, {410, 294.9}, zenith.homogeneous().normalized(), {}};
  calibration.dispersion = Dispersion{{0.5, -0.2}, 0.001, {0, 0}, 12};
  return calibration;
}

TEST(AddIntrinsicsError, ChangesIntrinsicsAndRotationCenterPixelButNotZenith) {
  const Calibration moved = add_intrinsics_error(leaning(), Eigen::Vector4d(10, -5, 1, 2));
  EXPECT_EQ(moved.camera.intrinsics, (std::vector<double>{510, 505, 401, 302}));
  ASSERT_TRUE(moved.rotation_center);
  EXPECT_EQ(moved.rotation_center->zenith_in_camera, leaning().rotation_center->zenith_in_camera);
  EXPECT_THAT(moved.rotation_center->center_px,
              IsNear(Eigen::Vector2d(401 + 0.02 * 510, 302 - 0.01 * 505), 1e-9));
  Calibration alone = leaning();
  alone.rotation_center.reset();
  EXPECT_FALSE(add_intrinsics_error(alone, Eigen::Vector4d(1, 0, 0, 0)).rotation_center);
}

TEST(AddZenithError, AddsErrorToNormalizedZenithPointAndMovesCenterPixel) {
  const Calibration moved = add_zenith_error(leaning(), {0.001, 0.002});
  ASSERT_TRUE(moved.rotation_center);
  EXPECT_THAT(compute_zenith_point(*moved.rotation_center),
              IsNear(Eigen::Vector2d(0.021, -0.008), 1e-15));
  EXPECT_NEAR(moved.rotation_center->zenith_in_camera.norm(), 1, 1e-15);
  EXPECT_THAT(moved.rotation_center->center_px,
              IsNear(Eigen::Vector2d(400 + 0.021 * 500, 300 - 0.008 * 510), 1e-9));
}

TEST(AddOffsetError, AddsErrorTimesFocalLengthToDispersionOffset) {
  const Calibration moved = add_offset_error(leaning(), {0.001, -0.002});
  ASSERT_TRUE(moved.dispersion && moved.rotation_center);
  EXPECT_THAT(moved.dispersion->offset_px, IsNear(Eigen::Vector2d(1, -1.22), 1e-12));
  EXPECT_EQ(moved.rotation_center->center_px, leaning().rotation_center->center_px);
}

TEST(AppendParameters, CovarianceIsPropagatedByJacobianPlusIndependentErrors) {
  JointCovariance joint;
  Eigen::MatrixXd lens(2, 2), jacobian(2, 2);
  lens << 4, 1, 1, 2;
  jacobian << 1, 2, 0, 3;
  append_parameters(joint, std::array<std::string, 2>{"fx", "fy"}, Eigen::MatrixXd(2, 0), lens);
  append_parameters(joint, list_pair_names(kZenithParameter), jacobian,
                    Eigen::MatrixXd::Identity(2, 2));
  EXPECT_EQ(joint.parameters, (std::vector<std::string>{"fx", "fy", "zenith_x", "zenith_y"}));
  EXPECT_EQ(joint.find_row(kZenithParameter), 2);
  EXPECT_FALSE(joint.find_row(kOffsetParameter));
  Eigen::Matrix4d expected;
  expected << lens, lens * jacobian.transpose(), jacobian * lens,
      jacobian * lens * jacobian.transpose() + Eigen::Matrix2d::Identity();
  EXPECT_THAT(joint.matrix, IsNear(expected, 1e-15));
}

/// A pinhole with a zenith that is known with the lens, and its covariance.
Calibration leaning_with_covariance(Eigen::MatrixXd& matrix) {
  Calibration calibration = leaning();
  calibration.intrinsics_report.emplace().covariance =
      Eigen::Vector4d(0.04, 0.05, 0.01, 0.02).asDiagonal().toDenseMatrix();
  JointCovariance joint = make_lens_covariance(calibration);
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(2, 4);
  jacobian.rightCols<2>() = -Eigen::Vector2d(1 / 500., 1 / 510.).asDiagonal().toDenseMatrix();
  append_parameters(joint, list_pair_names(kZenithParameter), jacobian,
                    1e-8 * Eigen::Matrix2d::Identity());
  append_parameters(joint, list_pair_names(kOffsetParameter), Eigen::MatrixXd::Zero(2, 6),
                    1e-6 * Eigen::Matrix2d::Identity());
  matrix = joint.matrix;
  calibration.covariance = joint;
  return calibration;
}

TEST(FindParameterCovariance, ReturnsNulloptForUnknownParameterAndWithoutKnownLensErrors) {
  Eigen::MatrixXd matrix;
  Calibration calibration = leaning_with_covariance(matrix);
  const auto zenith = find_parameter_covariance(calibration, kZenithParameter);
  ASSERT_TRUE(zenith);
  EXPECT_EQ(*zenith, (matrix.block<2, 2>(4, 4)));
  EXPECT_FALSE(find_parameter_covariance(calibration, kLeverArmParameter));
  const JointCovariance joint = *calibration.covariance;
  calibration.covariance = {{}, {"zenith_x", "zenith_y"}, matrix.block<2, 2>(4, 4)};
  EXPECT_FALSE(find_parameter_covariance(calibration, kZenithParameter));
  calibration.intrinsics_report->covariance.reset();
  EXPECT_TRUE(find_parameter_covariance(calibration, kZenithParameter));
  calibration.covariance.reset();
  EXPECT_FALSE(find_parameter_covariance(calibration, kZenithParameter));
}

TEST(ComputeCenterCovariance, CancelsErrorOfPrincipalPointThatZenithCompensates) {
  Eigen::MatrixXd matrix;
  const auto covariance = compute_center_covariance(leaning_with_covariance(matrix));
  ASSERT_TRUE(covariance);
  const Matrix2 expected{{2.5e-3 + 0.02 * 0.02 * 0.04, 0}, {0, 2.601e-3 + 1e-4 * 0.05}};
  EXPECT_THAT(*covariance, IsNear(expected, 1e-12));
}

TEST(ComputeOffsetCovariance, ScalesByFocalLengths) {
  Eigen::MatrixXd matrix;
  const auto covariance = compute_offset_covariance(leaning_with_covariance(matrix));
  ASSERT_TRUE(covariance);
  EXPECT_THAT(*covariance, IsNear(Matrix2{{0.25, 0}, {0, 0.2601}}, 1e-12));
}

}  // namespace
}  // namespace vlp
