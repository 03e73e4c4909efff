// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "station/unit/unit_metrics.h"
#include "support/datasets.h"

namespace vlp {
namespace {

using testing::HasSubstr;

/// The example: 36 captures at known points.
struct UnitMetrics : testing::Test {
  UnitMetrics() {
    config.lamps = read_lamp_map(kExample + "lamps.yaml");
    config.completion.check_captures = 36;
  }
  StationConfig config{};
  Calibration calibration = read_calibration(kExample + "calibration.yaml");
  std::vector<Frame> frames = read_detections(kExample + "detections.csv");
  CapturesTable places = read_captures_csv(kExample + "truth.csv");
};

TEST_F(UnitMetrics, RunCheckStepReturnsFixFractionOneForExactCaptures) {
  const StepResult result = run_check_step(config, calibration, frames, places);
  EXPECT_TRUE(result.has_succeeded()) << result.message;
  EXPECT_EQ(result.metrics[0].name, "check_fix_fraction");
  EXPECT_EQ(result.metrics[0].value, 1);
}

TEST_F(UnitMetrics, RunCheckStepFailsForTooFewKnownPositions) {
  places.erase(places.begin());
  EXPECT_THAT(run_check_step(config, calibration, frames, places).message,
              HasSubstr("1 of the 36 captures"));
  config.completion.check_captures = 35;
  EXPECT_TRUE(run_check_step(config, calibration, frames, places).has_succeeded());
  EXPECT_THAT(run_check_step(config, calibration, {}, places).message,
              HasSubstr("have no position"));
}

/// Lamps below their heights in the map: horizontal positions are right, heights are wrong.
TEST_F(UnitMetrics, RunCheckStepReturnsHeightErrorOfDisplacedLamps) {
  const auto height_mm = [&] {
    const StepResult result = run_check_step(config, calibration, frames, places);
    for (const auto& [name, value, interval_low] : result.metrics) {
      if (name == "check_height_mm") return value;
    }
    return -1.0;
  };
  const double as_mapped_mm = height_mm();
  EXPECT_GE(as_mapped_mm, 0);
  EXPECT_LT(as_mapped_mm, 1);
  for (Lamp& lamp : config.lamps.lamps) lamp.position_m.z() += 0.1;
  EXPECT_NEAR(height_mm(), 100, 1);
}

}  // namespace
}  // namespace vlp
