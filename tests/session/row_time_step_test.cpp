// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/row_time_step.h"

#include <gmock/gmock.h>

#include <cmath>

#include "lamps/signal/frequency_identification.h"
#include "support/datasets.h"
#include "support/random.h"

namespace vlp {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

constexpr double kTrueRowTime_s = 2e-5;

LampMap make_map() {
  LampMap map;
  for (const double frequency_hz : {1600., 2000., 2500., 3100., 3800.}) {
    Lamp lamp{};
    lamp.id = static_cast<int>(map.lamps.size()) + 1;
    lamp.position_m = {0.5 * lamp.id, 0.1 * lamp.id * lamp.id, 2};
    lamp.frequency_hz = frequency_hz;
    map.lamps.push_back(lamp);
  }
  return map;
}

/// Image of all lamps. `deviations`: relative, of the lamps' frequencies from the map.
Observation observe(const LampMap& map, const std::vector<double>& deviations, bool is_identified) {
  Observation image{"0000.png"};
  image.size_px = {800, 600};
  image.lights.reserve(map.lamps.size());
  for (std::size_t i = 0; i < map.lamps.size(); ++i) {
    const Lamp& lamp = map.lamps[i];
    Light light{};
    light.kind = is_identified ? LightKind::lamp : LightKind::unknown;
    if (is_identified) light.lamp = lamp.id;
    const double frequency_hz = *lamp.frequency_hz * (1 + deviations[i]);
    light.stripes.period_lines = 1 / (frequency_hz * kTrueRowTime_s);
    light.stripes.periodicity_r2 = 0.95;
    light.stripes.periods = 5;
    light.stripes.is_regular = true;
    light.pixel = {100 + 120.0 * static_cast<double>(i), 300};
    light.sigma_px = 0.1;
    light.box_min = light.pixel - Eigen::Vector2d(40, 40);
    light.box_max = light.pixel + Eigen::Vector2d(40, 40);
    image.lights.push_back(light);
  }
  return image;
}

TEST(CheckRowTimeAgainstLamps, ReportsMeasuredRowTimeWhenGivenIs5PercentOff) {
  const LampMap map = make_map();
  const std::vector<Observation> images(4, observe(map, {0, 0, 0, 0, 0}, true));
  const RowTimeCheck check =
      check_row_time_against_lamps(images, map, {1.9e-5, "camera_type.yaml"});
  ASSERT_TRUE(check.measured);
  EXPECT_EQ(check.measured->lamps, 5);
  EXPECT_NEAR(check.measured->row_time_s, kTrueRowTime_s, 1e-9);
  EXPECT_THAT(check.error, StartsWith("row time is 19 us in camera_type.yaml, but the stripes of 5 "
                                      "lamps measure 20.00 +- 0.01 us; correct it"));
  const auto metrics = make_row_time_metrics(check);
  ASSERT_TRUE(find_metric_value(metrics, "row_time_us"));
  EXPECT_NEAR(*find_metric_value(metrics, "row_time_us"), 20, 1e-3);
  ASSERT_TRUE(find_metric_value(metrics, "row_time_sd_us"));
  EXPECT_NEAR(*find_metric_value(metrics, "row_time_sd_us"), 0.01, 0.005);
}

TEST(CheckRowTimeAgainstLamps, ReportsNoErrorForFrequenciesWithinLampDrift) {
  const LampMap map = make_map();
  Random random(1);
  constexpr int trials = 500;
  int measured = 0;
  for (int trial = 0; trial < trials; ++trial) {
    std::vector<double> deviations(map.lamps.size());
    // Independent deviations, and, in each second trial, one of all lamps.
    for (double& deviation : deviations) deviation = kLampDrift * random.uniform(-1, 1);
    if (trial % 2 == 0) deviations.assign(map.lamps.size(), kLampDrift * (trial % 4 == 0 ? 1 : -1));
    const std::vector<Observation> images(4, observe(map, deviations, true));
    const RowTimeCheck check =
        check_row_time_against_lamps(images, map, {kTrueRowTime_s, "camera_type.yaml"});
    measured += check.measured ? 1 : 0;
    EXPECT_EQ(check.error, "") << trial;
  }
  EXPECT_EQ(measured, trials);
}

TEST(CheckRowTimeAgainstLamps, MeasuresNoRowTimeFromTwoLamps) {
  LampMap map = make_map();
  map.lamps.resize(2);
  const std::vector<Observation> images(4, observe(map, {0, 0}, true));
  const RowTimeCheck check =
      check_row_time_against_lamps(images, map, {1.9e-5, "camera_type.yaml"});
  EXPECT_FALSE(check.measured);
  EXPECT_EQ(check.error, "");
}

TEST(DescribeAlternativeRowTime, NamesWrongRowTimeWithWhichNoLampIsIdentified) {
  const LampMap map = make_map();
  const std::vector<Observation> images(4, observe(map, {0, 0, 0, 0, 0}, false));
  EXPECT_THAT(describe_alternative_row_time(images, map, std::nullopt, {2.2e-5, "camera.yaml"}),
              HasSubstr("row time is 22 us in camera.yaml, but the stripes of 5 lamps measure"));
  EXPECT_EQ(describe_alternative_row_time(images, map, std::nullopt, {2e-5, "camera.yaml"}), "");
  EXPECT_EQ(describe_alternative_row_time({}, map, std::nullopt, {2.2e-5, "camera.yaml"}), "");
}

TEST(DetectLightsInFolders, UsesCameraOfCalibrationWithOrWithoutItsRowTime) {
  const LampMap lamps = read_lamp_map(kRig + "/lamps.yaml");
  const Calibration calibration = read_calibration(kRig + "/true_calibration.yaml");
  ASSERT_TRUE(calibration.camera.row_time_s);
  for (const bool with_row_time : {true, false}) {
    const DetectedLights seen =
        detect_lights_in_folders({kRig + "/sample"}, lamps, calibration, with_row_time, {});
    EXPECT_TRUE(seen.camera.lens);
    EXPECT_EQ(seen.camera.readout, calibration.camera.readout);
    EXPECT_EQ(seen.camera.row_time_s, with_row_time ? calibration.camera.row_time_s : std::nullopt);
    ASSERT_EQ(seen.observations.images.size(), 2U);
    EXPECT_EQ(seen.observations.images[0].size_px, calibration.camera.imager_px);
  }
}

TEST(EstimateRowTimeFromLights, StoresRowTimeAndReadoutInCalibration) {
  const LampMap map = make_map();
  DetectedLights seen;
  seen.observations.images.assign(4, observe(map, {0, 0, 0, 0, 0}, false));
  seen.folder_sizes = {4};
  seen.camera.readout = Readout::columns;
  Calibration calibration = read_calibration(kRig + "/true_calibration.yaml");
  calibration.camera.row_time_s = 2.2e-5;
  const auto estimate = [&](const std::optional<Calibration>& given) {
    return estimate_row_time_from_lights(seen, {{}}, map, "lamps.yaml", given, {});
  };
  const RowTimeStepResult stored = estimate(calibration);
  ASSERT_TRUE(stored.has_succeeded()) << stored.message;
  EXPECT_NEAR(stored.row_time.row_time_s, kTrueRowTime_s, 1e-8);
  EXPECT_EQ(stored.calibration.camera.row_time_s, stored.row_time.row_time_s);
  EXPECT_EQ(stored.calibration.camera.readout, Readout::columns);
  ASSERT_FALSE(stored.calibration.history.empty());
  EXPECT_EQ(stored.calibration.history.back().part, "camera");
  EXPECT_THAT(stored.warnings, testing::ElementsAre(HasSubstr("22 us in the calibration")));
  const RowTimeStepResult alone = estimate(std::nullopt);
  ASSERT_TRUE(alone.has_succeeded()) << alone.message;
  EXPECT_EQ(alone.row_time.row_time_s, stored.row_time.row_time_s);
  EXPECT_FALSE(alone.calibration.camera.row_time_s);
}

}  // namespace
}  // namespace vlp
