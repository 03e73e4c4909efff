// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Fixes that are rejected for bodies that may move or be tilted, and wrong identities of lamps.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "support/body_rig.h"
#include "support/matchers.h"

namespace vlp {
namespace {

constexpr double kBodyNoise_px = 0.1;
/// Standard deviation of roll and pitch of a hand-held camera.
constexpr double kAny_rad = 1.6;

class PositionerMovingOrTiltedCamera : public testing::Test {
 protected:
  BodyRig rig{synthetic_lamps(),
              rolling_calibration(),
              {{{0.1, -0.05, 0}, 0.4}, {{0.7, -0.4}, 0.5, {0, 0}}},
              {}};
  Random random{61};

  static Sensors driving() {
    Sensors sensors;
    sensors.motion = KnownMotion::make_motion_prior_from_limits(2, 3);
    return sensors;
  }
  static Sensors leaning() {
    Sensors sensors;
    sensors.inclination_sigma_rad = kAny_rad;
    return sensors;
  }
  static Sensors held() {
    Sensors sensors = driving();
    sensors.inclination_sigma_rad = kAny_rad;
    return sensors;
  }
  void lean() { rig.body.motion.inclination = {0.06, -0.08}; }
  void stand() { rig.body.motion = {{0, 0}, 0, rig.body.motion.inclination}; }

  std::vector<Detection> seen() { return with_noise(seen_from(rig, kBodyNoise_px), random); }
  Fix locate(const std::vector<Detection>& detections, const Sensors& sensors) const {
    return rig.positioner().compute_position_fix(detections, sensors);
  }
  /// Expects errors below five reported standard deviations.
  void expect_truth(const Fix& fix) const {
    ASSERT_TRUE(fix.has_succeeded()) << fix_status_name(fix.status);
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(fix.state.pose.position_m[i], rig.body.pose.position_m[i],
                  5 * std::sqrt(fix.pose_covariance()(i, i)));
    }
  }
};

TEST_F(PositionerMovingOrTiltedCamera, ReturnsRowTimeUnknownForMotionWithoutReadoutTiming) {
  auto detections = seen();
  rig.calibration.camera.row_time_s.reset();
  EXPECT_EQ(locate(detections, driving()).status, FixStatus::row_time_unknown);
  rig.calibration.camera.row_time_s = 3e-5;
  rig.calibration.camera.readout.reset();
  EXPECT_EQ(locate(detections, driving()).status, FixStatus::row_time_unknown);
  EXPECT_TRUE(locate(detections, leaning()).has_succeeded());
}

TEST_F(PositionerMovingOrTiltedCamera, ReturnsFixWithTimeOfSensors) {
  Sensors sensors = driving();
  sensors.time_s = 17.25;
  EXPECT_EQ(locate(seen(), sensors).time_s, 17.25);
  sensors.motion.reset();
  stand();
  EXPECT_EQ(locate(seen(), sensors).time_s, 17.25);
}

TEST_F(PositionerMovingOrTiltedCamera, ReturnsNotFiniteForNanOrInvalidSdOfSensors) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (int which = 0; which < 6; ++which) {
    Sensors sensors = driving();
    if (which == 0) sensors.motion->velocity_m_per_s.y() = nan;
    if (which == 1) sensors.motion->velocity_sd_m_per_s = -1;
    if (which == 2) sensors.motion->yaw_rate_sd_rad_per_s = nan;
    if (which == 3) sensors.inclination_sigma_rad = -0.1;
    if (which == 4) sensors.height = KnownHeight{0, 0};
    if (which == 5) sensors.height = KnownHeight{nan, 1};
    EXPECT_EQ(locate(seen(), sensors).status, FixStatus::not_finite) << which;
  }
}

TEST_F(PositionerMovingOrTiltedCamera, ReturnsNotFiniteForEarlierFramesOfLaterOrEqualTime) {
  const auto detections = seen();
  const double infinite_s = std::numeric_limits<double>::infinity();
  const double nan_s = std::numeric_limits<double>::quiet_NaN();
  for (const auto& [times_s, status] :
       {std::pair<std::vector<double>, FixStatus>({0.05, 0.1}, FixStatus::ok),
        {{0}, FixStatus::not_finite},
        {{-0.05}, FixStatus::not_finite},
        {{infinite_s}, FixStatus::not_finite},
        {{nan_s}, FixStatus::not_finite},
        {{0.1, 0.05, 0.1}, FixStatus::not_finite}}) {
    std::vector<std::vector<Detection>> before;
    for (const double before_s : times_s) {
      before.push_back(seen_from(rig, kBodyNoise_px, before_s > 0 && before_s < 1 ? -before_s : 0));
    }
    std::vector<EarlierFrame> frames;
    for (std::size_t i = 0; i < before.size(); ++i) frames.push_back({before[i], times_s[i]});
    EXPECT_EQ(rig.positioner().compute_position_fix(detections, driving(), frames).status, status)
        << testing::PrintToString(times_s);
  }
}

/// Two lamps do not determine roll and pitch. The covariance includes the unknown velocity.
TEST_F(PositionerMovingOrTiltedCamera, ReturnsUndeterminedForTwoLampsWithFreeTilt) {
  auto detections = seen();
  detections.resize(2);
  EXPECT_EQ(locate(detections, leaning()).status, FixStatus::undetermined);
  EXPECT_EQ(locate(detections, held()).status, FixStatus::undetermined);
  const Fix fix = locate(detections, driving());
  expect_truth(fix);
  EXPECT_GT(std::sqrt(fix.pose_covariance()(2, 2)), 0.003);
}

TEST_F(PositionerMovingOrTiltedCamera, ReturnsUndeterminedForCollinearLampsWithFreeTilt) {
  rig.map = make_lamp_map({{-0.7, 0.1, 1.6}, {0, 0.1, 1.6}, {0.7, 0.1, 1.6}});
  stand();
  EXPECT_EQ(locate(seen(), leaning()).status, FixStatus::undetermined);
  Sensors nearly_level;
  nearly_level.inclination_sigma_rad = 0.01;
  expect_truth(locate(seen(), nearly_level));
}

/// Three lamps fit several poses of a camera with unknown tilt; a known height selects one.
TEST_F(PositionerMovingOrTiltedCamera, KnownHeightResolvesMostAmbiguitiesOfThreeLamps) {
  int ambiguous = 0, num_resolved = 0;
  for (int i = 0; i < 200; ++i) {
    rig.body.pose.position_m = {random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), 0};
    rig.body.motion = {{0, 0}, 0, {random.uniform(-0.5, 0.5), 0.2}};
    auto detections = seen();
    if (detections.size() < 3) continue;
    detections.resize(3);
    const Fix alone = locate(detections, leaning());
    if (alone.has_succeeded()) expect_truth(alone);
    ambiguous += alone.status == FixStatus::ambiguous;
    Sensors with_height = leaning();
    with_height.height = KnownHeight{0, 0.02};
    const Fix fix = locate(detections, with_height);
    if (!fix.has_succeeded()) continue;
    expect_truth(fix);
    num_resolved += alone.status == FixStatus::ambiguous;
  }
  EXPECT_GT(ambiguous, 30);
  EXPECT_GT(num_resolved, ambiguous / 2);
}

TEST_F(PositionerMovingOrTiltedCamera, RejectsMisidentifiedLampAndReturnsTruth) {
  for (const bool leans : {false, true}) {
    if (leans) lean();
    for (std::size_t wrong = 0; wrong < 5; ++wrong) {
      auto detections = seen();
      ASSERT_EQ(detections.size(), 8);
      detections.resize(leans ? 7 : 5);
      const auto is_seen = [&](int id) {
        return std::any_of(detections.begin(), detections.end(),
                           [&](const Detection& detection) { return detection.lamp == id; });
      };
      int id = 8;
      while (is_seen(id)) --id;
      detections[wrong].lamp = id;
      const Fix fix = locate(detections, leans ? held() : driving());
      SCOPED_TRACE(testing::Message() << wrong << " is taken for " << id << ", lean " << leans);
      expect_truth(fix);
      EXPECT_EQ(fix.rejected_ids[0], id);
    }
  }
}

TEST_F(PositionerMovingOrTiltedCamera, ReturnsNoFixWhenAllLampsContradict) {
  for (const Sensors& sensors : {driving(), leaning(), held()}) {
    auto detections = seen();
    ASSERT_EQ(detections.size(), 8);
    for (Detection& detection : detections) detection.lamp = 1 + (detection.lamp * 3) % 8;
    EXPECT_FALSE(locate(detections, sensors).has_succeeded());
  }
}

TEST_F(PositionerMovingOrTiltedCamera, ReturnsInconsistentOrMirroredMapForThreeLamps) {
  stand();
  Sensors slow;
  slow.motion = KnownMotion::make_motion_prior_from_limits(0.1, 0.1);
  auto detections = seen();
  ASSERT_EQ(detections.size(), 8);
  detections.resize(3);
  ASSERT_TRUE(locate(detections, slow).has_succeeded());
  auto displaced = detections;
  displaced[0].pixel.x() += 60;
  EXPECT_EQ(locate(displaced, slow).status, FixStatus::inconsistent);
  for (Lamp& lamp : rig.map.lamps) lamp.position_m.y() *= -1;
  EXPECT_EQ(locate(detections, slow).status, FixStatus::mirrored_map);
}

TEST_F(PositionerMovingOrTiltedCamera, ReturnsMirroredMapForMirroredLampMap) {
  const auto drive = seen();
  lean();
  const auto in_hand = seen();
  for (Lamp& lamp : rig.map.lamps) lamp.position_m.y() *= -1;
  EXPECT_EQ(locate(drive, driving()).status, FixStatus::mirrored_map);
  EXPECT_EQ(locate(in_hand, held()).status, FixStatus::mirrored_map);
  EXPECT_EQ(locate(in_hand, leaning()).status, FixStatus::mirrored_map);
}

/// In a room and in a hall of ten times its size.
TEST_F(PositionerMovingOrTiltedCamera, RejectsTwoSwappedLampsAndReturnsTruth) {
  for (const double scale : {1, 10}) {
    for (Lamp& lamp : rig.map.lamps) lamp.position_m *= scale;
    rig.body.pose.position_m *= scale;
    for (std::size_t a = 0; a < 8; ++a) {
      for (std::size_t b = a + 1; b < 8; ++b) {
        auto detections = seen();
        ASSERT_EQ(detections.size(), 8);
        std::swap(detections[a].lamp, detections[b].lamp);
        SCOPED_TRACE(testing::Message() << a << " and " << b << ", scale " << scale);
        const Fix fix = locate(detections, driving());
        expect_truth(fix);
        EXPECT_EQ(fix.rejected_lamps, 2);
      }
    }
  }
}

/// A lamp 36 mm away from its position in the map.
TEST_F(PositionerMovingOrTiltedCamera, RejectsLampMovedBy36MmAndReturnsTruth) {
  for (const bool leans : {false, true}) {
    if (leans) lean();
    const LampMap map = rig.map;
    rig.map.lamps[2].position_m += Eigen::Vector3d(0.03, -0.02, 0);
    const auto detections = seen();
    rig.map = map;
    const Fix fix = locate(detections, leans ? held() : driving());
    expect_truth(fix);
    EXPECT_EQ(fix.rejected_ids[0], 3);
  }
}

/// The lamps determine each state to a few percent of its prior.
TEST_F(PositionerMovingOrTiltedCamera, ReturnsInconsistentForStateBeyondFiveSigmasOfPrior) {
  Sensors known;
  known.motion = KnownMotion{{0, 0}, 0, 0.4, 0.4};
  known.inclination_sigma_rad = 0.02;
  for (const auto& [sigmas, status] :
       {std::pair(4.7, FixStatus::ok), {5.4, FixStatus::inconsistent}}) {
    for (const int which : {0, 1, 2}) {
      stand();
      BodyMotion& motion = rig.body.motion;
      motion.inclination = {0, 0};
      if (which == 0) motion.velocity_m_per_s = {0.8 * sigmas * 0.4, -0.6 * sigmas * 0.4};
      if (which == 1) motion.yaw_rate_rad_per_s = sigmas * 0.4;
      if (which == 2) motion.inclination = {0.6 * sigmas * 0.02, 0.8 * sigmas * 0.02};
      EXPECT_EQ(locate(seen_from(rig, 0.01), known).status, status) << which << ", " << sigmas;
    }
  }
}

/// A tilted camera with a level prior is inconsistent; with free roll and pitch it is located.
TEST_F(PositionerMovingOrTiltedCamera, ReturnsInconsistentForTiltedCameraUnlessTiltIsFree) {
  rig.body.motion = {{0, 0}, 0, {0.7, -0.5}};
  rig.map = draw_lamps_in_view(rig, 6, true, 0.3, random);
  EXPECT_EQ(locate(seen(), {}).status, FixStatus::inconsistent);
  EXPECT_NE(describe_fix_status(FixStatus::inconsistent).find("tilt"), std::string_view::npos);
  expect_truth(locate(seen(), leaning()));
}

/// Noise of 2.5 times the reported one: a lamp is rejected only if that explains the residuals a
/// hundred times better.
TEST_F(PositionerMovingOrTiltedCamera, RejectsOutlierOnlyWhenFarAboveUnderstatedNoise) {
  for (const auto& [moved_px, rejected] : {std::pair(7.0, 0), {25.0, 1}}) {
    auto detections = with_noise(seen_from(rig, 2.5 * kBodyNoise_px), random);
    ASSERT_EQ(detections.size(), 8);
    for (Detection& detection : detections) detection.sigma_px = kBodyNoise_px;
    detections[5].pixel.x() += moved_px;
    const Fix fix = locate(detections, driving());
    ASSERT_TRUE(fix.has_succeeded()) << fix_status_name(fix.status);
    EXPECT_GT(fix.chi_squared, (rejected == 0 ? 100 : 2) * fix.redundancy);
    EXPECT_EQ(fix.rejected_lamps, rejected) << moved_px << " px";
  }
}

/// Three lamps determine position and tilt exactly: without any of four the others agree.
TEST_F(PositionerMovingOrTiltedCamera, RejectsNoneOfFourLampsWithFreeTiltIfOneIsMoved) {
  stand();
  for (std::size_t moved = 0; moved < 4; ++moved) {
    auto detections = seen_from(rig, kBodyNoise_px);
    ASSERT_EQ(detections.size(), 8);
    detections.resize(4);
    detections[moved].pixel += Eigen::Vector2d(6, 4);
    const Fix fix = locate(detections, leaning());
    ASSERT_TRUE(fix.has_succeeded()) << fix_status_name(fix.status);
    EXPECT_GT(fix.chi_squared, 25 * fix.redundancy);
    EXPECT_EQ(fix.rejected_lamps, 0) << moved;
  }
}

TEST_F(PositionerMovingOrTiltedCamera, CountsLampsAndSightingsOfEarlierFrames) {
  stand();
  auto before = seen_from(rig, kBodyNoise_px);
  ASSERT_EQ(before.size(), 8);
  auto now = before;
  now.resize(5);
  now[4].lamp = 77;
  before[0].lamp = 78;
  const EarlierFrame earlier{before, 0.05};
  const Fix fix = rig.positioner().compute_position_fix(now, driving(), {&earlier, 1});
  ASSERT_TRUE(fix.has_succeeded());
  EXPECT_EQ(fix.lamps, 4);
  EXPECT_EQ(fix.sightings, 4 + 7);
  EXPECT_EQ(fix.unknown_lamps, 1);
  EXPECT_NEAR(fix.redundancy, 2 * 11 - 7, 0.1);
  EXPECT_THAT(fix.state.pose.position_m, IsNear(rig.body.pose.position_m, 1e-8));
}

TEST_F(PositionerMovingOrTiltedCamera, PositionAndYawRateMatchTruthWithEarlierFrame) {
  const double before_s = 0.05;
  const auto now = seen_from(rig, kBodyNoise_px), before = seen_from(rig, kBodyNoise_px, -before_s);
  ASSERT_TRUE(now.size() == 8 && before.size() == 8);
  const EarlierFrame earlier{before, before_s};
  Sensors sensors;
  sensors.motion = KnownMotion{{0, 0}, 0, 1e3, 1e3};
  const Fix fix = rig.positioner().compute_position_fix(now, sensors, {&earlier, 1});
  ASSERT_TRUE(fix.has_succeeded()) << fix_status_name(fix.status);
  EXPECT_THAT(fix.state.pose.position_m, IsNear(rig.body.pose.position_m, 1e-7));
  EXPECT_NEAR(fix.state.motion.yaw_rate_rad_per_s, 0.5, 1e-5);
}

}  // namespace
}  // namespace vlp
