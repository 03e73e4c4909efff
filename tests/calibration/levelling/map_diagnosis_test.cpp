// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/levelling/map_diagnosis.h"

#include <gmock/gmock.h>

#include <utility>

#include "calibration/levelling/drive.h"

namespace vlp {
namespace {

using testing::HasSubstr;

/// A camera that leans by 3 degrees, which its calibration does not know.
class MapDoubt : public testing::Test {
 protected:
  Random random{41};
  SyntheticRig rig = leaning_rig(0.05, 1);
  std::vector<Frame> frames = drive(rig, 20, random, 0.1);
  LampMap map = rig.map;

  Calibration camera_alone() const {
    Calibration camera;
    camera.camera = rig.calibration.camera;
    return camera;
  }
  std::string doubt() const { return diagnose_map(frames, map, camera_alone()); }
  bool contradicted() const { return contradicts_map(frames, map, camera_alone()); }
};

TEST_F(MapDoubt, IsNoneOfARightMap) {
  EXPECT_EQ(doubt(), "");
  EXPECT_FALSE(contradicted());
  for (Lamp& lamp : map.lamps) lamp.position_m.x() += random.uniform(-0.005, 0.005);
  EXPECT_EQ(doubt(), "") << "5 mm are for --refine-map";
}

TEST_F(MapDoubt, IsOfAMirroredMap) {
  for (Lamp& lamp : map.lamps) lamp.position_m.y() *= -1;
  EXPECT_THAT(doubt(), HasSubstr("looks mirrored"));
}

TEST_F(MapDoubt, IsOfTwoLampsThatAreSwapped) {
  for (const auto& [first, second] : {std::pair(2, 4), std::pair(0, 7)}) {
    map = rig.map;
    auto& lamps = map.lamps;
    std::swap(lamps[static_cast<std::size_t>(first)].position_m,
              lamps[static_cast<std::size_t>(second)].position_m);
    EXPECT_THAT(doubt(), HasSubstr("lamps " + std::to_string(first + 1) + " and " +
                                   std::to_string(second + 1) + " look swapped"));
  }
}

TEST_F(MapDoubt, IsOfTwoAmongFourWithoutAMajority) {
  map.lamps.resize(4);
  map.lamps[1].position_m.x() = 0.5;  // a rectangle's mirror image is an exchange of its corners
  rig.map = map;
  frames = drive(rig, 20, random, 0.1);
  std::swap(map.lamps[0].position_m, map.lamps[2].position_m);
  EXPECT_THAT(doubt(), HasSubstr("lamps 1 and 3 look swapped"));
}

TEST_F(MapDoubt, SaysNothingInParticularOfAnotherRoom) {
  for (Lamp& lamp : map.lamps) {
    lamp.position_m.head<2>() = Eigen::Vector2d(random.uniform(-1, 1), random.uniform(-1, 1));
  }
  EXPECT_EQ(doubt(), "");
  EXPECT_TRUE(contradicted());
  for (Lamp& lamp : map.lamps) lamp.id += 100;
  EXPECT_EQ(doubt(), "");
  EXPECT_FALSE(contradicted()) << "nothing is known of it";
  frames.clear();
  EXPECT_EQ(doubt(), "");
}

}  // namespace
}  // namespace vlp
