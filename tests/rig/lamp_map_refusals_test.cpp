// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "rig/samples.h"

namespace vlp {
namespace {

using testing::StartsWith;

/// Invalid text, and how the message continues after the name of the file.
struct Refusal {
  std::string text, message;
};

/// Expects the refusal of maps with one lamp, in the third line, by its keys.
void expect_lamps_refused(const std::vector<Refusal>& refusals, const std::string& before = "") {
  for (const auto& [keys, message] : refusals) {
    EXPECT_THAT(map_refusal("format: vlp-lamps/1\nlamps:\n  - {" + before + keys + "}\n"),
                StartsWith("lamps.yaml:3: lamps[0]" + message))
        << keys;
  }
}

const std::string kLamp = "id: 1, position_m: [0, 0, 2], ";

TEST(ReadLampMap, ReportsLineAndKeyOfInvalidMap) {
  const std::string head = "format: vlp-lamps/1\n";
  for (const auto& [text, message] : std::vector<Refusal>{
           {head, "1: key 'lamps' is missing; the keys are: format"},
           {"lamps: []\n", "1: key 'format' is missing"},
           {head + "units: mm\nlamps: []\n", "2: key 'units' is unknown; the keys are: format, "},
           {head + "lamps: []\nlamps: []\n", "3: key 'lamps' occurs twice"},
           {head + "lamps: []\n", "2: lamps: contains no lamp"},
           {head + "\nlamps:\n\n# none\n", "3: lamps: should be a list, not nothing"},
           {head + "lamps:\n  id: 1\n", "3: lamps: should be a list, not a mapping"},
           {head + "lamps:\n  - 1\n", "3: lamps[0]: should be a mapping"},
           {changed(kLampsYaml, "id: 7", "id: 1"), "4: lamps[1]: id 1 occurs twice"},
           {changed(kLampsYaml, "[-0.25, 0, 2.1]", "[0.5, -0.3, 2.1009]"),
            "4: lamps[1]: lamp 7 is where lamp 1 is"}}) {
    EXPECT_THAT(map_refusal(text), StartsWith("lamps.yaml:" + message)) << text;
  }
  EXPECT_EQ(map_refusal(changed(kLampsYaml, "[-0.25, 0, 2.1]", "[0.5, -0.3, 2.102]")), "");
}

TEST(ReadLampMap, ReportsLineAndKeyOfMissingUnknownOrDuplicateKeyOfLamp) {
  expect_lamps_refused(
      {{"id: 1", ": key 'position_m' is missing; the keys are: id"},
       {"id: 1, position_mm: [0, 0, 2000]", ": key 'position_m' is missing; the keys are: id, "},
       {"position_m: [0, 0, 2]", ": key 'id' is missing; the keys are: position_m"},
       {kLamp + "position_mm: [0, 0, 2000]", ": key 'position_mm' is unknown; the keys are: id, "},
       {kLamp + "id: 2", ": key 'id' occurs twice"}});
}

TEST(ReadLampMap, RejectsInvalidShapesAndKeysOfOtherShape) {
  expect_lamps_refused(
      {{"size_m: [1.2, 0.1]", ".size_m: is of a rectangle"},
       {"shape: disc, yaw_rad: 0.1", ".yaw_rad: is of a rectangle"},
       {"shape: rectangle", ": key 'size_m' is missing"},
       {"shape: rectangle, size_m: [1.2, 0.1], diameter_m: 0.2", ".diameter_m: is of a disc"},
       {"shape: square, size_m: [1, 1]", ".shape: 'square' is "},
       {"shape: rectangle, size_m: [1.2]", ".size_m: should be "},
       {"shape: rectangle, size_m: [1200, 100]", ".size_m[0]: 1200 m is not within 0.001 and 10 m"},
       {"shape: rectangle, size_m: [1, 1], yaw_rad: 90", ".yaw_rad: 90 rad is not within"}},
      kLamp);
}

TEST(ReadLampMap, RejectsIdThatIsNotNonNegativeInteger) {
  for (const std::string id : {"-1", "1.5", "1.0", "2147483648", "one", "0x1", "[1]", "''", ""}) {
    expect_lamps_refused({{"id: " + id + ", position_m: [0, 0, 2]", ".id: should be a whole"}});
  }
}

TEST(ReadLampMap, RejectsNumbersThatAreNotFinite) {
  for (const std::string number :
       {"2.1 m", "2,1", ".nan", ".NaN", "nan", ".inf", "-.inf", "inf", "1e999", "0x10", "2.1.1",
        "1_000", "+-2", "true", "''", "~", "two"}) {
    expect_lamps_refused({{kLamp + "diameter_m: '" + number + "'", ".diameter_m: should be a "}});
    if (number == "2,1") continue;  // two numbers here
    expect_lamps_refused({{"id: 1, position_m: [0, 0, " + number + "]",
                           ".position_m[2]: should be a finite number, not "}});
  }
}

TEST(ReadLampMap, ReportsValueOfOtherKindOrLength) {
  const std::string number = ".duty: should be a finite number, not ";
  expect_lamps_refused({{"duty: 50 %", number + "'50 %'"},
                        {"duty: [0.5]", number + "a list"},
                        {"duty: {is: 0.5}", number + "a mapping"},
                        {"duty:", number + "nothing"}},
                       kLamp);
  expect_lamps_refused({{"[0, 2]", ".position_m: should be 3 numbers, not 2"},
                        {"[0, 0, 2,1]", ".position_m: should be 3 numbers, not 4"},
                        {"2", ".position_m: should be a list, not '2'"},
                        {"{x: 0}", ".position_m: should be a list, not a mapping"}},
                       "id: 1, position_m: ");
}

TEST(ReadLampMap, ReportsUnitOfValueOutOfRange) {
  expect_lamps_refused({{"diameter_m: 180", ".diameter_m: 180 m is not within 0.001 and 10 m: is "},
                        {"diameter_m: 0", ".diameter_m: 0 m is not"},
                        {"frequency_hz: 2", ".frequency_hz: 2 Hz is not"},
                        {"frequency_hz: -2000", ".frequency_hz: -2000 Hz is not within"},
                        {"frequency_hz: 2e6", ".frequency_hz: 2000000 Hz is not within"},
                        {"duty: 50", ".duty: 50 (a fraction of the"},
                        {"duty: 0", ".duty: 0 (a fraction of the"}},
                       kLamp);
  expect_lamps_refused({{"id: 1, position_m: [500, -300, 2100]",
                         ".position_m[2]: 2100 m is not within -200 and 200 m: is it in the"}});
}

}  // namespace
}  // namespace vlp
