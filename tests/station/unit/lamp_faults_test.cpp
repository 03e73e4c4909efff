// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/lamp_faults.h"

#include <gmock/gmock.h>

#include <span>

#include "positioning/positioner.h"
#include "support/example_rig.h"

namespace vlp {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

struct LampFaults : ExampleRig {};

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
  EXPECT_THAT(unseen_lamps(frames, map),
              ElementsAre(HasSubstr("lamp " + std::to_string(id) + " is never seen")));
  EXPECT_THAT(lamp_faults(frames, map, calibration), IsEmpty()) << "it does not contradict the map";
  EXPECT_THAT(unseen_lamps(std::span(frames).first(2), map), IsEmpty()) << "too few to tell";
}

/// Of a camera that is known.
TEST_F(LampFaults, NameOneThatMovedAFewMillimetres) {
  constexpr double fits_px = 0.25;
  EXPECT_THAT(lamp_faults(frames, map, calibration, fits_px), IsEmpty());
  for (std::size_t i = 0; i < map.lamps.size(); ++i) {
    LampMap moved = map;
    moved.lamps[i].position_m += Eigen::Vector3d(0.004, 0, 0);
    EXPECT_THAT(lamp_faults(frames, moved, calibration, fits_px),
                ElementsAre(HasSubstr("lamp " + std::to_string(map.lamps[i].id) + " is loose")));
  }
}

/// A light that is taken for a lamp is rejected, and its capture counts as one that does not fit at
/// all: no reason to call the lamp loose unless many say so.
TEST_F(LampFaults, HoldNoSingleReflectionAgainstALamp) {
  constexpr double fits_px = 0.25;
  const int id = map.lamps[2].id;
  std::vector<Detection*> seen;
  for (Frame& frame : frames) {
    for (Detection& lamp : frame.detections) {
      if (lamp.lamp == id && frame.detections.size() > 3) seen.push_back(&lamp);
    }
  }
  ASSERT_GT(seen.size(), 20u);
  const std::size_t tenth = seen.size() / 10;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto faults = lamp_faults(frames, map, calibration, fits_px);
    if (i > tenth) {
      EXPECT_THAT(faults, ElementsAre(HasSubstr("lamp " + std::to_string(id) + " is loose"))) << i;
      break;
    }
    EXPECT_THAT(faults, IsEmpty()) << i << " of " << seen.size();
    constexpr double middle_px = 400, far_px = 80;
    seen[i]->pixel.x() += seen[i]->pixel.x() < middle_px ? far_px : -far_px;
  }
}

/// Places as the fixes have them, in the table of a check.
struct PlaceFaults : LampFaults {
  PlaceFaults() {
    const Positioner positioner(map, calibration);
    for (const Frame& frame : frames) {
      const Fix fix = positioner.locate(frame.detections);
      if (!fix.ok()) continue;
      Capture& place = places[frame.image];
      place.x_m = fix.estimate.pose.position_m.x() + 3e-4;
      place.y_m = fix.estimate.pose.position_m.y();
    }
  }
  CapturesTable places;
};

TEST_F(PlaceFaults, NameTheOnePointThatIsElsewhere) {
  EXPECT_THAT(place_faults(frames, map, calibration, places), IsEmpty());
  for (const std::size_t which : {std::size_t{0}, std::size_t{17}, frames.size() - 1}) {
    CapturesTable wrong = places;
    wrong.at(frames[which].image).y_m.value() += 0.02;
    EXPECT_THAT(
        place_faults(frames, map, calibration, wrong),
        ElementsAre(testing::AllOf(testing::StartsWith(frames[which].image + " was not taken"),
                                   HasSubstr("20.0 mm off, others 0.3 mm"))));
  }
}

/// Then it is not the points.
TEST_F(PlaceFaults, NameNoneWhereManyAreElsewhere) {
  for (std::size_t i = 0; i < frames.size(); i += 4) places[frames[i].image].y_m = 0.5;
  EXPECT_THAT(place_faults(frames, map, calibration, places), IsEmpty());
}

TEST(RowTime, IsThatWithWhichTheLightsAreTheLamps) {
  LampMap map;
  for (const double frequency_hz : {500., 640., 800., 1000., 1280., 1600.}) {
    Lamp lamp{};
    lamp.position_m.setZero();
    lamp.frequency_hz = frequency_hz;
    map.lamps.push_back(lamp);
  }
  constexpr double row_time_s = 3e-5;
  for (const double ratio : {0.9, 1.1, 1.05}) {
    std::vector<double> seen_hz;
    for (int i = 0; i < 24; ++i) {
      const double noise = 1 + 0.002 * (i % 3 - 1);
      const Lamp& lamp = map.lamps[static_cast<std::size_t>(i) % 4];
      seen_hz.push_back(*lamp.frequency_hz * ratio * noise);
    }
    seen_hz.push_back(3210);  // something else
    const auto found_s = row_time_that_fits(seen_hz, map, row_time_s);
    ASSERT_TRUE(found_s) << ratio;
    EXPECT_NEAR(*found_s / (row_time_s * ratio), 1, 0.003);
  }
  // With the row time that was said the lights are lamps, too: it is not that.
  for (const double ratio : {1., 0.99, 1.02}) {
    std::vector<double> seen_hz;
    for (const Lamp& lamp : map.lamps) seen_hz.push_back(*lamp.frequency_hz * ratio);
    EXPECT_FALSE(row_time_that_fits(seen_hz, map, row_time_s)) << ratio;
  }
  // Lights of another kind.
  EXPECT_FALSE(row_time_that_fits(std::vector<double>{510, 700, 905, 1033, 1111, 1401, 1777}, map,
                                  row_time_s));
  EXPECT_FALSE(row_time_that_fits(std::vector<double>{}, map, row_time_s));
}

}  // namespace
}  // namespace vlp
