// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/watched_folder.h"

#include <gmock/gmock.h>

#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

std::vector<std::string> names(const std::vector<std::filesystem::path>& files) {
  std::vector<std::string> all;
  for (const auto& file : files) all.push_back(file.filename().string());
  return all;
}

TEST(WatchedFolder, ReportsImageAfterWritingEnds) {
  const TemporaryFolder folder;
  WatchedFolder watched(folder / "");
  EXPECT_THAT(watched.poll_changes().added, IsEmpty());
  folder.file("a.png", "half");
  EXPECT_THAT(watched.poll_changes().added, IsEmpty());
  folder.file("a.png", "the whole");
  EXPECT_THAT(watched.poll_changes().added, IsEmpty());
  EXPECT_THAT(names(watched.poll_changes().added), ElementsAre("a.png"));
  EXPECT_THAT(watched.poll_changes().added, IsEmpty());
}

TEST(WatchedFolder, ReportsOverwrittenAndRemovedImages) {
  const TemporaryFolder folder;
  WatchedFolder watched(folder / "");
  folder.file("a.png", "one");
  folder.file("b.png", "two");
  watched.poll_changes();
  EXPECT_THAT(names(watched.poll_changes().added), ElementsAre("a.png", "b.png"));
  folder.file("a.png", "another");
  std::filesystem::remove(folder / "b.png");
  EXPECT_THAT(watched.poll_changes().gone, ElementsAre("b.png"));
  EXPECT_THAT(names(watched.poll_changes().added), ElementsAre("a.png"));
}

TEST(WatchedFolder, IgnoresOtherFiles) {
  const TemporaryFolder folder;
  folder.file(".a.png", "in the making");
  folder.file("captures.csv", "image\n");
  folder.file("empty.png", "");
  std::filesystem::create_directory(folder / "folder.png");
  WatchedFolder watched(folder / "");
  watched.poll_changes();
  EXPECT_THAT(watched.poll_changes().added, IsEmpty());
}

TEST(WatchedFolder, AcceptsMissingFolder) {
  const TemporaryFolder folder;
  WatchedFolder watched(folder / "later");
  EXPECT_THAT(watched.poll_changes().added, IsEmpty());
  std::filesystem::create_directory(folder / "later");
  folder.file("later/a.png", "image");
  watched.poll_changes();
  EXPECT_THAT(names(watched.poll_changes().added), ElementsAre("a.png"));
}

}  // namespace
}  // namespace vlp
