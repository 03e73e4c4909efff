// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// The part of a fix's covariance that calibration and lamp map make, against fixes made again with
/// each of them a little off; lamps that this does not explain.
#include "positioning/common_errors.h"

#include <gtest/gtest.h>

#include "positioning/positioner.h"
#include "positioning/stated_rig.h"
#include "support/near.h"

namespace vlp {
namespace {

class CommonToFixes : public testing::Test {
 protected:
  StatedRig rig;

  static Eigen::Vector4d state_of(const Fix& fix) {
    Eigen::Vector4d state;
    state << fix.estimate.pose.position_m, fix.estimate.pose.yaw_rad;
    return state;
  }
};

/// G by differences of whole fixes: nothing is shared with the formula.
class OfFixes : public CommonToFixes, public testing::WithParamInterface<Sensors> {};

TEST_P(OfFixes, IsThatOfThoseMadeWithEachParameterALittleOff) {
  rig.adjust(1);
  rig.calibration.camera.row_time_s = 3e-5;
  rig.calibration.camera.readout = Readout::rows;
  const Adjustment adjustment = *rig.calibration.adjustment;
  const auto detections = seen_from(rig, 0.1);
  const auto fix_with = [&](Eigen::Index parameter, double by) {
    SyntheticRig other = rig;
    other.calibration.adjustment.reset();
    RotationCenter& center = *other.calibration.rotation_center;
    if (parameter < 12) {
      other.calibration.camera.intrinsics[static_cast<std::size_t>(parameter)] += by;
    } else if (parameter < 14) {
      Eigen::Vector3d zenith = center.zenith_in_camera / center.zenith_in_camera.z();
      zenith[parameter - 12] += by;
      center.zenith_in_camera = zenith.normalized();
    } else if (parameter >= 16) {
      other.map.lamps[static_cast<std::size_t>(parameter - 16) / 3]
          .position_m[(parameter - 16) % 3] += by;
    }
    return state_of(Positioner(other.map, other.calibration).locate(detections, GetParam()));
  };
  Eigen::MatrixXd by_parameters(4, 40);
  for (Eigen::Index i = 0; i < 40; ++i) {
    const double step = i < 4 ? 1e-3 : 1e-6;
    by_parameters.col(i) = (fix_with(i, step) - fix_with(i, -step)) / (2 * step);
  }
  const Eigen::Matrix4d expected =
      by_parameters * adjustment.covariance * by_parameters.transpose();
  const Fix fix = Positioner(rig.map, rig.calibration).locate(detections, GetParam());
  ASSERT_TRUE(fix.ok());
  EXPECT_THAT(fix.estimate.covariance - fix.noise_covariance,
              IsNear(expected, 1e-4 * expected.cwiseAbs().maxCoeff()));
  rig.calibration.adjustment.reset();
  const Fix noise = Positioner(rig.map, rig.calibration).locate(detections, GetParam());
  EXPECT_EQ(noise.estimate.covariance, noise.noise_covariance);
  EXPECT_THAT(fix.noise_covariance, IsNear(noise.noise_covariance, 1e-15));
}

Sensors sensors(double inclination_sigma_rad, const std::optional<KnownMotion>& motion) {
  Sensors sensors;
  sensors.inclination_sigma_rad = inclination_sigma_rad;
  sensors.motion = motion;
  return sensors;
}

std::string name_of_body(const testing::TestParamInfo<Sensors>& body) {
  std::string name = body.param.motion ? "Driving" : "Standing";
  if (body.param.inclination_sigma_rad > 0) name += "AndLeaning";
  return name;
}

INSTANTIATE_TEST_SUITE_P(Bodies, OfFixes,
                         testing::Values(sensors(0, {}), sensors(0, KnownMotion::up_to(1, 1)),
                                         sensors(0.1, {}), sensors(0.1, KnownMotion::up_to(1, 1))),
                         name_of_body);

TEST_F(CommonToFixes, OfASurveyIsItsStandardDeviationThroughTheFix) {
  for (Lamp& lamp : rig.map.lamps) lamp.sd_m = 0.002;
  const Fix fix = Positioner(rig.map, rig.calibration).locate(seen_from(rig, 0.1));
  const Matrix4 common = fix.estimate.covariance - fix.noise_covariance;
  // Eight lamps of 2 mm around the camera: 2 / sqrt(8) and a little more.
  EXPECT_NEAR(std::sqrt(common(0, 0)), 0.00075, 0.00008);
}

TEST_F(CommonToFixes, NamesALampThatNothingUncertainExplains) {
  rig.adjust(0.3);
  Random random(8);
  for (const double off_m : {0.01, 0.03}) {
    for (std::size_t moved = 0; moved < 8; ++moved) {
      SyntheticRig room = rig;
      room.map.lamps[moved].position_m.x() += off_m;
      const auto detections = with_noise(seen_from(room, 0.03), random);
      const Fix fix = Positioner(rig.map, rig.calibration).locate(detections);
      ASSERT_TRUE(fix.ok());
      EXPECT_EQ(fix.rejected_lamps, 1) << off_m << " m, lamp " << moved + 1;
      EXPECT_EQ(fix.rejected_ids[0], static_cast<int>(moved) + 1);
      EXPECT_THAT(fix.estimate.pose.position_m, IsNear(rig.camera.position_m, 0.001));
    }
  }
}

TEST_F(CommonToFixes, LeavesLampsAloneThatTheSurveyExplains) {
  rig.adjust(3);
  Random random(9);
  for (std::size_t moved = 0; moved < 8; ++moved) {
    SyntheticRig room = rig;
    room.map.lamps[moved].position_m.y() += 0.004;
    const Fix fix =
        Positioner(rig.map, rig.calibration).locate(with_noise(seen_from(room, 0.03), random));
    ASSERT_TRUE(fix.ok());
    EXPECT_EQ(fix.rejected_lamps, 0);
  }
}

}  // namespace
}  // namespace vlp
