// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/lamp_map_file.h"

#include <gmock/gmock.h>

#include <bit>
#include <cmath>
#include <random>

#include "rig/find_lamp.h"
#include "rig/samples.h"
#include "support/rejection_message.h"

namespace vlp {
namespace {

using testing::HasSubstr;

TEST(ReadLampMap, ReadsEveryKey) {
  const TemporaryFolder folder;
  expect_same(read_lamp_map(folder.file("lamps.yaml", kLampsYaml)), sample_lamps());
}

TEST(WriteLampMap, WritesExpectedYamlByteForByte) {
  const TemporaryFolder folder;
  write_lamp_map(folder / "lamps.yaml", sample_lamps());
  EXPECT_EQ(folder.read_content(folder / "lamps.yaml"), kLampsYaml);
}

TEST(ReadLampMap, RoundTripsLampsBelowCamera) {
  const TemporaryFolder folder;
  const auto with = [&](const std::string& value) {
    return folder.file("lamps.yaml",
                       changed(kLampsYaml, "lamps:", "lamps_below_camera: " + value + "\nlamps:"));
  };
  EXPECT_FALSE(read_lamp_map(with("false")).lamps_below_camera);
  const LampMap map = read_lamp_map(with("true"));
  EXPECT_TRUE(map.lamps_below_camera);
  write_lamp_map(folder / "written.yaml", map);
  expect_same(read_lamp_map(folder / "written.yaml"), map);
  EXPECT_THAT(refusal(read_lamp_map, with("1")),
              HasSubstr("lamps.yaml:2: lamps_below_camera: should be true or false"));
}

TEST(ReadOverheadLamps, RejectsLampsBelowCamera) {
  const TemporaryFolder folder;
  const auto file = folder.file("lamps.yaml", kLampsYaml);
  expect_same(read_overhead_lamps(file, ""), sample_lamps());
  folder.file("lamps.yaml", changed(kLampsYaml, "lamps:", "lamps_below_camera: true\nlamps:"));
  EXPECT_THAT(rejection_message([&] { read_overhead_lamps(file, ""); }),
              HasSubstr("lamps.yaml: lamps_below_camera: only vlp-detect and vlp-locate"));
}

TEST(ReadLampMap, PrefersSdOfLampToSdOfMap) {
  const TemporaryFolder folder;
  const LampMap map = read_lamp_map(folder.file("lamps.yaml", R"(format: vlp-lamps/1
sd_m: 0.002
lamps:
  - {id: 1, position_m: [0.5, -0.3, 2.1]}
  - {id: 7, position_m: [-0.25, 0, 2.1], sd_m: 0.01}
)"));
  EXPECT_EQ(map.lamps[0].sd_m, 0.002);
  EXPECT_EQ(map.lamps[1].sd_m, 0.01);
  write_lamp_map(folder / "written.yaml", map);
  expect_same(read_lamp_map(folder / "written.yaml"), map);
}

TEST(ReadLampsOfRoom, ReturnsOnlyLampsOfNamedRoom) {
  const TemporaryFolder folder;
  const auto file = folder.file("lamps.yaml", R"(format: vlp-lamps/1
lamps:
  - {id: 1, room: hall, position_m: [0.5, -0.3, 2.1], frequency_hz: 2000}
  - {id: 7, room: office, position_m: [9.5, -0.3, 2.1], frequency_hz: 2000}
)");
  const LampMap hall = read_lamps_of_room(file, "hall");
  ASSERT_EQ(hall.lamps.size(), 1U);
  EXPECT_EQ(hall.lamps[0].id, 1);
  EXPECT_EQ(read_lamp_map(file).lamps.size(), 2U);
  EXPECT_EQ(read_lamps_and_rooms(file, "").rooms, (std::vector<std::string>{"hall", "office"}));
  EXPECT_EQ(read_lamps_and_rooms(file, "office").rooms, std::vector<std::string>{"office"});
  EXPECT_THAT(rejection_message([&] { read_lamps_of_room(file, "attic"); }),
              HasSubstr("has no lamp with 'room: attic'"));
}

TEST(ReadLampMap, ReadsShapesOfDiscsAndRectangles) {
  const TemporaryFolder folder;
  const std::string yaml = R"(format: vlp-lamps/1
lamps:
  - {id: 1, position_m: [0, 0, 2.1], shape: rectangle, size_m: [1.2, 0.1], yaw_rad: 0.3, frequency_hz: 2000, duty: 0.5}
  - {id: 2, position_m: [1, 0, 2.1], shape: rectangle, size_m: [0.6, 0.6], yaw_rad: 0}
  - {id: 3, position_m: [2, 0, 2.1], diameter_m: 0.18}
)";
  const LampMap map = read_lamp_map(folder.file("lamps.yaml", yaml));
  ASSERT_EQ(map.lamps.size(), 3U);
  EXPECT_EQ(map.lamps[0].shape.kind, ShapeKind::rectangle);
  EXPECT_EQ(map.lamps[0].shape.size_m, Eigen::Vector2d(1.2, 0.1));
  EXPECT_EQ(map.lamps[0].shape.yaw_rad, 0.3);
  EXPECT_EQ(map.lamps[2].shape.kind, ShapeKind::disc);
  write_lamp_map(folder / "written.yaml", map);
  EXPECT_EQ(folder.read_content(folder / "written.yaml"), yaml);
  const auto read_as = [&](const std::string& from, const std::string& to) {
    return read_lamp_map(folder.file("other.yaml", changed(yaml, from, to)));
  };
  expect_same(read_as(", yaw_rad: 0}", "}"), map);
  expect_same(read_as("2.1], diameter_m", "2.1], shape: disc, diameter_m"), map);
}

TEST(FindLampById, ReturnsLampWithIdOrNullptr) {
  LampMap map;
  for (const int id : {7, 2, 40}) map.lamps.push_back({id, {0, 0.1 * id, 2}, {}, {}, {}});
  EXPECT_EQ(find_lamp_by_id(map.lamps, 2), &map.lamps[1]);
  EXPECT_EQ(find_lamp_by_id(map.lamps, 40), &map.lamps[2]);
  EXPECT_EQ(find_lamp_by_id(map.lamps, 3), nullptr);
  EXPECT_EQ(find_lamp_by_id({}, 7), nullptr);
}

TEST(WriteLampMap, RoundTripsAnyFiniteDoubleExactly) {
  std::mt19937_64 random(1);
  const auto any_finite = [&random] {
    for (;;) {
      const auto value = std::bit_cast<double>(random());
      if (std::isfinite(value)) return value;
    }
  };
  LampMap map;
  for (int id = 0; id < 300; ++id) {
    map.lamps.push_back({id, {any_finite(), any_finite(), 0.1 * id}, {}, {}, {}});
  }
  map.lamps[0].position_m.x() = 5e-324;  // the smallest
  map.lamps[1].position_m.x() = std::numeric_limits<double>::max();
  map.lamps[2].position_m.x() = 0.1;
  const TemporaryFolder folder;
  write_lamp_map(folder / "lamps.yaml", map);
  expect_same(read_lamp_map(folder / "lamps.yaml"), map);
}

// Readers of YAML 1.1 parse 1e-07 as text.
TEST(WriteLampMap, WritesDecimalPointInNumbersWithExponent) {
  const TemporaryFolder folder;
  write_lamp_map(folder / "lamps.yaml", {{{1, {1e-7, -2e300, 0}, {}, 1e5, {}}}});
  EXPECT_THAT(folder.read_content(folder / "lamps.yaml"),
              HasSubstr("{id: 1, position_m: [1.0e-07, -2.0e+300, 0], frequency_hz: 100000}"));
}

TEST(ReadLampMap, AcceptsYamlInBlockStyleAndAnyKeyOrder) {
  const TemporaryFolder folder;
  const auto lamps = read_lamp_map(folder.file("lamps.yaml", R"(---
# A comment.
lamps:
- id: +1  # a comment
  position_m:
  - 0.5
  - -3.0e-1
  - 2.10
  "duty": 0.5
  frequency_hz: 2000.0
  diameter_m: .18
- position_m: [-25e-2, 0, &height 2.1]
  id: 7
format: "vlp-lamps/1"
...
)"));
  expect_same(lamps, sample_lamps());
}

}  // namespace
}  // namespace vlp
