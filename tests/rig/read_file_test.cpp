// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include "rig/file.h"
#include "rig/samples.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

std::string read_refusal(const fs::path& file, std::size_t max_bytes = 100) {
  return refusal([&](const fs::path& path) { (void)read_file(path, max_bytes); }, file);
}

TEST(ReadFile, ReturnsAllBytesUpToLimit) {
  const TemporaryFolder folder;
  for (const std::size_t bytes : {0U, 1U, 99U, 100U}) {
    const std::string content(bytes, '\0');
    EXPECT_EQ(read_file(folder.file("a", content), 100), content);
  }
  const std::string large(300'000, 'x');
  EXPECT_EQ(read_file(folder.file("a", large), large.size()), large);
}

TEST(ReadFile, RejectsFileLongerThanLimit) {
  const TemporaryFolder folder;
  const auto file = folder.file("a", std::string(101, 'x'));
  EXPECT_EQ(read_refusal(file), "a: is longer than 100 bytes: is it the right file?");
  fs::resize_file(file, std::uintmax_t{3} << 30);
  EXPECT_EQ(read_refusal(file, 5 << 20), "a: is longer than 5 MiB: is it the right file?");
}

TEST(ReadFile, RejectsPipesDevicesFoldersAndBrokenLinks) {
  const TemporaryFolder folder;
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  fs::create_symlink("/dev/zero", folder / "device");
  fs::create_symlink("/dev/stdin", folder / "stdin");
  fs::create_symlink("loop", folder / "loop");
  const std::string not_a_file = ": is a pipe or a device, not a file";
  EXPECT_EQ(read_refusal(folder / "pipe"), "pipe" + not_a_file);
  EXPECT_EQ(read_refusal(folder / "device"), "device" + not_a_file);
  EXPECT_EQ(read_refusal(folder / ""), ": is a folder, not a file");
  EXPECT_EQ(read_refusal(folder / "loop"),
            "loop: cannot be opened: Too many levels of symbolic links");
  EXPECT_EQ(read_refusal(folder / "none"), "none: cannot be opened: No such file or directory");
}

TEST(ReadFile, ReadsPipeGivenAsDevFd) {
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  const std::string name = "/dev/fd/" + std::to_string(ends[0]);
  ASSERT_EQ(::write(ends[1], "0123456789", 10), 10);
  ::close(ends[1]);
  EXPECT_EQ(read_file(name, 10), "0123456789");
  ::close(ends[0]);
}

TEST(ReadFile, RejectsSymbolicLinkInDevShmToPipe) {
  const fs::path link = "/dev/shm/vlp-test-" + std::to_string(::getpid());
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  ASSERT_EQ(::write(ends[1], "0123456789", 10), 10);
  ::close(ends[1]);
  const std::string stream = "/proc/self/fd/" + std::to_string(ends[0]);
  std::error_code error;
  fs::create_symlink(stream, link, error);
  if (error) GTEST_SKIP() << link << ": " << error.message();
  EXPECT_THAT(read_refusal(link), testing::HasSubstr("is a pipe or a device, not a file"));
  fs::remove(link);
  EXPECT_EQ(read_file("/proc/" + std::to_string(::getpid()) + "/fd/" + std::to_string(ends[0]), 10),
            "0123456789");
  ::close(ends[0]);
}

TEST(ReadFile, RejectsPipeLongerThanLimit) {
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  const std::string name = "/dev/fd/" + std::to_string(ends[0]);
  ASSERT_EQ(::write(ends[1], "0123456789", 10), 10);
  ::close(ends[1]);
  EXPECT_THAT(read_refusal(name, 9), testing::HasSubstr("is longer than 9 bytes"));
  ::close(ends[0]);
}

}  // namespace
}  // namespace vlp
