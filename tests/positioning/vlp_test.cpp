// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// The C API returns the values of the C++ API, in its own order, and throws no exceptions.
#include "positioning/vlp.h"

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "geometry/symmetric.h"
#include "positioning/positioner.h"
#include "support/body_rig.h"
#include "support/synthetic_rig.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

// The codes of the C interface are those of FixStatus.
static_assert(VLP_OK == static_cast<int>(FixStatus::ok));
static_assert(VLP_TOO_FEW_LAMPS == static_cast<int>(FixStatus::too_few_lamps));
static_assert(VLP_TOO_MANY_LAMPS == static_cast<int>(FixStatus::too_many_lamps));
static_assert(VLP_DUPLICATE_LAMP == static_cast<int>(FixStatus::duplicate_lamp));
static_assert(VLP_NOT_FINITE == static_cast<int>(FixStatus::not_finite));
static_assert(VLP_OUTSIDE_LENS == static_cast<int>(FixStatus::outside_lens));
static_assert(VLP_LAMP_BELOW_CAMERA == static_cast<int>(FixStatus::lamp_below_camera));
static_assert(VLP_DEGENERATE == static_cast<int>(FixStatus::degenerate));
static_assert(VLP_AMBIGUOUS == static_cast<int>(FixStatus::ambiguous));
static_assert(VLP_INCONSISTENT == static_cast<int>(FixStatus::inconsistent));
static_assert(VLP_MIRRORED_MAP == static_cast<int>(FixStatus::mirrored_map));
static_assert(VLP_UNDETERMINED == static_cast<int>(FixStatus::undetermined));
static_assert(VLP_ROW_TIME_UNKNOWN == static_cast<int>(FixStatus::row_time_unknown));
static_assert(VLP_NOT_IN_MAP == static_cast<int>(DetectionUse::not_in_map));
static_assert(VLP_REJECTED == static_cast<int>(DetectionUse::rejected));

using testing::HasSubstr;
using testing::IsEmpty;
using Handle = std::unique_ptr<vlp_positioner, void (*)(vlp_positioner*)>;
using Covariance =
    Eigen::Map<const Eigen::Matrix<double, kBodyStates, kBodyStates, Eigen::RowMajor>>;

/// A moving, tilted body under lamps, its files, and the positioners of both APIs.
class CInterface : public testing::Test {
 protected:
  CInterface() {
    rig.map.lamps[2].sd_m = 0.001;
    write_lamp_map(lamps, rig.map);
    write_calibration(calibration, rig.calibration);
    Random random(1);
    see(with_noise(seen_from(rig, 0.1), random));
  }
  /// Sets the detections of both APIs.
  void see(const std::vector<Detection>& detections) {
    seen = detections;
    given.clear();
    for (const auto& [lamp, pixel, sigma_px] : seen) {
      given.push_back({lamp, pixel.x(), pixel.y(), sigma_px.value_or(0)});
    }
  }

  Handle open(const vlp_options* options = nullptr) const {
    vlp_positioner* positioner = nullptr;
    EXPECT_EQ(vlp_open(lamps.c_str(), calibration.c_str(), options, &positioner), VLP_OK)
        << vlp_last_error();
    return {positioner, &vlp_close};
  }
  vlp_fix located(const vlp_positioner* positioner, const vlp_sensors* sensors) const {
    vlp_fix fix;
    EXPECT_EQ(vlp_locate(positioner, given.data(), given.size(), sensors, &fix), fix.status);
    return fix;
  }

  TemporaryFolder folder;
  const std::string lamps = folder / "lamps.yaml", calibration = folder / "calibration.yaml";
  BodyRig rig{synthetic_lamps(),
              rolling_calibration(),
              {{{0.1, -0.05, 0}, 0.4}, {{0.8, -0.6}, 0, {0.06, -0.08}}},
              {}};
  std::vector<Detection> seen;
  std::vector<vlp_detection> given;
};

/// Compares without tolerance.
void expect_same(const vlp_fix& c, const Fix& fix) {
  ASSERT_EQ(c.status, static_cast<int>(fix.status));
  ASSERT_EQ(c.status, VLP_OK);
  const Covariance covariance(c.covariance);
  EXPECT_EQ(covariance, fix.covariance);
  EXPECT_EQ(Covariance(c.noise_covariance), fix.noise_covariance);
  const auto& [pose, motion] = fix.state;
  EXPECT_EQ(Eigen::Vector3d(c.state.position_m), pose.position_m);
  EXPECT_EQ(c.state.yaw_rad, pose.yaw_rad);
  EXPECT_EQ(Eigen::Vector2d(c.state.velocity_m_per_s), motion.velocity_m_per_s);
  EXPECT_EQ(c.state.yaw_rate_rad_per_s, motion.yaw_rate_rad_per_s);
  EXPECT_EQ(c.state.roll_rad, motion.inclination.roll_rad);
  EXPECT_EQ(c.state.pitch_rad, motion.inclination.pitch_rad);
  EXPECT_EQ(c.chi_squared, fix.chi_squared);
  EXPECT_EQ(c.redundancy, fix.redundancy);
  EXPECT_EQ(c.residual_px, fix.residual_px);
  EXPECT_EQ(c.lamps, fix.lamps);
  EXPECT_EQ(c.rejected_lamps, fix.rejected_lamps);
  EXPECT_EQ(c.unknown_lamps, fix.unknown_lamps);
  EXPECT_TRUE(covariance.isApprox(covariance.transpose(), 1e-12));
  EXPECT_GE(eigendecompose(Eigen::MatrixXd(covariance)).values.minCoeff(), -1e-15);
}

TEST_F(CInterface, VlpLocateEqualsCppFixForStandingCamera) {
  rig.body.motion = {};
  see(seen_from(rig, 0.1));
  const auto positioner = open();
  expect_same(located(positioner.get(), nullptr), rig.positioner().compute_position_fix(seen));
  const vlp_fix fix = located(positioner.get(), nullptr);
  EXPECT_NEAR(fix.state.position_m[0], 0.1, 1e-9);
  EXPECT_EQ(fix.state.roll_rad, 0);
  EXPECT_EQ(Covariance(fix.covariance).row(kBodyRoll), Eigen::RowVectorXd::Zero(kBodyStates));
}

TEST_F(CInterface, VlpLocateEqualsCppFixForMovingTiltedRobot) {
  rig.mount = CameraMount{{0.2, -0.1, 0.3}, 0.5};
  vlp_options options = {};
  options.has_mount = 1;
  options.mount_position_m[0] = 0.2;
  options.mount_position_m[1] = -0.1;
  options.mount_position_m[2] = 0.3;
  options.mount_yaw_rad = 0.5;
  vlp_sensors sensors = {};
  sensors.stamp = std::numeric_limits<std::int64_t>::max() - 1;
  sensors.inclination_sigma_rad = 0.2;
  sensors.has_motion = 1;
  sensors.velocity_sd_m_per_s = 1;
  Sensors same;
  same.inclination_sigma_rad = 0.2;
  same.motion = KnownMotion{{0, 0}, 0, 1, 0};
  const Fix fix = rig.positioner().compute_position_fix(seen, same);
  const vlp_fix c = located(open(&options).get(), &sensors);
  expect_same(c, fix);
  EXPECT_EQ(c.stamp, sensors.stamp);
  // The error of the surveyed lamp is common to all fixes and affects all estimated states.
  const Covariance covariance(c.covariance), noise(c.noise_covariance);
  for (const int state : {static_cast<int>(kBodyVelocity), static_cast<int>(kBodyPitch)}) {
    EXPECT_GT(noise(state, state), 0);
    EXPECT_LT(noise(state, state), covariance(state, state));
  }
}

TEST_F(CInterface, VlpLocateAppliesSigmaAndResidualLimitOptions) {
  rig.body.motion = {};
  auto displaced = seen_from(rig, 0.1);
  displaced[1].pixel.x() += 4;
  for (Detection& detection : displaced) detection.sigma_px.reset();
  see(displaced);
  vlp_options options = {};
  options.unstated_sigma_px = 3;
  const vlp_fix fix = located(open(&options).get(), nullptr);
  PositionerOptions same;
  same.unstated_sigma_px = 3;
  expect_same(fix, Positioner(rig.map, rig.calibration, same).compute_position_fix(seen));
  EXPECT_EQ(fix.rejected_lamps, 0);
  options.max_residual_fraction = 0.003;
  const vlp_fix strict = located(open(&options).get(), nullptr);
  ASSERT_EQ(strict.status, VLP_OK);
  EXPECT_EQ(strict.rejected_lamps, 1);
  EXPECT_EQ(strict.rejected_ids[0], seen[1].lamp);
}

TEST_F(CInterface, VlpLocateEqualsCppFixWithOneLampAndSensors) {
  seen.resize(1);
  given.resize(1);
  vlp_sensors sensors = {};
  sensors.has_inclination = 1;
  sensors.roll_rad = 0.06;
  sensors.pitch_rad = -0.08;
  sensors.inclination_sigma_rad = 0.01;
  sensors.has_height_and_yaw = 1;
  sensors.camera_yaw_rad = 0.4;
  sensors.has_motion = 1;
  sensors.velocity_m_per_s[0] = 2;
  sensors.yaw_rate_rad_per_s = 0.1;
  sensors.yaw_rate_sd_rad_per_s = 0.2;
  sensors.camera_z_sd_m = 0.005;
  sensors.camera_yaw_sd_rad = 0.02;
  Sensors same{Inclination{0.06, -0.08}, 0.01, HeightAndYaw{0, 0.4, 0.005, 0.02}};
  same.motion = KnownMotion{{2, 0}, 0.1, 0, 0.2};
  const vlp_fix fix = located(open().get(), &sensors);
  expect_same(fix, rig.positioner().compute_position_fix(seen, same));
  EXPECT_NEAR(fix.state.roll_rad, 0.06, 1e-9);
  EXPECT_NEAR(Covariance(fix.covariance)(kBodyPitch, kBodyPitch), 1e-4, 1e-9);
  EXPECT_EQ(fix.state.velocity_m_per_s[0], 2);
  EXPECT_EQ(Covariance(fix.covariance)(kBodyVelocity, kBodyVelocity), 0);
  EXPECT_NEAR(Covariance(fix.covariance)(kBodyYawRate, kBodyYawRate), 0.04, 1e-6);
}

vlp_state convert_state(const BodyState& state) {
  const auto& [pose, motion] = state;
  return {{pose.position_m.x(), pose.position_m.y(), pose.position_m.z()},
          pose.yaw_rad,
          {motion.velocity_m_per_s.x(), motion.velocity_m_per_s.y()},
          motion.yaw_rate_rad_per_s,
          motion.inclination.roll_rad,
          motion.inclination.pitch_rad};
}

using StateJacobian = Eigen::Map<const Eigen::Matrix<double, 2, kBodyStates, Eigen::RowMajor>>;

TEST_F(CInterface, VlpProjectEqualsCppProjection) {
  const auto positioner = open();
  const vlp_state state = convert_state(rig.body);
  double pixel[2], jacobian[2 * VLP_STATES];
  for (const Detection& detection : seen) {
    const LampProjection expected = rig.positioner().project_lamp(detection.lamp, rig.body);
    ASSERT_TRUE(expected.pixel.allFinite());
    ASSERT_EQ(vlp_project(positioner.get(), detection.lamp, &state, pixel, jacobian), VLP_OK);
    EXPECT_EQ(Eigen::Vector2d(pixel), expected.pixel);
    EXPECT_EQ(StateJacobian(jacobian), expected.jacobian);
    EXPECT_NE(jacobian[kBodyPitch], jacobian[VLP_STATES + kBodyPitch]);
    EXPECT_EQ(vlp_project(positioner.get(), detection.lamp, &state, pixel, nullptr), VLP_OK);
  }
  EXPECT_EQ(vlp_project(positioner.get(), 9999, &state, pixel, jacobian), VLP_BAD_ARGUMENT);
}

TEST_F(CInterface, VlpComputeResidualsEqualsCppResiduals) {
  rig.body.motion = {};
  auto displaced = seen_from(rig, 0.1);
  displaced[1].pixel.x() += 30;
  displaced.push_back({9999, {100, 100}, 0.1});
  see(displaced);
  const auto positioner = open();
  const vlp_fix fix = located(positioner.get(), nullptr);
  ASSERT_EQ(fix.status, VLP_OK);
  ASSERT_EQ(fix.rejected_lamps, 1);
  const Fix expected_fix = rig.positioner().compute_position_fix(seen);
  std::vector<vlp_residual> residuals(given.size());
  ASSERT_EQ(
      vlp_compute_residuals(positioner.get(), given.data(), given.size(), &fix, residuals.data()),
      VLP_OK);
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto expected = rig.positioner().compute_detection_residual(seen[i], expected_fix);
    EXPECT_EQ(residuals[i].use, static_cast<int>(expected.use));
    if (expected.use == DetectionUse::not_in_map) {
      EXPECT_TRUE(std::isnan(residuals[i].residual_px[0]));
      continue;
    }
    EXPECT_EQ(Eigen::Vector2d(residuals[i].predicted_px), expected.predicted.pixel);
    EXPECT_EQ(Eigen::Vector2d(residuals[i].residual_px), expected.residual_px);
    EXPECT_EQ(StateJacobian(residuals[i].jacobian), expected.predicted.jacobian);
  }
  EXPECT_EQ(residuals[1].use, VLP_REJECTED);
  EXPECT_NEAR(residuals[1].residual_px[0], 30, 1e-3);
  EXPECT_EQ(residuals.back().use, VLP_NOT_IN_MAP);
  vlp_fix none = {};
  none.status = VLP_DEGENERATE;
  EXPECT_EQ(
      vlp_compute_residuals(positioner.get(), given.data(), given.size(), &none, residuals.data()),
      VLP_BAD_ARGUMENT);
}

TEST_F(CInterface, VlpLocateEqualsCppFixWithCorrelatedPrior) {
  StatePrior same{rig.body, BodyCovariance::Zero()};
  for (int i = 0; i < kBodyStates; ++i) same.covariance(i, i) = std::pow(0.01 * (i + 1), 2);
  same.covariance(0, kBodyYaw) = same.covariance(kBodyYaw, 0) = 0.5 * 0.01 * 0.04;
  vlp_prior prior = {};
  prior.mean = convert_state(same.mean);
  for (int row = 0; row < kBodyStates; ++row) {
    for (int column = 0; column < kBodyStates; ++column)
      prior.covariance[kBodyStates * row + column] = same.covariance(row, column);
  }
  vlp_sensors sensors = {};
  sensors.prior = &prior;
  Sensors expected;
  expected.prior = same;
  const auto positioner = open();
  expect_same(located(positioner.get(), &sensors),
              rig.positioner().compute_position_fix(seen, expected));
  prior.covariance[kBodyYaw] = 0;  // one side of the diagonal only
  EXPECT_EQ(located(positioner.get(), &sensors).status, VLP_NOT_FINITE);
}

TEST_F(CInterface, VlpLocateListsCandidatesOfAmbiguousFix) {
  rig.body.motion = {{0, 0}, 0, {0.3, -0.2}};
  auto three = seen_from(rig, 0.1);
  three.resize(3);
  see(three);
  vlp_sensors sensors = {};
  sensors.inclination_sigma_rad = 1;
  Sensors same;
  same.inclination_sigma_rad = 1;
  const vlp_fix fix = located(open().get(), &sensors);
  const Fix expected = rig.positioner().compute_position_fix(seen, same);
  ASSERT_EQ(fix.status, VLP_AMBIGUOUS);
  ASSERT_GT(fix.num_candidates, 1);
  ASSERT_EQ(fix.num_candidates, expected.num_candidates);
  double sum = 0, nearest_m = 1;
  for (int i = 0; i < fix.num_candidates; ++i) {
    const vlp_candidate& candidate = fix.candidates[i];
    const FixCandidate& other = expected.candidates[static_cast<std::size_t>(i)];
    EXPECT_EQ(candidate.likelihood, other.likelihood);
    EXPECT_EQ(Eigen::Vector3d(candidate.state.position_m), other.state.pose.position_m);
    sum += candidate.likelihood;
    nearest_m = std::min(
        nearest_m, (Eigen::Vector3d(candidate.state.position_m) - rig.body.pose.position_m).norm());
  }
  EXPECT_NEAR(sum, 1, 1e-9);
  EXPECT_LT(nearest_m, 1e-3);
}

TEST_F(CInterface, VlpLocateWithEarlierEqualsCppFix) {
  vlp_sensors sensors = {};
  sensors.has_motion = 1;
  sensors.velocity_sd_m_per_s = 1;
  Sensors same;
  same.motion = KnownMotion{{0, 0}, 0, 1, 0};
  rig.body.motion.velocity_m_per_s.setZero();
  see(seen_from(rig, 0.1));
  sensors.inclination_sigma_rad = same.inclination_sigma_rad = 0.2;
  const EarlierFrame frame{seen, 0.05};
  const vlp_earlier_frame given_frame{given.data(), given.size(), 0.05};
  const Handle positioner = open();
  vlp_fix fix;
  ASSERT_EQ(vlp_locate_with_earlier(positioner.get(), given.data(), given.size(), &sensors,
                                    &given_frame, 1, &fix),
            VLP_OK);
  expect_same(fix, rig.positioner().compute_position_fix(seen, same, {&frame, 1}));
}

TEST_F(CInterface, VlpLocateWithEarlierRejectsNullOrTooManyDetections) {
  const Handle positioner = open();
  vlp_fix fix;
  const vlp_earlier_frame null{nullptr, 3, 0.05};
  EXPECT_EQ(vlp_locate_with_earlier(positioner.get(), given.data(), given.size(), nullptr, &null, 1,
                                    &fix),
            VLP_BAD_ARGUMENT);
  EXPECT_EQ(vlp_locate_with_earlier(positioner.get(), given.data(), given.size(), nullptr, nullptr,
                                    1, &fix),
            VLP_BAD_ARGUMENT);
  const std::vector<vlp_detection> many(VLP_MAX_LAMPS, given.front());
  const vlp_earlier_frame large{many.data(), many.size(), 0.05};
  EXPECT_EQ(vlp_locate_with_earlier(positioner.get(), given.data(), given.size(), nullptr, &large,
                                    1, &fix),
            VLP_TOO_MANY_LAMPS);
  const vlp_earlier_frame largest{many.data(), many.size() - given.size(), 0.05};
  EXPECT_EQ(vlp_locate_with_earlier(positioner.get(), given.data(), given.size(), nullptr, &largest,
                                    1, &fix),
            VLP_DUPLICATE_LAMP);
}

TEST_F(CInterface, VlpLocateReturnsStampAndUnknownLampsWithoutFix) {
  ASSERT_FALSE(given.empty());
  for (vlp_detection& detection : given) detection.lamp += 100;
  vlp_sensors sensors = {};
  sensors.stamp = -7;
  const vlp_fix fix = located(open().get(), &sensors);
  EXPECT_EQ(fix.status, VLP_TOO_FEW_LAMPS);
  EXPECT_EQ(fix.stamp, -7);
  EXPECT_EQ(fix.unknown_lamps, static_cast<int>(given.size()));
  EXPECT_EQ(fix.state.position_m[0], 0);
}

TEST_F(CInterface, VlpLocateRejectsNullPointersExcessLampsAndInvalidSigma) {
  const auto positioner = open();
  vlp_fix fix;
  EXPECT_EQ(vlp_locate(nullptr, given.data(), given.size(), nullptr, &fix), VLP_BAD_ARGUMENT);
  EXPECT_EQ(fix.status, VLP_BAD_ARGUMENT);
  EXPECT_EQ(vlp_locate(positioner.get(), nullptr, 1, nullptr, &fix), VLP_BAD_ARGUMENT);
  EXPECT_EQ(vlp_locate(positioner.get(), given.data(), 1, nullptr, nullptr), VLP_BAD_ARGUMENT);
  EXPECT_EQ(vlp_locate(positioner.get(), nullptr, 0, nullptr, &fix), VLP_TOO_FEW_LAMPS);
  given.resize(VLP_MAX_LAMPS + 1);
  EXPECT_EQ(located(positioner.get(), nullptr).status, VLP_TOO_MANY_LAMPS);
  given.resize(2);
  for (const double bad : {-0.1, 1e-5, std::numeric_limits<double>::quiet_NaN()}) {
    given[0].sigma_px = bad;
    EXPECT_EQ(located(positioner.get(), nullptr).status, VLP_NOT_FINITE) << bad;
  }
  vlp_close(nullptr);
}

TEST_F(CInterface, VlpLastErrorNamesInvalidFileOrOption) {
  EXPECT_STREQ(vlp_last_error(), "");
  vlp_positioner* positioner = nullptr;
  const std::string missing = folder / "none.yaml";
  EXPECT_EQ(vlp_open(missing.c_str(), calibration.c_str(), nullptr, &positioner), VLP_BAD_FILE);
  EXPECT_EQ(positioner, nullptr);
  EXPECT_THAT(vlp_last_error(), HasSubstr("none.yaml"));
  EXPECT_EQ(vlp_open(lamps.c_str(), lamps.c_str(), nullptr, &positioner), VLP_BAD_FILE);
  EXPECT_THAT(vlp_last_error(), HasSubstr("is it the right file?"));
  vlp_options options = {};
  options.max_residual_fraction = -1;
  EXPECT_EQ(vlp_open(lamps.c_str(), calibration.c_str(), &options, &positioner), VLP_BAD_ARGUMENT);
  EXPECT_THAT(vlp_last_error(), HasSubstr("max_residual_fraction"));
  EXPECT_EQ(vlp_open(nullptr, calibration.c_str(), nullptr, &positioner), VLP_BAD_ARGUMENT);
  EXPECT_EQ(vlp_open(lamps.c_str(), calibration.c_str(), nullptr, nullptr), VLP_BAD_ARGUMENT);
  std::string of_another_thread = "?";
  std::thread([&] { of_another_thread = vlp_last_error(); }).join();
  EXPECT_THAT(of_another_thread, IsEmpty());
  const std::string endless(5000, 'x');
  EXPECT_EQ(vlp_open(endless.c_str(), calibration.c_str(), nullptr, &positioner), VLP_BAD_FILE);
  EXPECT_EQ(vlp_last_error(), endless.substr(0, 1023));
}

TEST(CFunctionVlpDescribeStatus, ReturnsDifferentTextForEachCode) {
  std::set<std::string> texts;
  for (int code = VLP_TOO_SMALL; code <= VLP_ROW_TIME_UNKNOWN; ++code) {
    texts.insert(vlp_describe_status(code));
  }
  EXPECT_EQ(texts.size(), static_cast<std::size_t>(VLP_ROW_TIME_UNKNOWN - VLP_TOO_SMALL + 1));
  EXPECT_EQ(vlp_describe_status(13), std::string(vlp_describe_status(-6)));
  EXPECT_THAT(vlp_version(), HasSubstr("."));
}

}  // namespace
}  // namespace vlp
