// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Inputs that vlp-rotation rejects with all methods.
#include <gmock/gmock.h>

#include <utility>

#include "rig/lamp_map.h"
#include "rotation_program.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

class VlpRotationRefusals : public VlpRotation {
 protected:
  /// With `lamps` as the map, by each method.
  void expect_refusals(const std::string& message) {
    write_lamp_map(folder / "other.yaml", lamps);
    for (const std::string method : {"axis", "circle", "lamps"}) {
      SCOPED_TRACE(method);
      expect_refusal(run_program("vlp-rotation " + kExample + "turning.csv --lamps " +
                                 (folder / "other.yaml").string() + " --calibration " + kExample +
                                 "calibration.yaml -o " + output.string() + " --method " + method),
                     2, "other.yaml: " + message);
    }
  }
  LampMap lamps = read_lamp_map(kExample + "lamps.yaml");
};

TEST_F(VlpRotationRefusals, EachMethodRejectsMirroredLampMap) {
  for (Lamp& lamp : lamps.lamps) lamp.position_m.x() *= -1;
  expect_refusals("the lamp map seems to be mirrored");
}

TEST_F(VlpRotationRefusals, RejectsLampMapAndNamesSwappedLamps) {
  std::swap(lamps.lamps[0].position_m, lamps.lamps[1].position_m);
  expect_refusals("lamps 1 and 2 seem to be swapped");
}

TEST_F(VlpRotationRefusals, ExitsWith3ForTooFewCapturesYawsOrLamps) {
  expect_refusal(rotation(captures([](std::size_t i) { return i < 1; })), 3, "add captures");
  expect_refusal(rotation(captures([](std::size_t i) { return i < 3; })), 3,
                 "less than 90 degrees: add captures");
  auto frames = read_detections(kExample + "turning.csv");
  auto alike = frames;
  for (Frame& frame : alike) frame.detections = frames[0].detections;
  expect_refusal(rotation(written(alike)), 3, "have the same yaw: turn the camera");
  for (Frame& frame : frames) frame.detections.resize(1);
  expect_refusal(rotation(written(frames)), 3, "add lamps");
}

/// Captures that differ by their noise alone, at two yaws of the turn or at three.
TEST_F(VlpRotationRefusals, RejectsCircleMethodForCapturesAtTwoYaws) {
  const auto turn = read_detections(kExample + "turning.csv");
  // The turn is at two heights, one after the other.
  const std::size_t half = turn.size() / 4, quarter = turn.size() / 8;
  const auto repeated = [&](const std::vector<std::size_t>& captures) {
    Random random(5);
    std::vector<Frame> frames;
    for (const std::size_t i : captures) {
      frames.push_back({std::to_string(frames.size()), with_noise(turn[i].detections, random)});
    }
    return written(frames);
  };
  expect_refusal(rotation(repeated({0, half, 0, half, 0, half}), "--method circle"), 3,
                 "noise determines most circles, as with captures at two yaws");
  EXPECT_EQ(rotation(repeated({0, half, quarter, 0, half, quarter}), "--method circle").exit_code,
            0);
}

TEST_F(VlpRotationRefusals, ExitsWith2ForLampMapOfAnotherRoom) {
  const std::string map = "format: vlp-lamps/1\nlamps:\n";
  const auto other = [&](const std::string& places) {
    return run_program("vlp-rotation " + kExample + "turning.csv --lamps " +
                       folder.file("other.yaml", map + places).string() + " --calibration " +
                       kExample + "calibration.yaml -o " + output.string());
  };
  expect_refusal(
      other("  - {id: 11, position_m: [0, 0, 2]}\n  - {id: 12, position_m: [1, 0, 2]}\n"), 2,
      "other.yaml");
  expect_refusal(other("  - {id: 1, position_m: [0.3, 0, 2]}\n  - {id: 2, position_m: [1, 0, 2]}\n"
                       "  - {id: 3, position_m: [1, 0.9, 2]}\n"
                       "  - {id: 4, position_m: [-2, 0.9, 2]}\n"),
                 2, "is it the map of this room?");
}

TEST_F(VlpRotationRefusals, RejectsPlotPathEqualToLampMapAndKeepsMap) {
  const std::string input = kExample + "lamps.yaml";
  const std::string before = TemporaryFolder::read_content(input);
  expect_refusal(rotation(kExample + "turning.csv", "--plot " + input), 2,
                 "is also an input and would be overwritten");
  EXPECT_EQ(TemporaryFolder::read_content(input), before);
}

}  // namespace
}  // namespace vlp
