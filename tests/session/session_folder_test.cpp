// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/session_folder.h"

#include <gmock/gmock.h>

#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::SizeIs;

TEST(ReadCapturesWithTruth, PrefersTruthTableToCapturesTable) {
  const TemporaryFolder folder;
  EXPECT_THAT(read_captures_with_truth(folder / ""), SizeIs(0));
  folder.file("captures.csv",
              "image,x_m,y_m,position_sd_m,roll_rad,pitch_rad\n"
              "a.png,1,2,0.01,0.1,0.2\nb.png,3,4,0.02,0,0\n");
  folder.file("truth.csv", "image,x_m,y_m,z_m,yaw_rad\na.png,1.5,2.5,0.5,1\nc.png,5,6,0,0\n");
  const CapturesTable captures = read_captures_with_truth(folder / "");
  ASSERT_THAT(captures, SizeIs(3));
  const Capture& both = captures.at("a.png");
  EXPECT_EQ(both.x_m, 1.5);
  EXPECT_EQ(both.y_m, 2.5);
  EXPECT_EQ(both.z_m, 0.5);
  EXPECT_EQ(both.yaw_rad, 1);
  EXPECT_FALSE(both.position_sd_m) << "of the other position";
  EXPECT_EQ(both.inclination->roll_rad, 0.1);
  EXPECT_EQ(captures.at("b.png").x_m, 3);
  EXPECT_EQ(captures.at("b.png").position_sd_m, 0.02);
  EXPECT_FALSE(captures.at("c.png").inclination);
}

TEST(ReadCapturesWithTruth, NamesLineOfInvalidTable) {
  const TemporaryFolder folder;
  folder.file("captures.csv", "image,x_m,y_m\na.png,1,2\nb.png,1");
  EXPECT_THAT(rejection_message([&] { read_captures_with_truth(folder / ""); }),
              HasSubstr("captures.csv:3"));
}

TEST(ReadTruthPositions, PrefersTruthTableToCapturesTable) {
  const TemporaryFolder folder;
  folder.file("captures.csv", "image,x_m,y_m\nb.png,3,4\na.png,1,2\nc.png,,\n");
  const auto places = read_truth_positions(folder / "");
  ASSERT_THAT(places, SizeIs(2));
  EXPECT_EQ(places[0].image, "a.png");
  EXPECT_EQ(places[1].xy_m.y(), 4);
  folder.file("truth.csv", "image,x_m,y_m\nd.png,5,6\n");
  EXPECT_EQ(read_truth_positions(folder / "")[0].image, "d.png");
}

TEST(SessionFolder, ConstructorNamesMissingFileOrFolder) {
  const TemporaryFolder folder;
  const auto refusal = [&] { return rejection_message([&] { SessionFolder(folder / "unit"); }); };
  EXPECT_THAT(refusal(), HasSubstr("unit: is not a folder of captures"));
  fs::create_directories(folder / "unit");
  EXPECT_THAT(refusal(), HasSubstr("unit/lamps.yaml: is missing"));
  folder.file("unit/lamps.yaml", "\n");
  EXPECT_THAT(refusal(), HasSubstr("unit/rotation: is missing"));
  fs::create_directories(folder / "unit/rotation");
  EXPECT_THAT(refusal(), HasSubstr("unit: has neither boards with board.yaml nor camera.yaml"));
  fs::create_directories(folder / "unit/boards");
  EXPECT_THAT(refusal(), HasSubstr("unit/board.yaml: is missing"));
  folder.file("unit/camera.yaml", "\n");
  const SessionFolder known(folder / "unit");
  EXPECT_TRUE(known.camera_calibration_path());
  EXPECT_FALSE(known.accuracy_check_folder());
}

TEST(SessionFolder, LineDriveFoldersAreThoseWhoseTablesHavePositions) {
  const TemporaryFolder folder;
  for (const char* name : {"unit/rotation", "unit/line-y", "unit/line-x", "unit/line-z"}) {
    fs::create_directories(folder / name);
  }
  folder.file("unit/lamps.yaml", "\n");
  folder.file("unit/camera.yaml", "\n");
  folder.file("unit/line-x/truth.csv", "image,x_m,y_m\na.png,1,2\n");
  folder.file("unit/line-y/captures.csv", "image,x_m,y_m\na.png,1,2\n");
  folder.file("unit/line-z/captures.csv", "image,time_s\na.png,1\n");
  const auto lines = SessionFolder(folder / "unit").line_drive_folders();
  ASSERT_THAT(lines, SizeIs(2));
  EXPECT_EQ(lines[0].filename(), "line-x");
  EXPECT_EQ(lines[1].filename(), "line-y");
  EXPECT_TRUE(is_session_folder(folder / "unit", folder / "unit"));
  for (const char* name : {"boards", "rotation", "dispersion", "check", "line-x"}) {
    fs::create_directories(folder / "unit" / name);
    EXPECT_TRUE(is_session_folder(folder / "unit", folder / "unit" / name)) << name;
  }
  EXPECT_FALSE(is_session_folder(folder / "unit", folder / "unit/results"));
  fs::create_directories(folder / "unit/results");
  EXPECT_FALSE(is_session_folder(folder / "unit", folder / "unit/results"));
}

}  // namespace
}  // namespace vlp
