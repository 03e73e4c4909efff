// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "station/known_places.h"
#include "station/unit_stages.h"
#include "support/refused.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;
using testing::SizeIs;

const std::string kExample = VLP_SOURCE_DIR "/datasets/example/";

/// The example: 36 captures at known points.
struct LampStages : testing::Test {
  LampStages() {
    config.lamps = read_lamp_map(kExample + "lamps.yaml");
    config.enough.check_captures = 36;
    config.enough.dispersion_captures = 36;
  }
  StationConfig config;
  Calibration calibration = read_calibration(kExample + "calibration.yaml");
  std::vector<Frame> frames = read_detections(kExample + "detections.csv");
  CapturesTable places = read_captures(kExample + "truth.csv");
};

TEST_F(LampStages, CheckTheFixesAtKnownPoints) {
  const StageResult result = check_fixes(config, calibration, frames, places);
  EXPECT_EQ(result.problem, "");
  EXPECT_EQ(result.values[0].name, "check_fixes");
  EXPECT_EQ(result.values[0].value, 1);
}

TEST_F(LampStages, WantAsManyPlacesAsTheStationWantsCaptures) {
  places.erase(places.begin());
  EXPECT_THAT(check_fixes(config, calibration, frames, places).problem,
              HasSubstr("1 of the 36 captures"));
  EXPECT_THAT(solve_dispersion(config, calibration, frames, places).problem,
              HasSubstr("1 of the 36 captures"));
  config.enough.check_captures = 35;
  EXPECT_EQ(check_fixes(config, calibration, frames, places).problem, "");
  EXPECT_THAT(check_fixes(config, calibration, {}, places).problem, HasSubstr("nothing tells"));
}

TEST(PlacesIn, AreThoseOfCapturesOrElseOfTheTruth) {
  const TemporaryFolder folder;
  EXPECT_THAT(places_in(folder / ""), SizeIs(0));
  folder.file("truth.csv", "image,x_m,y_m,z_m,yaw_rad\na.png,1,2,0,0\n");
  EXPECT_THAT(places_in(folder / ""), SizeIs(1));
  folder.file("captures.csv", "image,time_s\na.png,1\n");
  EXPECT_THAT(places_in(folder / ""), SizeIs(1)) << "captures.csv tells no place";
  folder.file("captures.csv", "image,x_m,y_m\na.png,1,2\nb.png,1,2\n");
  EXPECT_THAT(places_in(folder / ""), SizeIs(2));
  folder.file("captures.csv", "image,x_m,y_m\na.png,1,2\nb.png,1");
  EXPECT_THAT(refusal_of([&] { places_in(folder / ""); }), HasSubstr("captures.csv:3"));
}

}  // namespace
}  // namespace vlp
