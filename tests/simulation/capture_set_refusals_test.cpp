// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// The captures of a scene. Its room is 2 x 1 x 1.7 m, its lever arm 5 cm.
#include <gmock/gmock.h>

#include "simulation/scene_sample.h"

namespace vlp {
namespace {

std::string without_board() {
  std::string yaml = kSceneYaml;
  const auto begin = yaml.find("board:\n");
  return yaml.erase(begin, yaml.find("captures:\n") - begin);
}

TEST(ReadSceneCaptureSet, RejectsCameraPositionOutsideRoom) {
  const std::string problem = "moves the camera outside the room";
  EXPECT_EQ(refusal_with("[-0.2, 0.3]", "[-0.2, 0.6]"),
            "scene.yaml:25: captures[0].pivots_m[1]: " + problem);
  EXPECT_EQ(refusal_with("x_m: [-0.6, 0.6], y", "x_m: [-1.6, 0.6], y"),
            "scene.yaml:26: captures[1].grid: " + problem);
  EXPECT_EQ(refusal_with("y_m: [0.3, -0.3]", "y_m: [0.7, -0.3]"),
            "scene.yaml:26: captures[1].grid: " + problem);
  EXPECT_EQ(refusal_with("from_m: [-0.3, 0]", "from_m: [-1.1, 0]"),
            "scene.yaml:27: captures[2].drive.from_m: " + problem);
  EXPECT_EQ(refusal_with("to_m: [0.5, 0.4]", "to_m: [0.5, -0.9]"),
            "scene.yaml:27: captures[2].drive.to_m: " + problem);
  EXPECT_EQ(refusal_with("heights_m: [0.1]", "heights_m: [-0.1]"),
            "scene.yaml:26: captures[1].heights_m[0]: " + problem);
}

TEST(ReadSceneCaptureSet, RejectsPositionWhenLeverArmCanLeaveRoom) {
  const std::string problem = "moves the camera outside the room";
  EXPECT_EQ(refusal_with("[-0.2, 0.3]", "[0.949, -0.449]"), "");
  EXPECT_EQ(refusal_with("[-0.2, 0.3]", "[0.951, -0.449]"),
            "scene.yaml:25: captures[0].pivots_m[1]: " + problem);
  EXPECT_EQ(refusal_with("[-0.2, 0.3]", "[0.949, -0.451]"),
            "scene.yaml:25: captures[0].pivots_m[1]: " + problem);
  EXPECT_EQ(refusal_with("y_m: [0.3, -0.3]", "y_m: [0.451, -0.3]"),
            "scene.yaml:26: captures[1].grid: " + problem);
  EXPECT_EQ(refusal_with("to_m: [0.5, 0.4]", "to_m: [0.5, 0.451]"),
            "scene.yaml:27: captures[2].drive.to_m: " + problem);
}

TEST(ReadSceneCaptureSet, RejectsHeightNotBelowAllLamps) {
  EXPECT_EQ(refusal_with("[0, 0.2]", "[0, 1.5]"),
            "scene.yaml:25: captures[0].heights_m[1]: lamp 5 is not above the camera");
  EXPECT_EQ(refusal_with("[0, 0.2]", "[0, 1.65]"),
            "scene.yaml:25: captures[0].heights_m[1]: lamp 1 is not above the camera");
}

TEST(ReadSceneCaptureSet, RejectsValuesOutOfRange) {
  EXPECT_EQ(refusal_with("exposure_s: 5.0e-5", "exposure_s: -0.5"),
            "scene.yaml:25: captures[0].exposure_s: -0.5 s is not within 1.0e-07 and 1 s: is "
            "it in the right unit?");
  EXPECT_EQ(refusal_with("interval_s: 0.5", "interval_s: 0"),
            "scene.yaml:25: captures[0].interval_s: 0 s is not within 1.0e-06 and 100000 s: is it "
            "in the right unit?");
  EXPECT_EQ(refusal_with("repeat: 3", "repeat: 0"),
            "scene.yaml:25: captures[0].repeat: should be a whole number within 1 and 1000000, "
            "not '0'");
  EXPECT_EQ(refusal_with("known: true", "known: 1"),
            "scene.yaml:25: captures[0].known: should be true or false, not '1'");
  EXPECT_EQ(refusal_with("columns: 3", "columns: 1"),
            "scene.yaml:26: captures[1].grid.columns: should be a whole number within 2 and 1000, "
            "not '1'");
  EXPECT_EQ(refusal_with("speed_m_per_s: 0.5", "speed_m_per_s: 0"),
            "scene.yaml:27: captures[2].drive.speed_m_per_s: 0 m/s is not within 1.0e-06 and 20 "
            "m/s: is it in the right unit?");
  EXPECT_EQ(refusal_with("distance_m: [0.2, 0.4]", "distance_m: [0.4, 0.2]"),
            "scene.yaml:28: captures[3].views.distance_m: should be [least, most]");
  EXPECT_EQ(refusal_with("tilt_deg: 45", "tilt_deg: 90"),
            "scene.yaml:28: captures[3].views.tilt_deg: 90 degrees is not within 0 and 80 degrees: "
            "is it in the right unit?");
}

TEST(ReadSceneCaptureSet, RejectsNoneOrTwoKeysForPositions) {
  const std::string problem = "needs one of the keys pivots_m, grid, drive, views";
  EXPECT_EQ(refusal_with("pivots_m: [[0.1, -0.05], [-0.2, 0.3]], ", ""),
            "scene.yaml:25: captures[0]: " + problem);
  EXPECT_EQ(refusal_with("folder: grid,", "folder: grid, pivots_m: [[0, 0]],"),
            "scene.yaml:26: captures[1]: " + problem);
  EXPECT_EQ(refusal_with("folder: line,", "folder: line, pivots_m: [[0, 0]],"),
            "scene.yaml:27: captures[2]: " + problem);
  EXPECT_EQ(refusal_with("folder: boards,", "folder: boards, pivots_m: [[0, 0]],"),
            "scene.yaml:28: captures[3]: key 'pivots_m' is unknown; the keys are: folder, "
            "exposure_s, views");
}

TEST(ReadSceneCaptureSet, RejectsNoneOrTwoKeysForYaws) {
  const std::string problem = "needs one of the keys yaws_deg and turn";
  EXPECT_EQ(refusal_with("yaws_deg: [20, -90], ", ""), "scene.yaml:25: captures[0]: " + problem);
  EXPECT_EQ(refusal_with("folder: grid,", "folder: grid, yaws_deg: [0],"),
            "scene.yaml:26: captures[1]: " + problem);
}

TEST(ReadSceneCaptureSet, RejectsEmptyListOfPivotsHeightsYawsOrCaptures) {
  EXPECT_EQ(refusal_with("[[0.1, -0.05], [-0.2, 0.3]]", "[]"),
            "scene.yaml:25: captures[0].pivots_m: contains no pivot");
  EXPECT_EQ(refusal_with("heights_m: [0, 0.2]", "heights_m: []"),
            "scene.yaml:25: captures[0].heights_m: contains no height");
  EXPECT_EQ(refusal_with("yaws_deg: [20, -90]", "yaws_deg: []"),
            "scene.yaml:25: captures[0].yaws_deg: contains no yaw");
  const std::string before = kSceneYaml.substr(0, kSceneYaml.find("captures:\n"));
  EXPECT_EQ(scene_refusal(before + "captures: []\n"),
            "scene.yaml:24: captures: contains no captures");
}

TEST(ReadSceneCaptureSet, RejectsDriveWithEqualEnds) {
  EXPECT_EQ(refusal_with("to_m: [0.5, 0.4]", "to_m: [-0.3, 0]"),
            "scene.yaml:27: captures[2].drive: has no length");
}

TEST(ReadSceneCaptureSet, RejectsMoreThanOneMillionCaptures) {
  EXPECT_EQ(refusal_with("speed_m_per_s: 0.5", "speed_m_per_s: 1.0e-6"),
            "scene.yaml:27: captures[2].drive: makes more than 1000000 captures");
  EXPECT_EQ(refusal_with("repeat: 3", "repeat: 1000000"),
            "scene.yaml:25: captures[0]: makes more than 1000000 captures");
}

TEST(ReadSceneCaptureSet, RejectsFolderNameWithOtherThanLettersDigitsDashUnderscore) {
  for (const std::string name : {"../spots", "..", ".", "a/b", "/tmp", "''", "a.b", "a b", "ä"}) {
    EXPECT_EQ(refusal_with("folder: spots", "folder: " + name),
              "scene.yaml:25: captures[0].folder: should be a name of letters, digits, - and _");
  }
  EXPECT_EQ(refusal_with("folder: spots", "folder: Spots-2_b"), "");
}

TEST(ReadSceneCaptureSet, RejectsTwoCaptureSetsWithSameFolder) {
  EXPECT_EQ(refusal_with("folder: line", "folder: spots"),
            "scene.yaml:27: captures[2]: folder 'spots' occurs twice");
}

TEST(ReadSceneCaptureSet, RejectsBoardSetWithoutBoardAndLampSetWithoutLamps) {
  EXPECT_EQ(scene_refusal(without_board()),
            "scene.yaml:21: captures[3]: views are of a board, and the scene has none");
  std::string dark = kSceneYaml;
  const auto begin = dark.find("lamps:\n");
  dark.erase(begin, dark.find("board:\n") - begin);
  EXPECT_EQ(scene_refusal(dark), "scene.yaml:17: captures[0]: the scene has no lamps");
}

}  // namespace
}  // namespace vlp
