// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Compares errors of body fixes at random positions with the Cramer-Rao lower bound.
#include "positioning/error_budget.h"

#include <gtest/gtest.h>

#include <cstdio>

#include "support/body_rig.h"

namespace vlp {
namespace {

constexpr double kLimitNoise_px = 0.05;

/// Squared errors of X, Y, Z, yaw over the Cramer-Rao bound, and over the reported variances.
struct OverLimit {
  Eigen::Array4d over_limit = Eigen::Array4d::Zero(), over_stated = Eigen::Array4d::Zero();
  int fixes = 0, refused = 0;

  void add(const Fix& fix, const Pose& truth, const Matrix4& limit) {
    if (!fix.has_succeeded()) {
      ++refused;
      return;
    }
    Eigen::Array4d error;
    error << (fix.state.pose.position_m - truth.position_m).array(),
        wrap_angle_rad(fix.state.pose.yaw_rad - truth.yaw_rad);
    over_limit += error.square() / limit.diagonal().array();
    over_stated += error.square() / fix.noise_covariance.diagonal().head<4>().array();
    ++fixes;
  }
  Eigen::Array4d ratio() const { return (over_limit / fixes).sqrt(); }
  Eigen::Array4d stated_ratio() const { return (over_stated / fixes).sqrt(); }
};

/// Returns the covariance of the fix of exact observations, which equals the bound.
std::optional<Matrix4> compute_limit(const BodyRig& rig, const Sensors& sensors) {
  const Fix exact = rig.positioner().compute_position_fix(seen_from(rig, kLimitNoise_px), sensors);
  if (!exact.has_succeeded()) return std::nullopt;
  return exact.noise_covariance.topLeftCorner<4, 4>();
}

/// Four or five lamps of a ceiling, tilt of up to 80 degrees known from the image alone: errors at
/// most 1.5 times the bound of six states.
TEST(Positioner, FixErrorsAreAtMost150PercentOfCramerRaoBoundForTiltUpTo80Degrees) {
  Random random(81);
  Sensors in_hand;
  in_hand.inclination_sigma_rad = 1.6;
  for (const auto& [min_deg, max_deg] : {std::pair(0.0, 30.0), {30.0, 60.0}, {60.0, 80.0}}) {
    OverLimit found;
    int lamps_seen = 0;
    while (found.fixes + found.refused < 200) {
      BodyRig rig{{}, rolling_calibration(), {}, {}};
      const double tilt_rad = rad_from_deg(random.uniform(min_deg, max_deg));
      rig.body.pose = {{random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), 0},
                       random.uniform(-3.1, 3.1)};
      Inclination& lean = rig.body.motion.inclination;
      (random.uniform(0, 1) < 0.5 ? lean.roll_rad : lean.pitch_rad) =
          random.uniform(0, 1) < 0.5 ? tilt_rad : -tilt_rad;
      const std::size_t lamps = 4 + random.index(2);
      rig.map = draw_lamps_in_view(rig, lamps, true, 0.2, random);
      const auto exact = seen_from(rig, kLimitNoise_px);
      const auto limit = compute_limit(rig, in_hand);
      if (exact.size() < 4 || !limit) continue;
      lamps_seen += static_cast<int>(exact.size());
      found.add(rig.positioner().compute_position_fix(with_noise(exact, random), in_hand),
                rig.body.pose, *limit);
    }
    std::printf(
        "lean %2.0f to %2.0f degrees: %d fixes, %d refused, %.1f lamps, over the limit "
        "%.2f %.2f %.2f, yaw %.2f\n",
        min_deg, max_deg, found.fixes, found.refused,
        lamps_seen / double(found.fixes + found.refused), found.ratio()[0], found.ratio()[1],
        found.ratio()[2], found.ratio()[3]);
    EXPECT_LT(found.ratio().maxCoeff(), 1.5);
    EXPECT_LT(found.refused, 10);
  }
}

/// A camera at rest with a prior of up to 2 m/s: its errors are 0.9 to 1.1 of the reported standard
/// deviations, with four lamps and with eight.
TEST(Positioner, FixErrorsMatchReportedSdsWithUnknownMotion) {
  Random random(82);
  Sensors might_drive;
  might_drive.motion = KnownMotion::make_motion_prior_from_limits(2, rad_from_deg(180));
  for (const std::size_t lamps : {4U, 8U}) {
    OverLimit with_motion, at_rest;
    Eigen::Array4d price = Eigen::Array4d::Zero();
    for (int i = 0; i < 600; ++i) {
      BodyRig rig{synthetic_lamps(), rolling_calibration(), {}, {}};
      rig.map.lamps.resize(lamps);
      rig.body.pose = {{random.uniform(-0.3, 0.3), random.uniform(-0.2, 0.2), 0},
                       random.uniform(-3.1, 3.1)};
      const auto exact = seen_from(rig, kLimitNoise_px);
      const auto limit = compute_limit(rig, might_drive), standing = compute_limit(rig, {});
      if (exact.size() < 4 || !limit || !standing) continue;
      const auto noisy = with_noise(exact, random);
      with_motion.add(rig.positioner().compute_position_fix(noisy, might_drive), rig.body.pose,
                      *limit);
      at_rest.add(rig.positioner().compute_position_fix(noisy), rig.body.pose, *standing);
      price += limit->diagonal().array() / standing->diagonal().array();
    }
    price = (price / with_motion.fixes).sqrt().eval();
    std::printf(
        "%zu lamps, %d fixes: price %.2f %.2f %.2f, yaw %.2f; error over stated %.3f %.3f "
        "%.3f, yaw %.3f\n",
        lamps, with_motion.fixes, price[0], price[1], price[2], price[3],
        with_motion.stated_ratio()[0], with_motion.stated_ratio()[1], with_motion.stated_ratio()[2],
        with_motion.stated_ratio()[3]);
    EXPECT_GT(with_motion.fixes, 300);
    EXPECT_EQ(with_motion.refused, 0);
    for (const OverLimit* one : {&with_motion, &at_rest}) {
      EXPECT_GT(one->stated_ratio().minCoeff(), 0.9);
      EXPECT_LT(one->stated_ratio().maxCoeff(), 1.1);
    }
    EXPECT_GT(price.minCoeff(), 1);
  }
}

}  // namespace
}  // namespace vlp
