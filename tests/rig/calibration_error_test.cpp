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
  calibration.rotation_center = RotationCenter{
      RotationModel::tilt, {410, 294.9}, zenith.homogeneous().normalized(), {}, {}, {}, {}};
  calibration.dispersion = Dispersion{{0.5, -0.2}, 0.001, {0, 0}, 12};
  return calibration;
}

TEST(AddErrorToCalibratedIntrinsics, ChangesIntrinsicsAndRotationCenterPixelButNotZenith) {
  const Calibration moved =
      add_error_to_calibrated_intrinsics(leaning(), Eigen::Vector4d(10, -5, 1, 2));
  EXPECT_EQ(moved.camera.intrinsics, (std::vector<double>{510, 505, 401, 302}));
  ASSERT_TRUE(moved.rotation_center);
  EXPECT_EQ(moved.rotation_center->zenith_in_camera, leaning().rotation_center->zenith_in_camera);
  EXPECT_THAT(moved.rotation_center->center_px,
              IsNear(Eigen::Vector2d(401 + 0.02 * 510, 302 - 0.01 * 505), 1e-9));
  Calibration alone = leaning();
  alone.rotation_center.reset();
  EXPECT_FALSE(
      add_error_to_calibrated_intrinsics(alone, Eigen::Vector4d(1, 0, 0, 0)).rotation_center);
}

TEST(AddErrorToCalibratedZenith, AddsErrorToNormalizedZenithPointAndMovesCenterPixel) {
  const Calibration moved = add_error_to_calibrated_zenith(leaning(), {0.001, 0.002});
  ASSERT_TRUE(moved.rotation_center);
  EXPECT_THAT(compute_normalized_zenith_point(*moved.rotation_center),
              IsNear(Eigen::Vector2d(0.021, -0.008), 1e-15));
  EXPECT_NEAR(moved.rotation_center->zenith_in_camera.norm(), 1, 1e-15);
  EXPECT_THAT(moved.rotation_center->center_px,
              IsNear(Eigen::Vector2d(400 + 0.021 * 500, 300 - 0.008 * 510), 1e-9));
}

TEST(AddErrorToCalibratedDispersionOffset, AddsErrorTimesFocalLengthToDispersionOffset) {
  const Calibration moved = add_error_to_calibrated_dispersion_offset(leaning(), {0.001, -0.002});
  ASSERT_TRUE(moved.dispersion && moved.rotation_center);
  EXPECT_THAT(moved.dispersion->offset_px, IsNear(Eigen::Vector2d(1, -1.22), 1e-12));
  EXPECT_EQ(moved.rotation_center->center_px, leaning().rotation_center->center_px);
}

}  // namespace
}  // namespace vlp
