// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <cmath>

#include "positioning/positioner.h"
#include "support/body_rig.h"
#include "support/matchers.h"

namespace vlp {
namespace {

/// Robot that drives, turns and is tilted.
class FixResult : public testing::Test {
 protected:
  BodyRig rig{synthetic_lamps(),
              rolling_calibration(),
              {{{0.1, -0.05, 0}, 0.4}, {{0.8, -0.6}, 1.5, {0.06, -0.08}}},
              CameraMount{{0.2, -0.1, 0.3}, 0.5}};
};

TEST_F(FixResult, ProjectedLampsAreDetectionsOfMovingCamera) {
  const auto detections = seen_from(rig, 0.1);
  ASSERT_GE(detections.size(), 4U);
  for (const Detection& detection : detections) {
    EXPECT_THAT(rig.positioner().project_lamp(detection.lamp, rig.body).pixel,
                IsNear(detection.pixel, 1e-6));
  }
  EXPECT_TRUE(std::isnan(rig.positioner().project_lamp(1000, rig.body).pixel.x()));
}

TEST_F(FixResult, ProjectionJacobianEqualsDifferences) {
  const Positioner positioner = rig.positioner();
  const int lamp = rig.map.lamps.front().id;
  const LampProjection projection = positioner.project_lamp(lamp, rig.body);
  ASSERT_TRUE(projection.pixel.allFinite());
  for (int i = 0; i < kBodyStates; ++i) {
    constexpr double step = 1e-5;
    const auto pixel_after = [&](double change) {
      BodyState state = rig.body;
      auto& [pose, motion] = state;
      const std::array<double*, kBodyStates> numbers{
          &pose.position_m.x(),         &pose.position_m.y(),
          &pose.position_m.z(),         &pose.yaw_rad,
          &motion.velocity_m_per_s.x(), &motion.velocity_m_per_s.y(),
          &motion.yaw_rate_rad_per_s,   &motion.inclination.roll_rad,
          &motion.inclination.pitch_rad};
      *numbers[static_cast<std::size_t>(i)] += change;
      return positioner.project_lamp(lamp, state).pixel;
    };
    const Eigen::Vector2d expected = (pixel_after(step) - pixel_after(-step)) / (2 * step);
    EXPECT_THAT(Eigen::Vector2d(projection.jacobian.col(i)),
                IsNear(expected, 1e-6 * (1 + expected.norm())))
        << i;
  }
}

TEST_F(FixResult, DetectionsAreUsedRejectedOrNotInMapAndHaveRmsOfFix) {
  rig.body.motion = {};
  Random random(3);
  auto detections = with_noise(seen_from(rig, 0.1), random);
  ASSERT_GE(detections.size(), 5U);
  detections[1].pixel.x() += 60;
  Detection unknown = detections[0];
  unknown.lamp = 1000;
  detections.push_back(unknown);
  const Positioner positioner = rig.positioner();
  const Fix fix = positioner.compute_position_fix(detections);
  ASSERT_TRUE(fix.has_succeeded()) << fix_status_name(fix.status);
  double squares_px2 = 0;
  for (std::size_t i = 0; i < detections.size(); ++i) {
    const auto [use, predicted, residual_px] =
        positioner.compute_detection_residual(detections[i], fix);
    EXPECT_EQ(use, i == 1                       ? DetectionUse::rejected
                   : i + 1 == detections.size() ? DetectionUse::not_in_map
                                                : DetectionUse::used);
    if (use == DetectionUse::used) squares_px2 += residual_px.squaredNorm();
    if (use == DetectionUse::rejected) EXPECT_NEAR(residual_px.x(), 60, 1);
    if (use == DetectionUse::not_in_map) EXPECT_TRUE(std::isnan(predicted.pixel.x()));
  }
  ASSERT_EQ(fix.rejected_lamps, 1);
  EXPECT_NEAR(std::sqrt(squares_px2 / fix.lamps), fix.residual_px, 1e-3);
}

TEST_F(FixResult, AmbiguousFixListsCandidatesWithLikelihoods) {
  Random random(5);
  int ambiguous = 0, with_truth = 0;
  for (int i = 0; i < 20; ++i) {
    rig.body = {{{random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), 0}, random.uniform(-3, 3)},
                {{0, 0}, 0, {random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3)}}};
    auto detections = seen_from(rig, 0.1);
    if (detections.size() < 3) continue;
    detections.resize(3);
    Sensors sensors;
    sensors.inclination_sigma_rad = 1.6;
    const Fix fix = rig.positioner().compute_position_fix(detections, sensors);
    if (fix.status != FixStatus::ambiguous) continue;
    ++ambiguous;
    ASSERT_GE(fix.num_candidates, 2);
    double sum = 0, min_distance_m = 1;
    for (int k = 0; k < fix.num_candidates; ++k) {
      const auto& [state, likelihood] = fix.candidates[static_cast<std::size_t>(k)];
      sum += likelihood;
      EXPECT_LE(likelihood, fix.candidates[0].likelihood);
      min_distance_m =
          std::min(min_distance_m, (state.pose.position_m - rig.body.pose.position_m).norm());
    }
    EXPECT_NEAR(sum, 1, 1e-12);
    with_truth += min_distance_m < 1e-3;
  }
  ASSERT_GT(ambiguous, 10);
  EXPECT_GE(with_truth, ambiguous - 1);
}

}  // namespace
}  // namespace vlp
