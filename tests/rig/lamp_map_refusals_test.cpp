// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "rig/samples.h"

namespace vlp {
namespace {

using testing::HasSubstr;

/// Returns the message for a map with one lamp, in the third line.
std::string refusal_of_lamp(const std::string& keys) {
  return map_refusal("format: vlp-lamps/1\nlamps:\n  - {" + keys + "}\n");
}

TEST(ReadLampMap, ReportsLineAndKeyOfMissingKey) {
  EXPECT_EQ(refusal_of_lamp("id: 1"),
            "lamps.yaml:3: lamps[0]: key 'position_m' is missing; the keys are: id");
  EXPECT_EQ(refusal_of_lamp("id: 1, position_mm: [0, 0, 2000]"),
            "lamps.yaml:3: lamps[0]: key 'position_m' is missing; the keys are: id, position_mm");
  EXPECT_EQ(refusal_of_lamp("position_m: [0, 0, 2]"),
            "lamps.yaml:3: lamps[0]: key 'id' is missing; the keys are: position_m");
  EXPECT_EQ(map_refusal("format: vlp-lamps/1\n"),
            "lamps.yaml:1: key 'lamps' is missing; the keys are: format");
  EXPECT_EQ(
      map_refusal("lamps: []\n"),
      "lamps.yaml:1: key 'format' is missing: the file should begin with 'format: vlp-lamps/1'");
}

TEST(ReadLampMap, ReportsLineAndKeyOfUnknownKey) {
  EXPECT_EQ(refusal_of_lamp("id: 1, position_m: [0, 0, 2], position_mm: [0, 0, 2000]"),
            "lamps.yaml:3: lamps[0]: key 'position_mm' is unknown; the keys are: id, position_m, "
            "shape, diameter_m, size_m, yaw_rad, frequency_hz, duty, sd_m, room");
  EXPECT_EQ(map_refusal("format: vlp-lamps/1\nunits: mm\nlamps: []\n"),
            "lamps.yaml:2: key 'units' is unknown; the keys are: format, sd_m, "
            "lamps_below_camera, lamps");
}

TEST(ReadLampMap, ReportsLineAndKeyOfDuplicateKey) {
  EXPECT_EQ(refusal_of_lamp("id: 1, position_m: [0, 0, 2], id: 2"),
            "lamps.yaml:3: lamps[0]: key 'id' occurs twice");
  EXPECT_EQ(map_refusal("format: vlp-lamps/1\nlamps: []\nlamps: []\n"),
            "lamps.yaml:3: key 'lamps' occurs twice");
}

TEST(ReadLampMap, RejectsInvalidShapesAndKeysOfOtherShape) {
  const std::string lamp = "id: 1, position_m: [0, 0, 2], ", place = "lamps.yaml:3: lamps[0]";
  EXPECT_EQ(refusal_of_lamp(lamp + "size_m: [1.2, 0.1]"),
            place + ".size_m: is of a rectangle: say 'shape: rectangle', too");
  EXPECT_EQ(refusal_of_lamp(lamp + "shape: disc, yaw_rad: 0.1"),
            place + ".yaw_rad: is of a rectangle: say 'shape: rectangle', too");
  EXPECT_THAT(refusal_of_lamp(lamp + "shape: rectangle"),
              HasSubstr(place + ": key 'size_m' is missing"));
  EXPECT_EQ(refusal_of_lamp(lamp + "shape: rectangle, size_m: [1.2, 0.1], diameter_m: 0.2"),
            place + ".diameter_m: is of a disc, and this is a rectangle: it has a size_m");
  EXPECT_THAT(refusal_of_lamp(lamp + "shape: square, size_m: [1, 1]"),
              HasSubstr(place + ".shape: 'square' is "));
  EXPECT_THAT(refusal_of_lamp(lamp + "shape: rectangle, size_m: [1.2]"),
              HasSubstr(place + ".size_m: should be "));
  EXPECT_THAT(refusal_of_lamp(lamp + "shape: rectangle, size_m: [1200, 100]"),
              HasSubstr(place + ".size_m[0]: 1200 m is not within 0.001 and 10 m"));
  EXPECT_THAT(refusal_of_lamp(lamp + "shape: rectangle, size_m: [1, 1], yaw_rad: 90"),
              HasSubstr(place + ".yaw_rad: 90 rad is not within -6.3 and 6.3 rad"));
}

TEST(ReadLampMap, ReportsLineOfDuplicateId) {
  EXPECT_EQ(map_refusal(changed(kLampsYaml, "id: 7", "id: 1")),
            "lamps.yaml:4: lamps[1]: id 1 occurs twice");
}

TEST(ReadLampMap, ReportsBothLampsAtSamePosition) {
  EXPECT_EQ(map_refusal(changed(kLampsYaml, "[-0.25, 0, 2.1]", "[0.5, -0.3, 2.1009]")),
            "lamps.yaml:4: lamps[1]: lamp 7 is where lamp 1 is");
  EXPECT_EQ(map_refusal(changed(kLampsYaml, "[-0.25, 0, 2.1]", "[0.5, -0.3, 2.102]")), "");
}

TEST(ReadLampMap, RejectsIdThatIsNotNonNegativeInteger) {
  for (const std::string id : {"-1", "1.5", "1.0", "2147483648", "one", "0x1", "[1]", "''", ""}) {
    EXPECT_THAT(refusal_of_lamp("id: " + id + ", position_m: [0, 0, 2]"),
                HasSubstr("lamps.yaml:3: lamps[0].id: should be a whole number within 0 and "
                          "2147483647, not "));
  }
}

TEST(ReadLampMap, RejectsNumbersThatAreNotFinite) {
  for (const std::string number :
       {"2.1 m", "2,1", ".nan", ".NaN", "nan", ".inf", "-.inf", "inf", "1e999", "0x10", "2.1.1",
        "1_000", "+-2", "true", "''", "~", "two"}) {
    EXPECT_THAT(refusal_of_lamp("id: 1, position_m: [0, 0, 2], diameter_m: '" + number + "'"),
                HasSubstr("lamps.yaml:3: lamps[0].diameter_m: should be a finite number, not "));
    if (number == "2,1") continue;  // two numbers here
    EXPECT_THAT(refusal_of_lamp("id: 1, position_m: [0, 0, " + number + "]"),
                HasSubstr("lamps.yaml:3: lamps[0].position_m[2]: should be a finite number, not "));
  }
}

TEST(ReadLampMap, ReportsValueInPlaceOfNumber) {
  const std::string place = "lamps.yaml:3: lamps[0].duty: should be a finite number, not ";
  const std::string lamp = "id: 1, position_m: [0, 0, 2], duty: ";
  EXPECT_EQ(refusal_of_lamp(lamp + "50 %"), place + "'50 %'");
  EXPECT_EQ(refusal_of_lamp(lamp + "[0.5]"), place + "a list");
  EXPECT_EQ(refusal_of_lamp(lamp + "{is: 0.5}"), place + "a mapping");
  EXPECT_EQ(refusal_of_lamp(lamp), place + "nothing");
}

TEST(ReadLampMap, RejectsPositionWithoutThreeNumbers) {
  const std::string place = "lamps.yaml:3: lamps[0].position_m: ";
  EXPECT_EQ(refusal_of_lamp("id: 1, position_m: [0, 2]"), place + "should be 3 numbers, not 2");
  EXPECT_EQ(refusal_of_lamp("id: 1, position_m: [0, 0, 2,1]"),
            place + "should be 3 numbers, not 4");
  EXPECT_EQ(refusal_of_lamp("id: 1, position_m: 2"), place + "should be a list, not '2'");
  EXPECT_EQ(refusal_of_lamp("id: 1, position_m: {x: 0}"),
            place + "should be a list, not a mapping");
}

TEST(ReadLampMap, ReportsUnitOfValueOutOfRange) {
  const std::string lamp = "id: 1, position_m: [0, 0, 2], ";
  const std::string place = "lamps.yaml:3: lamps[0].";
  EXPECT_EQ(refusal_of_lamp("id: 1, position_m: [500, -300, 2100]"),
            place + "position_m[2]: 2100 m is not within -200 and 200 m: is it in the right unit?");
  EXPECT_EQ(refusal_of_lamp(lamp + "diameter_m: 180"),
            place + "diameter_m: 180 m is not within 0.001 and 10 m: is it in the right unit?");
  EXPECT_THAT(refusal_of_lamp(lamp + "diameter_m: 0"), HasSubstr(place + "diameter_m: 0 m is not"));
  EXPECT_THAT(refusal_of_lamp(lamp + "frequency_hz: 2"), HasSubstr("frequency_hz: 2 Hz is not"));
  EXPECT_THAT(refusal_of_lamp(lamp + "frequency_hz: -2000"), HasSubstr("-2000 Hz is not within"));
  EXPECT_THAT(refusal_of_lamp(lamp + "frequency_hz: 2e6"), HasSubstr("2000000 Hz is not within"));
  EXPECT_THAT(refusal_of_lamp(lamp + "duty: 50"), HasSubstr(place + "duty: 50 (a fraction of the"));
  EXPECT_THAT(refusal_of_lamp(lamp + "duty: 0"), HasSubstr(place + "duty: 0 (a fraction of the"));
}

TEST(ReadLampMap, RejectsLampsThatAreNotNonEmptyListOfMappings) {
  EXPECT_EQ(map_refusal("format: vlp-lamps/1\nlamps: []\n"),
            "lamps.yaml:2: lamps: contains no lamp");
  EXPECT_EQ(map_refusal("format: vlp-lamps/1\n\nlamps:\n\n# none\n"),
            "lamps.yaml:3: lamps: should be a list, not nothing");
  EXPECT_EQ(map_refusal("format: vlp-lamps/1\nlamps:\n  id: 1\n"),
            "lamps.yaml:3: lamps: should be a list, not a mapping");
  EXPECT_EQ(map_refusal("format: vlp-lamps/1\nlamps:\n  - 1\n"),
            "lamps.yaml:3: lamps[0]: should be a mapping of keys to values, not '1'");
}

}  // namespace
}  // namespace vlp
