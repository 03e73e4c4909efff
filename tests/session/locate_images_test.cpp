// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/locate_step.h"

#include <gmock/gmock.h>

#include "geometry/angles.h"
#include "support/body_rig.h"

namespace vlp {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

/// Camera tilted by 20 degrees. Errors of lamp centers: 40 px per radian of the angle error of the
/// detection plane, or 2 px for ellipses in place of discs.
class LeaningRig {
 public:
  LeaningRig() { rig_.body.motion.inclination = lean_; }

  LocateInput input(double roll_pitch_sd_rad) const {
    LocateInput input{{{"a", seen_in(Eigen::Matrix3d::Identity())}}, rig_.map, rig_.calibration};
    input.roll_pitch_sd_rad = roll_pitch_sd_rad;
    return input;
  }
  Redetector redetector() {
    return [this](const LevelRotations& levels) {
      std::vector<Frame> frames;
      for (const auto& [image, level] : levels) {
        EXPECT_EQ(image, "a");
        looks.push_back(level ? deg_from_rad(off_rad(*level)) : -1);
        frames.push_back({image, seen_in(level)});
      }
      return frames;
    };
  }
  std::vector<Detection> exact() const { return seen_from(rig_, 0.05); }

  /// Error of the level direction of each detection, degrees; -1: unknown level.
  std::vector<double> looks;
  /// Only ellipses show lamps.
  bool shown_by_ellipses_alone = false;
  /// Detection with ellipses returns one lamp only.
  bool has_one_lamp_with_ellipses = false;

 private:
  double off_rad(const Eigen::Matrix3d& level) const {
    const Eigen::Vector3d up = level_rotation_from_inclination(lean_).row(2);
    return std::acos(std::min(1.0, up.dot(level.row(2))));
  }
  std::vector<Detection> seen_in(const std::optional<Eigen::Matrix3d>& level) const {
    std::vector<Detection> seen = exact();
    const double off_px = level ? 40 * off_rad(*level) : 2;
    for (Detection& one : seen) one.pixel += off_px * Eigen::Vector2d(one.lamp % 2, one.lamp % 3);
    if (shown_by_ellipses_alone) seen.resize(level ? 1 : 2);
    if (has_one_lamp_with_ellipses && !level) seen.resize(1);
    return seen;
  }

  Inclination lean_{rad_from_deg(16), rad_from_deg(-12)};
  BodyRig rig_{synthetic_lamps(), rolling_calibration(), {}, {}};
};

double error_m(const LocateInput& input) {
  const LocateResult found = locate_camera_from_detections(input);
  return found.has_succeeded() ? found.rows[0].fix->pose.position_m.norm() : 1;
}

TEST(RedetectLampsUntilTiltConverges, ReducesPositionErrorBelow100MicrometersForUnknownTilt) {
  LeaningRig rig;
  LocateInput input = rig.input(1.6);
  EXPECT_GT(error_m(input), 0.01);
  const LevelRotations levels = redetect_lamps_until_tilt_converges(input, rig.redetector());
  EXPECT_LT(error_m(input), 1e-4);
  ASSERT_EQ(levels.size(), 1U);
  EXPECT_TRUE(levels.at("a"));
  ASSERT_GE(rig.looks.size(), 3U);
  EXPECT_LE(rig.looks.size(), 7U);
  EXPECT_EQ(rig.looks[0], -1) << "of no plane, as the lean may be any";
  EXPECT_LT(rig.looks.back(), 0.01);
}

TEST(RedetectLampsUntilTiltConverges, SkipsCapturesOnlyWhenInclinationIsExact) {
  LeaningRig rig;
  LocateInput input = rig.input(0);
  input.captures["a"].inclination = Inclination{rad_from_deg(16), rad_from_deg(-12)};
  const double before_m = error_m(input);
  EXPECT_THAT(redetect_lamps_until_tilt_converges(input, rig.redetector()), IsEmpty());
  EXPECT_THAT(rig.looks, IsEmpty());
  EXPECT_EQ(error_m(input), before_m);
  input.inclination_sigma_rad = rad_from_deg(0.5);
  redetect_lamps_until_tilt_converges(input, rig.redetector());
  EXPECT_LT(error_m(input), 1e-4) << "but for a sensor that is not exact";
}

TEST(RedetectLampsUntilTiltConverges, BeginsWithEllipsesOnlyForTiltSdAboveThreeDegrees) {
  for (const double sd_rad : {0.045, 0.055}) {
    LeaningRig rig;
    LocateInput input = rig.input(sd_rad);
    input.captures["a"].inclination = Inclination{rad_from_deg(15), rad_from_deg(-11)};
    input.inclination_sigma_rad = sd_rad;
    redetect_lamps_until_tilt_converges(input, rig.redetector());
    ASSERT_FALSE(rig.looks.empty());
    EXPECT_EQ(rig.looks[0] == -1, sd_rad > 0.05) << sd_rad;
    EXPECT_LT(error_m(input), 1e-3);
  }
}

TEST(RedetectLampsUntilTiltConverges, ContinuesFromFirstFixIfEllipsesHaveNone) {
  LeaningRig rig;
  rig.has_one_lamp_with_ellipses = true;
  LocateInput input = rig.input(1.6);
  EXPECT_GT(error_m(input), 0.01);
  const LevelRotations levels = redetect_lamps_until_tilt_converges(input, rig.redetector());
  ASSERT_GE(rig.looks.size(), 3U);
  EXPECT_EQ(rig.looks[0], -1);
  EXPECT_GE(rig.looks[1], 0);
  EXPECT_LT(error_m(input), 1e-3);
  ASSERT_EQ(levels.size(), 1U);
  EXPECT_TRUE(levels.at("a"));
}

TEST(RedetectLampsUntilTiltConverges, KeepsDetectionsWithMoreLampsWhenFixFails) {
  LeaningRig rig;
  rig.shown_by_ellipses_alone = true;
  LocateInput input = rig.input(1.6);
  const LevelRotations levels = redetect_lamps_until_tilt_converges(input, rig.redetector());
  EXPECT_THAT(rig.looks, ElementsAre(-1));
  EXPECT_EQ(input.frames[0].detections.size(), 2U);
  ASSERT_EQ(levels.size(), 1U);
  EXPECT_FALSE(levels.at("a"));
}

}  // namespace
}  // namespace vlp
