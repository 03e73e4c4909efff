// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/shared_folder.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

Id id(const std::string& text) { return {text, "test", "camera"}; }

class SharedFolderTest : public testing::Test {
 protected:
  SharedFolderTest() { fs::create_directory(folder / "shared"); }

  const TemporaryFolder folder;
  const fs::path path = folder / "shared";
  const fs::path outside = folder.file("outside.txt", "mine");
};

TEST_F(SharedFolderTest, WritesReadsRenamesAndRemovesFiles) {
  const SharedFolder shared(path);
  EXPECT_FALSE(shared.contains("a"));
  EXPECT_EQ(shared.read_if_exists("a", 10), std::nullopt);
  shared.replace_file("a", "first");
  shared.replace_file("a", "second");
  EXPECT_EQ(shared.read_if_exists("a", 6), "second");
  EXPECT_THAT(rejection_message([&] { shared.read_if_exists("a", 5); }),
              HasSubstr("a: is longer than 5 bytes"));
  EXPECT_TRUE(shared.rename_file("a", "b"));
  EXPECT_FALSE(shared.rename_file("a", "b"));
  EXPECT_EQ(shared.read_if_exists("b", 10), "second");
  shared.remove_file("b");
  shared.remove_file("b");
  EXPECT_FALSE(shared.contains("b"));
  EXPECT_TRUE(fs::is_empty(path)) << "no temporary file is left";
}

TEST_F(SharedFolderTest, CreatesAndOpensSubfolders) {
  const SharedFolder shared(path);
  EXPECT_FALSE(shared.open_if_exists(id("0001")));
  shared.open_or_create(id("0001")).replace_file("a", "a");
  const auto found = shared.open_if_exists(id("0001"));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->folder_path(), path / "0001");
  EXPECT_EQ(found->read_if_exists("a", 1), "a");
  shared.replace_file("file", "");
  EXPECT_THAT(rejection_message([&] { shared.open_or_create(id("file")); }),
              HasSubstr("file: cannot be"));
  EXPECT_THAT(rejection_message([&] { SharedFolder(path / "file"); }),
              HasSubstr("cannot be opened"));
}

TEST_F(SharedFolderTest, NeverFollowsSymbolicLinks) {
  fs::create_symlink(outside, path / "link");
  fs::create_directory_symlink(folder / "", path / "folder");
  const SharedFolder shared(path);
  const auto expect_refused = [](const auto& action) {
    EXPECT_THAT(rejection_message(action), HasSubstr("is a symbolic link, which is not followed"));
  };
  expect_refused([&] { shared.read_if_exists("link", 100); });
  expect_refused([&] { shared.open_regular_file("link", O_CREAT | O_RDWR); });
  expect_refused([&] { shared.open_if_exists(id("folder")); });
  expect_refused([&] { shared.open_or_create(id("folder")); });
  EXPECT_TRUE(shared.contains("link"));
  shared.replace_file("link", "ours");
  EXPECT_EQ(shared.read_if_exists("link", 100), "ours");
  fs::remove(path / "link");
  fs::create_symlink(outside, path / "link");
  shared.remove_file("link");
  EXPECT_EQ(TemporaryFolder::read_content(outside), "mine");
}

TEST_F(SharedFolderTest, ThrowsForNamesThatLeaveFolder) {
  const SharedFolder shared(path);
  for (const std::string& name :
       {std::string(), std::string("."), std::string(".."), std::string("../outside.txt"),
        outside.string(), std::string("a\0b", 3)}) {
    const auto expect_refused = [&](const auto& action) {
      EXPECT_THAT(rejection_message(action), HasSubstr("is no name of a file in it")) << name;
    };
    expect_refused([&] { shared.contains(name); });
    expect_refused([&] { shared.read_if_exists(name, 100); });
    expect_refused([&] { shared.replace_file(name, "x"); });
    expect_refused([&] { shared.open_regular_file(name, O_RDONLY); });
    expect_refused([&] { shared.rename_file(name, "a"); });
    expect_refused([&] { shared.rename_file("a", name); });
    expect_refused([&] { shared.remove_file(name); });
  }
  EXPECT_EQ(TemporaryFolder::read_content(outside), "mine");
}

TEST_F(SharedFolderTest, RemoveAllClearsOpenedFolderAfterItsRename) {
  fs::create_directories(folder / "elsewhere/kept");
  fs::create_directories(path / "sub");
  folder.file("shared/sub/file", "");
  fs::create_directory_symlink(folder / "elsewhere", path / "link");
  const SharedFolder shared(path);
  fs::rename(path, folder / "moved");
  fs::create_directory_symlink(folder / "elsewhere", path);
  shared.remove_all();
  EXPECT_TRUE(fs::is_empty(folder / "moved"));
  EXPECT_TRUE(fs::exists(folder / "elsewhere/kept"));
}

TEST_F(SharedFolderTest, ThrowsWhenOpeningPipeOrReadingFolder) {
  ASSERT_EQ(::mkfifo((path / "pipe").c_str(), 0600), 0);
  const SharedFolder shared(path);
  for (const int flags : {O_RDONLY, O_WRONLY, O_RDWR}) {
    EXPECT_THAT(rejection_message([&] { shared.open_regular_file("pipe", flags); }),
                HasSubstr("is no regular file"));
  }
  fs::create_directory(path / "folder");
  EXPECT_THAT(rejection_message([&] { shared.read_if_exists("folder", 10); }),
              HasSubstr("is no regular file"));
}

TEST_F(SharedFolderTest, ReplaceFileKeepsModeAndOwner) {
  const SharedFolder shared(path);
  shared.replace_file("a", "first");
  ASSERT_EQ(::chmod((path / "a").c_str(), 0640), 0);
  const bool is_root = ::geteuid() == 0;
  constexpr uid_t other = 12345;
  if (is_root) {
    ASSERT_EQ(::chown((path / "a").c_str(), other, other), 0);
  }
  shared.replace_file("a", "second");
  struct stat status {};
  ASSERT_EQ(::stat((path / "a").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0640U);
  if (is_root) {
    EXPECT_EQ(status.st_uid, other);
  }
  EXPECT_EQ(shared.read_if_exists("a", 10), "second");
}

std::string error_message(const std::string& text) {
  return rejection_message<std::runtime_error>([&] { check_json_limits(text); });
}

TEST(CheckJsonLimits, Accepts16LevelsAndOneMillionValues) {
  EXPECT_EQ(error_message(""), "");
  EXPECT_EQ(error_message(std::string(16, '[') + std::string(16, ']')), "");
  EXPECT_EQ(error_message("[" + std::string(999'999, ',') + "]"), "");
}

TEST(CheckJsonLimits, ThrowsAbove16LevelsOrOneMillionValues) {
  EXPECT_THAT(error_message(std::string(17, '[')), HasSubstr("more than 16 levels"));
  EXPECT_THAT(error_message(R"({"a":)" + std::string(16, '{')), HasSubstr("more than 16 levels"));
  EXPECT_THAT(error_message("[" + std::string(1'000'000, ',')), HasSubstr("more than a million"));
}

TEST(CheckJsonLimits, IgnoresBracketsAndCommasInStrings) {
  EXPECT_EQ(error_message("\"" + std::string(100, '[') + std::string(2'000'000, ',') + "\""), "");
  EXPECT_EQ(error_message(R"("\"[[[[[[[[[[[[[[[[[[")"), "");
  EXPECT_THAT(error_message(R"("\\")" + std::string(17, '[')), HasSubstr("levels"));
}

}  // namespace
}  // namespace vlp
