// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/watched_run.h"

#include <gmock/gmock.h>

#include "station/unit/camera_source.h"
#include "support/rejection_message.h"
#include "support/temporary_folder.h"
#include "support/write_video.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// A run of a unit whose captures others can write to.
class WatchedRunTest : public testing::Test {
 protected:
  WatchedRunTest() { fs::create_directory(folder / "elsewhere"); }

  StationConfig make_config() const {
    StationConfig made = read_station_config(VLP_SOURCE_DIR "/datasets/station/station.yaml");
    made.captures = folder / "captures";
    made.results = folder / "results";
    return made;
  }
  /// Puts a link to another folder in the place of one of the captures.
  void replace_by_link(const std::string& name) const {
    fs::rename(folder / name, folder / "moved");
    fs::create_directory_symlink(folder / "elsewhere", folder / name);
  }

  const TemporaryFolder folder;
  StationConfig config = make_config();
  Unit unit{config, "0001", {"test", "0"}, 1};
  Spool spool{folder / "spool", (folder / "records.db").string()};
};

TEST_F(WatchedRunTest, WritesNoFrameWhenFolderBecameSymbolicLink) {
  const fs::path video = folder / "black.avi";
  const cv::Mat frame(600, 800, CV_8UC1, cv::Scalar(0));
  if (!write_video(video, {frame, frame})) GTEST_SKIP() << "OpenCV writes no video here";
  StepSources sources({video.string()}, {800, 600});
  WatchedRun run(unit, spool);
  sources.write_next_frame(unit, run);
  ASSERT_TRUE(fs::exists(run.run_folder() / "boards/frame-000000.png"));
  replace_by_link("captures/0001/boards");
  EXPECT_THAT(rejection_message([&] { sources.write_next_frame(unit, run); }),
              HasSubstr("boards: was moved or replaced while it was in use"));
  EXPECT_TRUE(fs::is_empty(folder / "elsewhere"));
}

TEST_F(WatchedRunTest, DeleteRejectedKeepsFileBehindLaterSymbolicLink) {
  WatchedRun run(unit, spool);
  for (const char* name : {"captures/0001/boards/a.png", "elsewhere/a.png"}) folder.file(name, "a");
  replace_by_link("captures/0001/boards");
  run.delete_rejected(StationStep::boards, "a.png");
  EXPECT_FALSE(fs::exists(folder / "moved/a.png"));
  EXPECT_TRUE(fs::exists(folder / "elsewhere/a.png"));
}

TEST_F(WatchedRunTest, RenameFinishedThrowsWhenFolderWasReplaced) {
  {
    const WatchedRun run(unit, spool);
    replace_by_link("captures/0001");
    EXPECT_THAT(rejection_message([&] { run.rename_finished(); }),
                HasSubstr("0001: was moved or replaced while it was in use"));
    EXPECT_TRUE(fs::is_symlink(run.run_folder()));
  }
  fs::remove(folder / "captures/0001");
  fs::rename(folder / "moved", folder / "captures/0001");
  const WatchedRun again(unit, spool);
  again.rename_finished();
  EXPECT_TRUE(fs::exists(folder / ("captures/0001." + again.run_id())));
}

std::vector<std::string> names(const std::vector<std::filesystem::path>& files) {
  std::vector<std::string> all;
  for (const auto& file : files) all.push_back(file.filename().string());
  return all;
}

TEST(WatchedFolder, ReportsImageOnceItsContentNoLongerChanges) {
  const TemporaryFolder folder;
  WatchedFolder watched(folder / "");
  EXPECT_THAT(watched.poll().added, IsEmpty());
  folder.file("a.png", "half");
  EXPECT_THAT(watched.poll().added, IsEmpty());
  folder.file("a.png", "the whole");
  EXPECT_THAT(watched.poll().added, IsEmpty());
  EXPECT_THAT(names(watched.poll().added), ElementsAre("a.png"));
  EXPECT_THAT(watched.poll().added, IsEmpty());
}

TEST(WatchedFolder, ReportsOverwrittenAndRemovedImages) {
  const TemporaryFolder folder;
  WatchedFolder watched(folder / "");
  folder.file("a.png", "one");
  folder.file("b.png", "two");
  watched.poll();
  EXPECT_THAT(names(watched.poll().added), ElementsAre("a.png", "b.png"));
  folder.file("a.png", "another");
  std::filesystem::remove(folder / "b.png");
  EXPECT_THAT(watched.poll().removed, ElementsAre("b.png"));
  EXPECT_THAT(names(watched.poll().added), ElementsAre("a.png"));
}

TEST(WatchedFolder, IgnoresHiddenEmptyAndNonImageFilesAndFolders) {
  const TemporaryFolder folder;
  folder.file(".a.png", "in the making");
  folder.file("captures.csv", "image\n");
  folder.file("empty.png", "");
  std::filesystem::create_directory(folder / "folder.png");
  WatchedFolder watched(folder / "");
  watched.poll();
  EXPECT_THAT(watched.poll().added, IsEmpty());
}

TEST(WatchedFolder, ReportsImagesOfFolderCreatedLater) {
  const TemporaryFolder folder;
  WatchedFolder watched(folder / "later");
  EXPECT_THAT(watched.poll().added, IsEmpty());
  std::filesystem::create_directory(folder / "later");
  folder.file("later/a.png", "image");
  watched.poll();
  EXPECT_THAT(names(watched.poll().added), ElementsAre("a.png"));
}

}  // namespace
}  // namespace vlp
