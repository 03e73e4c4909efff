// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/lamp_faults.h"

#include <gmock/gmock.h>

#include "captures/detections_table.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"
#include "support/datasets.h"

namespace vlp {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// The example: five lamps seen from 36 places with 0.05 px of noise.
struct LampFaults : testing::Test {
  LampMap map = read_lamp_map(kExample + "lamps.yaml");
  Calibration calibration = read_calibration(kExample + "calibration.yaml");
  std::vector<Frame> frames = read_detections(kExample + "detections.csv");
};

TEST_F(LampFaults, AreNoneWhereTheMapFits) {
  EXPECT_THAT(lamp_faults(frames, map, calibration), IsEmpty());
}

TEST_F(LampFaults, NameTwoThatAreSwapped) {
  for (std::size_t a = 0; a < map.lamps.size(); ++a) {
    for (std::size_t b = a + 1; b < map.lamps.size(); ++b) {
      LampMap swapped = map;
      std::swap(swapped.lamps[a].position_m, swapped.lamps[b].position_m);
      const auto faults = lamp_faults(frames, swapped, calibration);
      ASSERT_EQ(faults.size(), 1u) << a << " " << b;
      EXPECT_THAT(faults[0], HasSubstr(std::to_string(map.lamps[a].id) + " and " +
                                       std::to_string(map.lamps[b].id) + " look swapped"));
    }
  }
}

TEST_F(LampFaults, NameOneThatHangsElsewhere) {
  for (std::size_t i = 0; i < map.lamps.size(); ++i) {
    LampMap moved = map;
    moved.lamps[i].position_m += Eigen::Vector3d(0.02, -0.01, 0);
    EXPECT_THAT(lamp_faults(frames, moved, calibration),
                ElementsAre(HasSubstr("lamp " + std::to_string(map.lamps[i].id) + " is loose")));
  }
}

TEST_F(LampFaults, NameOneThatIsNeverSeen) {
  const int id = map.lamps[2].id;
  for (Frame& frame : frames) {
    std::erase_if(frame.detections, [&](const Detection& lamp) { return lamp.lamp == id; });
  }
  EXPECT_THAT(lamp_faults(frames, map, calibration),
              ElementsAre(HasSubstr("lamp " + std::to_string(id) + " is never seen")));
}

}  // namespace
}  // namespace vlp
