// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Frames without a fix, and the status of each.
#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

#include "positioning/positioner.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

class PositionerStatus : public testing::Test {
 protected:
  SyntheticRig rig{
      synthetic_lamps(), {synthetic_camera(), {}, {}, {}, {}}, {{0.1, -0.05, 0}, 0.4}, {}};

  FixStatus status(const std::vector<Detection>& detections, const Sensors& sensors = {}) {
    return Positioner(rig.map, rig.calibration).compute_position_fix(detections, sensors).status;
  }
  std::vector<Detection> seen(std::size_t lamps) {
    auto detections = seen_from(rig, 0.2);
    detections.resize(lamps);
    return detections;
  }
};

TEST_F(PositionerStatus, ReturnsTooFewLampsForFewerThanTwo) {
  EXPECT_EQ(status({}), FixStatus::too_few_lamps);
  EXPECT_EQ(status(seen(1)), FixStatus::too_few_lamps);
  EXPECT_EQ(status(seen(2)), FixStatus::ok);
}

TEST_F(PositionerStatus, ReturnsOkAndCountsLampsNotInMap) {
  auto detections = seen(4);
  detections[1].lamp = 77;
  const Fix fix = Positioner(rig.map, rig.calibration).compute_position_fix(detections);
  EXPECT_TRUE(fix.has_succeeded());
  EXPECT_EQ(fix.lamps, 3);
  EXPECT_EQ(fix.unknown_lamps, 1);
}

TEST_F(PositionerStatus, ReturnsDuplicateLampForRepeatedId) {
  auto detections = seen(3);
  detections[2].lamp = detections[0].lamp;
  EXPECT_EQ(status(detections), FixStatus::duplicate_lamp);
}

TEST_F(PositionerStatus, ReturnsTooManyLampsForMoreThan256) {
  std::vector<Eigen::Vector3d> positions_m;
  for (int i = 0; i < 257; ++i) positions_m.emplace_back(0.01 * (i % 16), 0.01 * (i / 16), 2);
  rig.map = make_lamp_map(positions_m);
  auto detections = seen_from(rig);
  ASSERT_EQ(detections.size(), 257);
  EXPECT_EQ(status(detections), FixStatus::too_many_lamps);
  detections.pop_back();
  EXPECT_EQ(status(detections), FixStatus::ok);
}

TEST_F(PositionerStatus, ReturnsNotFiniteForNonFiniteInputOrSigmaOutOfRange) {
  for (const double bad : {kNan, std::numeric_limits<double>::infinity()}) {
    for (const int which : {0, 1, 2}) {
      auto detections = seen(3);
      (which == 0   ? detections[1].pixel.x()
       : which == 1 ? detections[1].pixel.y()
                    : *detections[1].sigma_px) = bad;
      EXPECT_EQ(status(detections), FixStatus::not_finite);
    }
    const Fix fix = Positioner(rig.map, rig.calibration)
                        .compute_position_fix(seen(3), {Inclination{bad, 0}, 0, {}});
    EXPECT_EQ(fix.status, FixStatus::not_finite);
    EXPECT_EQ(fix.unknown_lamps, 0);
    EXPECT_EQ(status(seen(3), {Inclination{0, 0}, bad, {}}), FixStatus::not_finite);
    EXPECT_EQ(status(seen(1), {{}, 0, HeightAndYaw{bad, 0}}), FixStatus::not_finite);
    EXPECT_EQ(status(seen(1), {{}, 0, HeightAndYaw{0, bad}}), FixStatus::not_finite);
  }
  for (const double bad : {0.0, -1.0, 1e-160, 1e160}) {
    auto detections = seen(3);
    detections[0].sigma_px = bad;
    EXPECT_EQ(status(detections), FixStatus::not_finite);
  }
}

TEST_F(PositionerStatus, ThrowsOnOptionsOutOfRange) {
  const auto make = [&](const auto& set_option) {
    PositionerOptions options;
    set_option(options);
    return Positioner(rig.map, rig.calibration, options);
  };
  for (const double in_range : {1e-4, 1e3}) {
    EXPECT_NO_THROW(make([&](PositionerOptions& options) { options.unstated_sigma_px = in_range; }))
        << in_range;
  }
  for (const double bad : {0.0, 0.9e-4, 1.1e3, kNan}) {
    EXPECT_THROW(make([&](PositionerOptions& options) { options.unstated_sigma_px = bad; }),
                 std::invalid_argument)
        << bad;
  }
  for (const double bad : {0.0, -0.1, kNan}) {
    EXPECT_THROW(make([&](PositionerOptions& options) { options.max_residual_fraction = bad; }),
                 std::invalid_argument)
        << bad;
  }
}

TEST_F(PositionerStatus, ReturnsOutsideLensForUnreachablePixel) {
  rig.calibration.camera.lens_model = LensModel::opencv4;
  rig.calibration.camera.intrinsics = {520, 520, 400, 300, -0.4, 0, 0, 0};
  auto detections = seen(3);
  detections[1].pixel = {2000, 300};
  EXPECT_EQ(status(detections), FixStatus::outside_lens);
}

TEST_F(PositionerStatus, ReturnsLampBelowCameraForHeightAboveLampsOrUpsideDownCamera) {
  EXPECT_EQ(status(seen(1), {{}, 0, HeightAndYaw{1.6, 0}}), FixStatus::lamp_below_camera);
  EXPECT_EQ(status(seen(1), {{}, 0, HeightAndYaw{2.0, 0}}), FixStatus::lamp_below_camera);
  // An inclination that points the lamps' rays below the horizon.
  EXPECT_EQ(status(seen(3), {Inclination{3.1, 0}, 0, {}}), FixStatus::lamp_below_camera);
}

TEST_F(PositionerStatus, ReturnsDegenerateWhenAllPixelsCoincide) {
  for (const std::size_t count : {2u, 3u, 4u}) {
    auto detections = seen(count);
    for (Detection& detection : detections) detection.pixel = detections[0].pixel;
    EXPECT_EQ(status(detections), FixStatus::degenerate) << count;
  }
}

TEST_F(PositionerStatus, ReturnsAmbiguousWhenTwoLampsFitTwoPoses) {
  rig.map = make_lamp_map({{1.0, 0, 1.6}, {1.2, 0.1, 2.4}});
  rig.camera = {{0, 0, 0}, 0};
  EXPECT_EQ(status(seen(2)), FixStatus::ambiguous);
}

TEST_F(PositionerStatus, ConstructorThrowsForInvalidMapCalibrationOrOptions) {
  const auto build = [&](const LampMap& map, const Calibration& calibration,
                         const PositionerOptions& options = {}) {
    return Positioner(map, calibration, options);
  };
  EXPECT_THROW(build({}, rig.calibration), std::invalid_argument);
  LampMap twice = rig.map;
  twice.lamps[1].id = twice.lamps[0].id;
  EXPECT_THROW(build(twice, rig.calibration), std::invalid_argument);
  LampMap coincident = rig.map;
  coincident.lamps[1].position_m = coincident.lamps[0].position_m;
  EXPECT_THROW(build(coincident, rig.calibration), std::invalid_argument);
  LampMap nowhere = rig.map;
  nowhere.lamps[1].position_m.x() = kNan;
  EXPECT_THROW(build(nowhere, rig.calibration), std::invalid_argument);
  Calibration down = rig.calibration;
  down.rotation_center = {RotationModel::tilt, {400, 300}, {0, 0, -1}, {}};
  EXPECT_THROW(build(rig.map, down), std::invalid_argument);
  Calibration undefined = rig.calibration;
  undefined.dispersion = {{kNan, 0}, 0, {0, 0}, 1};
  EXPECT_THROW(build(rig.map, undefined), std::invalid_argument);
  Calibration cut = rig.calibration;
  cut.camera.intrinsics.pop_back();
  EXPECT_THROW(build(rig.map, cut), std::invalid_argument);
  PositionerOptions options;
  for (const CameraMount& mount : {CameraMount{{kNan, 0, 0}, 0}, {{0, 0, 0}, kNan}}) {
    options.mount = mount;
    EXPECT_THROW(build(rig.map, rig.calibration, options), std::invalid_argument);
  }
  options.mount.reset();
  options.correction = Correction::rotation;
  EXPECT_THROW(build(rig.map, rig.calibration, options), std::invalid_argument);
}

TEST(FixStatus, HasNameAndExplanationForEachValue) {
  for (int i = 0; i <= static_cast<int>(FixStatus::row_time_unknown); ++i) {
    const auto status = static_cast<FixStatus>(i);
    EXPECT_FALSE(fix_status_name(status).empty());
    EXPECT_FALSE(describe_fix_status(status).empty());
  }
  EXPECT_EQ(fix_status_name(FixStatus::ok), "ok");
  EXPECT_EQ(fix_status_name(FixStatus::mirrored_map), "mirrored_map");
  EXPECT_EQ(fix_status_name(FixStatus::row_time_unknown), "row_time_unknown");
}

}  // namespace
}  // namespace vlp
