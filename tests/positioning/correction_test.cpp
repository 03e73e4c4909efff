// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/correction.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <stdexcept>

#include "support/matchers.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

Eigen::Vector2d seen_at(const Eigen::Matrix3d& level_from_camera, const Eigen::Vector2d& z) {
  return (level_from_camera * z.homogeneous()).eval().hnormalized();
}

class ComputeLevelFromCameraMatrix : public testing::Test {
 protected:
  Calibration calibration{synthetic_camera(), {}, {}, {}, {}};
  Eigen::Vector2d focal_px = calibration.camera.focal_px();
  Eigen::Vector2d z{0.3, -0.2};
};

TEST_F(ComputeLevelFromCameraMatrix, ThrowsWhenRequestedCorrectionIsMissing) {
  EXPECT_THROW(compute_level_from_camera_matrix(calibration, Correction::rotation),
               std::invalid_argument);
  EXPECT_THROW(compute_level_from_camera_matrix(calibration, Correction::dispersion),
               std::invalid_argument);
}

TEST_F(ComputeLevelFromCameraMatrix, SubtractsOffsetOfRotationCenterForShiftModel) {
  const Eigen::Vector2d principal = calibration.camera.principal_point_px();
  calibration.rotation_center = {
      RotationModel::shift, principal + Eigen::Vector2d(9, -4), {0, 0, 1}, {}};
  const Eigen::Vector2d moved =
      seen_at(compute_level_from_camera_matrix(calibration, Correction::all), z);
  EXPECT_THAT(moved, IsNear(z - Eigen::Vector2d(9, -4).cwiseQuotient(focal_px), 1e-15));
}

TEST_F(ComputeLevelFromCameraMatrix, SubtractsDispersionOffsetWithoutRotationCenter) {
  calibration.dispersion = {{3, 5}, 0.01, {0, 0}, 12};
  const Eigen::Vector2d expected = z - Eigen::Vector2d(3, 5).cwiseQuotient(focal_px);
  EXPECT_THAT(seen_at(compute_level_from_camera_matrix(calibration, Correction::dispersion), z),
              IsNear(expected, 1e-15));
  EXPECT_EQ(compute_level_from_camera_matrix(calibration, Correction::none),
            Eigen::Matrix3d::Identity());
  EXPECT_THROW(compute_level_from_camera_matrix(calibration, Correction::rotation),
               std::invalid_argument);
}

TEST_F(ComputeLevelFromCameraMatrix, ReturnsRotationForTiltFollowedByDispersionOffset) {
  calibration.rotation_center = tilted_by(calibration.camera, 0.05, 2);
  calibration.dispersion = {{3, 5}, 0.01, {0, 0}, 12};
  const Eigen::Matrix3d matrix = compute_level_from_camera_matrix(calibration, Correction::all);
  EXPECT_THAT(Eigen::Matrix3d(matrix * matrix.transpose()),
              IsNear(Eigen::Matrix3d::Identity(), 1e-14));
  const Eigen::Matrix3d tilt = compute_level_from_camera_matrix(calibration, Correction::rotation);
  const Eigen::Vector2d offset = Eigen::Vector2d(3, 5).cwiseQuotient(focal_px);
  const Eigen::Vector3d ray = tilt.transpose() * Eigen::Vector3d(offset.x(), offset.y(), 1);
  EXPECT_THAT(seen_at(matrix, ray.hnormalized()), IsNear(Eigen::Vector2d(0, 0), 1e-15));
}

}  // namespace
}  // namespace vlp
