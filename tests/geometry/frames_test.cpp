// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "geometry/frames.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "support/matchers.h"
#include "support/random.h"

namespace vlp {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using std::numbers::pi;

Vector3d random_zenith(Random& random) {
  const double tilt_rad = random.uniform(0, 1.5), toward_rad = random.uniform(-pi, pi);
  return random.uniform(0.1, 10) * Vector3d(std::sin(tilt_rad) * std::cos(toward_rad),
                                            std::sin(tilt_rad) * std::sin(toward_rad),
                                            std::cos(tilt_rad));
}

void expect_rotation(const Matrix3d& rotation) {
  EXPECT_THAT(rotation * rotation.transpose(), IsNear(Matrix3d::Identity(), 1e-15));
  EXPECT_NEAR(rotation.determinant(), 1, 1e-15);
}

TEST(RotationAboutZ, RotatesCounterClockwiseSeenFromAbove) {
  EXPECT_THAT(rotation_about_z(pi / 2) * Vector3d::UnitX(), IsNear(Vector3d::UnitY(), 1e-16));
  EXPECT_THAT(rotation_about_z(0.3) * Vector3d::UnitZ(), IsNear(Vector3d::UnitZ(), 0));
}

TEST(LevelRotationFromZenith, RotatesZenithToPlusZ) {
  Random random(1);
  for (int trial = 0; trial < 1000; ++trial) {
    const Vector3d zenith = random_zenith(random);
    const Vector3d up = level_rotation_from_zenith(zenith) * zenith;
    EXPECT_THAT(up, IsNear(Vector3d(0, 0, zenith.norm()), 1e-15 * zenith.norm()));
  }
}

TEST(LevelRotationFromZenith, ReturnsProperRotationMatrix) {
  Random random(2);
  for (int trial = 0; trial < 1000; ++trial) {
    expect_rotation(level_rotation_from_zenith(random_zenith(random)));
  }
}

TEST(LevelRotationFromZenith, ReturnsSmallestRotation) {
  Random random(3);
  for (int trial = 0; trial < 1000; ++trial) {
    const Vector3d zenith = random_zenith(random);
    const Matrix3d level_from_camera = level_rotation_from_zenith(zenith);
    // Any rotation that takes the zenith up turns by the angle between them or more; with yaw it
    // turns by more.
    const auto angle_rad = [](const Matrix3d& rotation) {
      return Eigen::AngleAxisd(rotation).angle();
    };
    const double tilt_rad = std::atan2(zenith.head<2>().norm(), zenith.z());
    EXPECT_NEAR(angle_rad(level_from_camera), tilt_rad, 1e-14);
    EXPECT_GT(angle_rad(rotation_about_z(0.01) * level_from_camera), tilt_rad);
    EXPECT_GT(angle_rad(rotation_about_z(-0.01) * level_from_camera), tilt_rad);
  }
}

TEST(LevelRotationFromZenith, ReturnsIdentityForLevelCamera) {
  EXPECT_THAT(level_rotation_from_zenith({0, 0, 2}), IsNear(Matrix3d::Identity(), 0));
}

TEST(LevelRotationFromZenith, MatchesFirstOrderRotationForTinyTilt) {
  const Vector3d zenith(1e-12, -2e-12, 1);
  // To first order the camera's axes lean by the tilt itself.
  Matrix3d expected;
  expected << 1, 0, -1e-12, 0, 1, 2e-12, 1e-12, -2e-12, 1;
  EXPECT_THAT(level_rotation_from_zenith(zenith), IsNear(expected, 1e-23));
}

TEST(LevelRotationFromInclination, PitchLowersXAxisAndRollRaisesYAxis) {
  // Right-handed about y: x goes to -z. Right-handed about x: y goes to +z.
  EXPECT_LT((level_rotation_from_inclination({0, 0.1}) * Vector3d::UnitX()).z(), -0.09);
  EXPECT_GT((level_rotation_from_inclination({0.1, 0}) * Vector3d::UnitY()).z(), 0.09);
  EXPECT_THAT(level_rotation_from_inclination({0, 0.1}) * Vector3d::UnitY(),
              IsNear(Vector3d::UnitY(), 0));
  EXPECT_THAT(level_rotation_from_inclination({0.1, 0}) * Vector3d::UnitX(),
              IsNear(Vector3d::UnitX(), 0));
}

TEST(LevelRotationFromInclination, ReturnsPitchRotationTimesRollRotation) {
  const double roll_rad = 0.2, pitch_rad = 0.3;
  const double sr = std::sin(roll_rad), cr = std::cos(roll_rad);
  const double sp = std::sin(pitch_rad), cp = std::cos(pitch_rad);
  Matrix3d expected;
  expected << cp, sp * sr, sp * cr, 0, cr, -sr, -sp, cp * sr, cp * cr;
  EXPECT_THAT(level_rotation_from_inclination({roll_rad, pitch_rad}), IsNear(expected, 2e-16));
  // A roll does not change the direction of the camera's x axis, which the pitch alone sets.
  EXPECT_THAT(level_rotation_from_inclination({1, pitch_rad}) * Vector3d::UnitX(),
              IsNear(Vector3d(cp, 0, -sp), 2e-16));
}

TEST(LevelRotationFromInclination, ReturnsProperRotationMatrix) {
  Random random(4);
  for (int trial = 0; trial < 100; ++trial) {
    expect_rotation(
        level_rotation_from_inclination({random.uniform(-3, 3), random.uniform(-1.5, 1.5)}));
  }
}

TEST(LevelPointFromWorld, TransformsKnownPointToLevelFrameOfTurnedCamera) {
  // One meter along world y from the camera, which is turned by a quarter from x to y: the
  // point is on its x axis.
  const Vector3d x_in_level = level_point_from_world({{2, 3, 0.5}, pi / 2}, {2, 4, 2.5});
  EXPECT_THAT(x_in_level, IsNear(Vector3d(1, 0, 2), 1e-15));
}

TEST(LevelPointFromWorld, InvertsTransformFromLevelToWorldFrame) {
  Random random(5);
  const auto point = [&random] {
    return Vector3d(random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-5, 5));
  };
  for (int trial = 0; trial < 100; ++trial) {
    const Pose level{point(), random.uniform(-7, 7)};
    const Vector3d x_in_level = point();
    const Vector3d x_in_world = level.position_m + rotation_about_z(level.yaw_rad) * x_in_level;
    EXPECT_THAT(level_point_from_world(level, x_in_world), IsNear(x_in_level, 1e-14));
  }
}

}  // namespace
}  // namespace vlp
