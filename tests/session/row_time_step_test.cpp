// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/row_time_step.h"

#include <gmock/gmock.h>

#include <cmath>

#include "lamps/signal/frequency_identification.h"
#include "support/datasets.h"

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
    light.box = {light.pixel - Eigen::Vector2d(40, 40), light.pixel + Eigen::Vector2d(40, 40)};
    image.lights.push_back(light);
  }
  return image;
}

TEST(CheckRowTime, ReportsMeasuredRowTimeWhenGivenIs5PercentOff) {
  const LampMap map = make_map();
  const std::vector<Observation> images(4, observe(map, {0, 0, 0, 0, 0}, true));
  const RowTimeCheck check = check_row_time(images, map, {1.9e-5, "camera_type.yaml"});
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
  ASSERT_TRUE(find_metric_value(metrics, "row_time_error_percent"));
  EXPECT_NEAR(*find_metric_value(metrics, "row_time_error_percent"), 5, 0.2);
}

TEST(CheckRowTime, MeasuresNoRowTimeFromTwoLamps) {
  LampMap map = make_map();
  map.lamps.resize(2);
  const std::vector<Observation> images(4, observe(map, {0, 0}, true));
  const RowTimeCheck check = check_row_time(images, map, {1.9e-5, "camera_type.yaml"});
  EXPECT_FALSE(check.measured);
  EXPECT_EQ(check.error, "");
}

TEST(DescribeOtherRowTime, NamesWrongRowTimeWithWhichNoLampIsIdentified) {
  const LampMap map = make_map();
  const std::vector<Observation> images(4, observe(map, {0, 0, 0, 0, 0}, false));
  EXPECT_THAT(search_row_time(images, map, std::nullopt, {2.2e-5, "camera.yaml"}).error,
              HasSubstr("row time is 22 us in camera.yaml, but the stripes of 5 lamps measure"));
  EXPECT_EQ(search_row_time(images, map, std::nullopt, {2e-5, "camera.yaml"}).error, "");
  EXPECT_EQ(search_row_time({}, map, std::nullopt, {2.2e-5, "camera.yaml"}).error, "");
}

/// Periods of lamps 2 to 6 of a map whose frequencies have the ratio 1.2 fit two row times. The
/// lights are at the positions of the lamps for one of them. There are two folders.
TEST(EstimateRowTime, DecidesAmbiguousPeriodsByPositions) {
  LampMap map;
  for (int id = 1; id <= 6; ++id) {
    Lamp lamp{};
    lamp.id = id;
    lamp.position_m = {
        std::array{-0.6, 0.6, 0., -0.6, 0.6, 0.}[static_cast<std::size_t>(id - 1)],
        std::array{-0.3, 0.3, -0.32, 0.3, -0.3, 0.28}[static_cast<std::size_t>(id - 1)], 1.6};
    lamp.frequency_hz = 2400 * std::pow(1.2, id - 1);
    map.lamps.push_back(lamp);
  }
  const Lens lens(LensModel::pinhole, std::array{500., 500., 399.5, 299.5});
  const auto select = [&](bool is_repeated) {
    LampMap seen = map;
    seen.lamps.erase(seen.lamps.begin());
    Observation image = observe(seen, {0, 0, 0, 0, 0}, false);
    for (std::size_t i = 0; i < image.lights.size(); ++i) {
      const Eigen::Vector3d& lamp_m = seen.lamps[i].position_m;
      image.lights[i].pixel =
          Eigen::Vector2d(399.5, 299.5) + 500 / 1.6 * Eigen::Vector2d(lamp_m.x(), lamp_m.y());
    }
    // At most one of two lights with the same period is the lamp.
    const std::vector<Light> lights = image.lights;
    if (is_repeated) image.lights.insert(image.lights.end(), lights.begin(), lights.end());
    const std::vector<Observation> images(5, image);
    const std::span all(images);
    return estimate_row_time(std::array{all.first(2), all.last(3)}, {{}, {}}, map, lens);
  };
  const RowTimeResult decided = select(false);
  ASSERT_TRUE(decided.row_time) << decided.problem;
  EXPECT_NEAR(decided.row_time->row_time_s, kTrueRowTime_s, 1e-8);
  const RowTimeResult undecided = select(true);
  EXPECT_FALSE(undecided.row_time);
  EXPECT_THAT(undecided.problem, HasSubstr("neither duties nor positions of the lamps decide"));
}

TEST(AddRowTimeRemark, WarnsOrReplacesReasonOfFailure) {
  const LampMap map = make_map();
  const std::vector<Observation> images(4, observe(map, {0, 0, 0, 0, 0}, true));
  DetectorCamera camera;
  const auto add_to = [&](StepResult result) {
    add_row_time_remark(images, map, camera, "camera.yaml", result);
    return result;
  };
  StepResult failed;
  failed.set_step_failure(StepFailure::undetermined, "no fix");
  EXPECT_EQ(add_to(failed).message, "no fix") << "the row time is unknown";
  camera.row_time_s = kTrueRowTime_s;
  EXPECT_EQ(add_to(failed).message, "no fix");
  EXPECT_THAT(add_to({}).warnings, testing::IsEmpty());
  camera.row_time_s = 2.2e-5;
  EXPECT_THAT(add_to({}).warnings, testing::ElementsAre(StartsWith("row time is 22 us in camera")));
  EXPECT_TRUE(add_to({}).has_succeeded());
  EXPECT_EQ(add_to(failed).failure, StepFailure::bad_input);
  EXPECT_THAT(add_to(failed).message, StartsWith("row time is 22 us in camera.yaml"));
}

TEST(DescribeWrongRowTime, AllowsLampDriftPlusThreeStandardDeviations) {
  const auto describe = [](double measured_s, double sd_s, int lamps) {
    return describe_wrong_row_time({measured_s, sd_s, lamps, lamps}, {2e-5, "camera.yaml"});
  };
  const double limit_s = 2e-5 * std::exp(kLampDrift);
  EXPECT_EQ(describe(0.999 * limit_s, 0, 3), "");
  EXPECT_NE(describe(1.001 * limit_s, 0, 3), "");
  EXPECT_EQ(describe(1.001 * limit_s, 0, 2), "") << "two lamps may be wrong in the map";
  EXPECT_NE(describe(2e-5 * std::exp(-1.1 * kLampDrift), 0, 3), "");
  // The standard deviation of 1 % allows for a difference of 3 % beyond the drift.
  EXPECT_EQ(
      describe(2e-5 * std::exp(kLampDrift + 0.029), 0.01 * 2e-5 * std::exp(kLampDrift + 0.029), 3),
      "");
  EXPECT_NE(
      describe(2e-5 * std::exp(kLampDrift + 0.031), 0.01 * 2e-5 * std::exp(kLampDrift + 0.031), 3),
      "");
}

TEST(RunRowTimeStep, ReplacesHistoryOfEarlierSearch) {
  const LampMap map = make_map();
  DetectedLights seen;
  seen.observations.images.assign(4, observe(map, {0, 0, 0, 0, 0}, false));
  seen.folder_sizes = {4};
  Calibration calibration = read_calibration(kRig + "/true_calibration.yaml");
  calibration.history = {{"camera", "vlp-intrinsics", "1", "", {}},
                         {"camera", "test", "1", "--row-time", {}},
                         {"camera", "test", "1", "--lens auto", {}},
                         {"rotation_center", "test", "1", "--row-time", {}}};
  const RowTimeStepResult result = run_row_time_step(seen, {{}}, map, "lamps.yaml", calibration,
                                                     {"", "test", "2", "--row-time", {}});
  ASSERT_TRUE(result.has_succeeded()) << result.message;
  std::vector<std::string> kept;
  for (const HistoryEntry& entry : result.calibration.history) {
    kept.push_back(entry.part + " " + entry.program + " " + entry.version + " " + entry.options);
  }
  EXPECT_THAT(
      kept, testing::ElementsAre("camera vlp-intrinsics 1 ", "camera test 1 --lens auto",
                                 "rotation_center test 1 --row-time", "camera test 2 --row-time"));
}

TEST(RunRowTimeStep, IsUndeterminedWithoutLights) {
  DetectedLights seen;
  seen.observations.images.resize(2);
  seen.folder_sizes = {1, 1};
  const RowTimeStepResult result =
      run_row_time_step(seen, {{}, {}}, make_map(), "lamps.yaml", std::nullopt, {});
  EXPECT_EQ(result.failure, StepFailure::undetermined);
  EXPECT_FALSE(result.message.empty());
  EXPECT_TRUE(result.metrics.empty());
}

TEST(RunRowTimeStep, StoresRowTimeAndReadoutInCalibration) {
  const LampMap map = make_map();
  DetectedLights seen;
  seen.observations.images.assign(4, observe(map, {0, 0, 0, 0, 0}, false));
  seen.folder_sizes = {4};
  seen.camera.readout = Readout::columns;
  Calibration calibration = read_calibration(kRig + "/true_calibration.yaml");
  calibration.camera.row_time_s = 2.2e-5;
  const auto estimate = [&](const std::optional<Calibration>& given) {
    return run_row_time_step(seen, {{}}, map, "lamps.yaml", given, {});
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
