// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/lens_fault.h"

#include <fmt/core.h>
#include <gmock/gmock.h>

#include <cmath>

#include "support/example_rig.h"

namespace vlp {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

struct LensFaultTest : ExampleRig {};

TEST_F(LensFaultTest, IsNoneOfTheLensThatTheLampsWereSeenThrough) {
  EXPECT_EQ(lens_fault(frames, map, calibration), "");
  // What is a little off is not another lens.
  calibration.camera.intrinsics[0] *= 1.0005;
  calibration.camera.intrinsics[2] += 0.3;
  EXPECT_EQ(lens_fault(frames, map, calibration), "");
}

/// As when the boards are of another unit.
TEST_F(LensFaultTest, NamesTheLensThatTheLampsShow) {
  auto& lens = calibration.camera.intrinsics;
  const double shown_px = std::sqrt(lens[0] * lens[1]);
  for (const double focal : {0.98, 1.02}) {
    for (const double off_px : {0., 10.}) {
      const auto kept = lens;
      lens[0] *= focal;
      lens[1] *= focal;
      lens[2] += off_px;
      lens[3] -= off_px;
      const std::string fault = lens_fault(frames, map, calibration);
      EXPECT_THAT(fault,
                  AllOf(StartsWith("the lamps are seen through another lens than the boards"),
                        HasSubstr(fmt::format("the boards a focal length of {:.1f} px",
                                              std::sqrt(lens[0] * lens[1])))))
          << focal << " " << off_px;
      const std::string before = "they show a focal length of ";
      const auto at = fault.find(before);
      ASSERT_NE(at, std::string::npos);
      EXPECT_NEAR(std::stod(fault.substr(at + before.size())), shown_px, 0.002 * shown_px);
      lens = kept;
    }
  }
}

/// That is the map's fault.
TEST_F(LensFaultTest, IsNoneOfALampThatHangsElsewhere) {
  for (Lamp& lamp : map.lamps) {
    const Eigen::Vector3d kept_m = lamp.position_m;
    lamp.position_m += Eigen::Vector3d(0.02, -0.01, 0);
    EXPECT_EQ(lens_fault(frames, map, calibration), "") << lamp.id;
    lamp.position_m = kept_m;
  }
}

TEST_F(LensFaultTest, IsNoneOfCapturesThatTellNothing) {
  calibration.camera.intrinsics[0] *= 1.02;
  EXPECT_EQ(lens_fault({}, map, calibration), "");
  EXPECT_EQ(lens_fault(std::span(frames).first(1), map, calibration), "");
}

}  // namespace
}  // namespace vlp
