// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <gmock/gmock.h>
#include <grp.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "rig/file.h"
#include "rig/samples.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;

std::string write_refusal(const fs::path& file) {
  return refusal([](const fs::path& path) { write_file(path, "new\n"); }, file);
}

std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.push_back(entry.path().filename());
  std::sort(names.begin(), names.end());
  return names;
}

TEST(WriteFile, ReplacesWholeContentOfExistingFile) {
  const TemporaryFolder folder;
  const auto file = folder.file("a.yaml", "old content that is longer\n");
  write_file(file, "new\n");
  EXPECT_EQ(folder.read_content(file), "new\n");
  const std::string with_zeros("\0\xff\n", 3);
  write_file(file, with_zeros);
  EXPECT_EQ(folder.read_content(file), with_zeros);
  write_file(file, "");
  EXPECT_EQ(folder.read_content(file), "");
  EXPECT_THAT(names_in(folder / ""), ElementsAre("a.yaml"));
}

TEST(WriteFile, CreatesFileWithPermissionsOfUmask) {
  const TemporaryFolder folder;
  const mode_t before = ::umask(027);
  write_file(folder / "a.yaml", "new\n");
  ::umask(before);
  EXPECT_EQ(fs::status(folder / "a.yaml").permissions(), fs::perms(0640));
}

TEST(WriteFile, KeepsPermissionsOfReplacedFile) {
  const TemporaryFolder folder;
  const auto file = folder.file("a.yaml", "old\n");
  for (const fs::perms mode : {fs::perms(0600), fs::perms(0664), fs::perms(0444)}) {
    fs::permissions(file, mode);
    write_file(file, "new\n");
    EXPECT_EQ(fs::status(file).permissions(), mode);
  }
  fs::create_symlink("a.yaml", folder / "link");
  write_file(folder / "link", "new\n");
  EXPECT_EQ(fs::status(file).permissions(), fs::perms(0444));
}

TEST(WriteFile, KeepsOwnerAndGroupOfReplacedFile) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root gives files away";
  const TemporaryFolder folder;
  const auto file = folder.file("a.yaml", "old\n");
  constexpr uid_t owner = 12345;
  constexpr gid_t group = 12346;
  ASSERT_EQ(::chown(file.c_str(), owner, group), 0);
  fs::permissions(file, fs::perms(0640));
  write_file(file, "new\n");
  struct stat found {};
  ASSERT_EQ(::stat(file.c_str(), &found), 0);
  EXPECT_EQ(found.st_uid, owner);
  EXPECT_EQ(found.st_gid, group);
  EXPECT_EQ(fs::status(file).permissions(), fs::perms(0640));
}

/// Replaces a file of user 12345 and group 12346 as another user, a member of these groups, and
/// returns its permissions.
mode_t mode_after_another_user(const TemporaryFolder& folder, const std::vector<gid_t>& groups) {
  constexpr uid_t owner = 12345, writer = 23456;
  constexpr gid_t group = 12346;
  fs::permissions(folder / "", fs::perms::all);
  const auto file = folder.file("a.yaml", "old\n");
  EXPECT_EQ(::chown(file.c_str(), owner, group), 0);
  fs::permissions(file, fs::perms(0664));
  const pid_t child = ::fork();
  if (child == 0) {
    if (::chdir((folder / "").c_str()) != 0 || ::setgroups(groups.size(), groups.data()) != 0 ||
        ::setgid(writer) != 0 || ::setuid(writer) != 0) {
      ::_exit(1);
    }
    write_file("a.yaml", "new\n");
    ::_exit(0);
  }
  int status = -1;
  ::waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(TemporaryFolder::read_content(file), "new\n");
  struct stat found {};
  EXPECT_EQ(::stat(file.c_str(), &found), 0);
  EXPECT_EQ(found.st_uid, writer);
  EXPECT_EQ(found.st_gid, groups.empty() ? writer : group);
  return found.st_mode & 0777;
}

TEST(WriteFile, RemovesGroupPermissionsWhenGroupCannotBeKept) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root acts as another user";
  const TemporaryFolder folder;
  EXPECT_EQ(mode_after_another_user(folder, {12346}), mode_t{0664});
  EXPECT_EQ(mode_after_another_user(folder, {}), mode_t{0604});
}

TEST(WriteFile, AppendsToStreamGivenAsDevFd) {
  const TemporaryFolder folder;
  const auto file = folder.file("log", "old\n");
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  ASSERT_GE(descriptor, 0);
  write_file("/dev/fd/" + std::to_string(descriptor), "new\n");
  write_file("/proc/self/fd/" + std::to_string(descriptor), "newer\n");
  ::close(descriptor);
  EXPECT_EQ(folder.read_content(file), "old\nnew\nnewer\n");
}

TEST(WriteFile, AcceptsFileNameWithoutFolder) {
  const TemporaryFolder folder;
  const fs::path before = fs::current_path();
  fs::current_path(folder / "");
  write_file("a.yaml", "new\n");
  fs::current_path(before);
  EXPECT_THAT(names_in(folder / ""), ElementsAre("a.yaml"));
}

TEST(WriteFile, AcceptsNameOf255Characters) {
  const TemporaryFolder folder;
  const std::string name(255, 'x');
  write_file(folder / name, "new\n");
  EXPECT_THAT(names_in(folder / ""), ElementsAre(name));
}

TEST(WriteFile, LeavesNoFileWhenWritingFails) {
  const TemporaryFolder folder;
  const auto file = folder.file("file", "old\n");
  fs::create_directory(folder / "folder");
  const std::string cannot = " cannot be written: ";
  EXPECT_EQ(write_refusal(folder / "missing" / "a.yaml"),
            "a.yaml:" + cannot + "No such file or directory");
  EXPECT_EQ(write_refusal(folder / "folder"), "folder:" + cannot + "Is a directory");
  EXPECT_EQ(write_refusal(file / "a.yaml"), "a.yaml:" + cannot + "Not a directory");
  const std::string too_long(256, 'x');
  EXPECT_EQ(write_refusal(folder / too_long), too_long + ":" + cannot + "File name too long");
  EXPECT_NE(write_refusal(""), "");
  EXPECT_THAT(names_in(folder / ""), ElementsAre("file", "folder"));
  EXPECT_THAT(names_in(folder / "folder"), ElementsAre());
  EXPECT_EQ(folder.read_content(file), "old\n");
}

TEST(WriteFile, ReplacesTargetOfSymbolicLink) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "real");
  const auto file = folder.file("real/a.yaml", "old\n");
  fs::create_symlink("real/a.yaml", folder / "relative");
  fs::create_symlink(file, folder / "absolute");
  fs::create_symlink("relative", folder / "of_a_link");
  fs::create_symlink("real", folder / "folder");
  int number = 0;
  for (const std::string name : {"relative", "absolute", "of_a_link", "folder/a.yaml"}) {
    const std::string content = std::to_string(++number) + "\n";
    write_file(folder / name, content);
    EXPECT_EQ(folder.read_content(file), content) << name;
  }
  EXPECT_TRUE(fs::is_symlink(folder / "relative") && fs::is_symlink(folder / "absolute") &&
              fs::is_symlink(folder / "of_a_link") && fs::is_symlink(folder / "folder"));
  EXPECT_THAT(names_in(folder / "real"), ElementsAre("a.yaml"));
}

TEST(WriteFile, CreatesMissingTargetOfSymbolicLink) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "real");
  fs::create_symlink("real/new.yaml", folder / "link");
  write_file(folder / "link", "new\n");
  EXPECT_TRUE(fs::is_symlink(folder / "link"));
  EXPECT_EQ(folder.read_content(folder / "real/new.yaml"), "new\n");
}

TEST(WriteFile, RejectsCircularSymbolicLinks) {
  const TemporaryFolder folder;
  fs::create_symlink("b", folder / "a");
  fs::create_symlink("a", folder / "b");
  EXPECT_EQ(write_refusal(folder / "a"), "a: is a link that leads to itself");
  EXPECT_TRUE(fs::is_symlink(folder / "a") && fs::is_symlink(folder / "b"));
}

TEST(WriteFile, DoesNotReplaceDeviceFiles) {
  write_file("/dev/null", "new\n");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  EXPECT_EQ(write_refusal("/dev/full"), "full: cannot be written: No space left on device");
  EXPECT_TRUE(fs::is_character_file("/dev/full"));
}

TEST(WriteFile, WritesToNamedPipeWithoutReplacingIt) {
  const TemporaryFolder folder;
  const fs::path pipe = folder / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const int reader = ::open(pipe.c_str(), O_RDONLY | O_NONBLOCK);
  ASSERT_GE(reader, 0);
  write_file(pipe, "new\n");
  char found[16];
  const ssize_t size = ::read(reader, found, sizeof found);
  ::close(reader);
  EXPECT_EQ(std::string(found, static_cast<std::size_t>(std::max<ssize_t>(size, 0))), "new\n");
  EXPECT_TRUE(fs::is_fifo(pipe));
  EXPECT_THAT(names_in(folder / ""), ElementsAre("pipe"));
}

}  // namespace
}  // namespace vlp
