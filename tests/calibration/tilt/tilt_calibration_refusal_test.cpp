// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Captures that do not determine the tilt, and the reported reasons.
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "calibration/tilt/drive.h"
#include "calibration/tilt/tilt_calibration.h"
#include "geometry/angles.h"

namespace vlp {
namespace {

class EstimateTiltFromLampsFailure : public testing::Test {
 protected:
  Random random{31};
  SyntheticRig rig = make_tilted_rig(0.05, 1);
  TiltCalibrationOptions options;

  /// Expects the first words of a reason; "" if the captures determine the tilt.
  void expect(const std::string& reason, const std::vector<Frame>& frames,
              bool refine_map = false) {
    options.refine_map = refine_map;
    const std::string found =
        estimate_tilt_from_lamps(frames, rig.map, rig.calibration.camera, options).undetermined;
    EXPECT_EQ(found.empty(), reason.empty()) << found;
    EXPECT_THAT(found, testing::HasSubstr(reason));
  }
  std::vector<Frame> noisy_drive(int captures, double sigma_px, std::size_t lamps = 8) {
    auto frames = with_noise(drive(rig, captures, random, sigma_px), random);
    for (Frame& frame : frames) frame.detections.resize(lamps);
    return frames;
  }
  /// Returns captures on a circle whose radius is the RMS distance from its center, and with yaws
  /// of this standard deviation.
  std::vector<Frame> around(double radius_m, double yaw_sd_deg) {
    std::vector<Frame> frames;
    for (int i = 0; i < 12; ++i) {
      const Eigen::Vector2d position_m =
          Eigen::Rotation2Dd(i * M_PI / 3) * Eigen::Vector2d(radius_m, 0);
      rig.camera = {{position_m.x(), position_m.y(), 0},
                    (i % 2 == 0 ? -1 : 1) * rad_from_deg(yaw_sd_deg)};
      frames.push_back({std::to_string(i), seen_from(rig, 1e-3)});
    }
    return frames;
  }
};

TEST_F(EstimateTiltFromLampsFailure, FailsForCapturesOfFewerThanThreeLampsOfMap) {
  expect("there is none", {});
  expect("there is one", noisy_drive(1, 0.1));
  expect("there is none", noisy_drive(20, 0.1, 2));
  const auto frames = noisy_drive(20, 0.1);
  for (Lamp& lamp : rig.map.lamps) lamp.id += 100;
  expect("there is none", frames);
  rig.map = synthetic_lamps();
  for (Lamp& lamp : rig.map.lamps) lamp.position_m.y() = -lamp.position_m.y();
  expect("there is none", frames);
}

/// The limits are 10 degrees, and 0.16 m at lamps 1.6 m above the camera.
TEST_F(EstimateTiltFromLampsFailure, FailsUnlessPosesDifferByTenPercentOfHeightOrTenDegrees) {
  rig = make_tilted_rig(0, 0);
  expect("have one position and yaw", around(0.155, 9.8));
  expect("", around(0.165, 9.8));
  expect("", around(0.155, 10.2));
  expect("have one position and yaw", around(0.155, 9.8), true);
  expect("have one yaw", around(0.165, 9.8), true);
  expect("at one position", around(0.155, 10.2), true);
  expect("", around(0.165, 10.2), true);
  rig.map = make_lamp_map({{-0.8, 0, 1.6}, {0, 0, 1.6}, {0.8, 0, 1.6}, {0.3, 0, 1.6}});
  auto collinear = around(0.4, 0);
  for (Frame& frame : collinear) frame.detections.resize(4);
  expect("add captures", collinear);
}

/// Residuals: two per detection. Unknowns: four per capture, two of the zenith, and three per
/// detected lamp minus five that captures cannot determine.
TEST_F(EstimateTiltFromLampsFailure, FailsWithoutRedundancyWhenRefiningMap) {
  expect("too few lamps", noisy_drive(3, 1e-3, 3), true);
  expect("too few lamps", noisy_drive(2, 1e-3, 4), true);
  expect("", noisy_drive(3, 1e-3, 4), true);
  expect("", noisy_drive(2, 1e-3, 6), true);
}

/// Lamp 3 is in two captures, then in one.
TEST_F(EstimateTiltFromLampsFailure, FailsIfTiltOrLampSdExceedsLimitOfOptions) {
  auto frames = noisy_drive(12, 0.5);
  const auto limited = [&](double factor) {
    const TiltCalibration found = estimate_tilt_from_lamps(frames, rig.map, rig.calibration.camera);
    EXPECT_EQ(found.covariance.rows(), 2);
    options.max_sd_rad = factor * std::sqrt(found.covariance.diagonal().maxCoeff());
  };
  limited(1.001);
  expect("", frames);
  limited(0.999);
  expect(" degrees: add captures", frames);
  options = {};
  expect("", frames, true);
  for (std::size_t i = 2; i < frames.size(); ++i) {
    std::erase_if(frames[i].detections, [](const Detection& seen) { return seen.lamp == 3; });
  }
  options.max_lamp_sd_m = 1;
  options.refine_map = true;
  const auto corrections =
      estimate_tilt_from_lamps(frames, rig.map, rig.calibration.camera, options).corrections;
  ASSERT_EQ(corrections.size(), 8U);
  for (const double factor : {1.001, 0.999}) {
    options.max_lamp_sd_m = factor * corrections[2].sd_m.maxCoeff();
    expect(factor > 1 ? "" : "lamp 3 would have a standard deviation of", frames, true);
  }
  std::erase_if(frames[1].detections, [](const Detection& seen) { return seen.lamp == 3; });
  expect("lamp 3 is in one capture only", frames, true);
}

}  // namespace
}  // namespace vlp
