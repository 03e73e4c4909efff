// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <chrono>
#include <csignal>
#include <random>
#include <thread>

#include "rig/file.h"
#include "rig/samples.h"
#include "support/child_process.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

const std::string kOld = "old\n";
const std::string kLarge(300'000, 'x');

std::size_t count_in(const fs::path& folder) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), {}));
}

/// The superuser may write anywhere.
void become_nobody() {
  if (::geteuid() == 0 && ::setuid(65534) != 0) throw std::runtime_error("cannot change user");
}

TEST(WriteFile, KeepsOldFileWhenFolderIsReadOnly) {
  const TemporaryFolder folder;
  const auto file = folder.file("a.yaml", kOld);
  fs::permissions(folder / "", fs::perms(0555));
  const std::string message = thrown_in_child([&] {
    become_nobody();
    write_file(file, kLarge);
  });
  fs::permissions(folder / "", fs::perms(0755));
  EXPECT_EQ(message, file.string() + ": cannot be written: Permission denied");
  EXPECT_EQ(folder.read_content(file), kOld);
  EXPECT_EQ(count_in(folder / ""), 1U);
}

TEST(WriteFile, RemovesTemporaryFileOfKilledProcessButNotOfOthers) {
  const TemporaryFolder folder;
  const auto file = folder.file("a.yaml", kOld);
  AtomicFileWriter other(file);
  const pid_t child = ::fork();
  if (child == 0) {
    AtomicFileWriter killed(file);
    ::kill(::getpid(), SIGKILL);
  }
  ASSERT_EQ(::waitpid(child, nullptr, 0), child);
  EXPECT_EQ(count_in(folder / ""), 3U);
  write_file(file, kLarge);
  EXPECT_EQ(count_in(folder / ""), 2U);
  EXPECT_EQ(folder.read_content(file), kLarge);
  other.save_file();
  EXPECT_EQ(folder.read_content(file), "");
  EXPECT_EQ(count_in(folder / ""), 1U);
}

TEST(WriteFile, KeepsOldFileWhenSizeLimitIsExceeded) {
  const TemporaryFolder folder;
  const auto file = folder.file("a.yaml", kOld);
  const std::string message = thrown_in_child([&] {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{100'000, 100'000};
    if (::setrlimit(RLIMIT_FSIZE, &limit) != 0) throw std::runtime_error("cannot set the limit");
    write_file(file, kLarge);
  });
  EXPECT_EQ(message, file.string() + ": cannot be written: File too large");
  EXPECT_EQ(folder.read_content(file), kOld);
  EXPECT_EQ(count_in(folder / ""), 1U);
}

TEST(WriteFile, KeepsOldFileWhenDiskIsFull) {
  const TemporaryFolder folder;
  const std::string cannot_mount = "cannot mount";
  const std::string message = thrown_in_child([&] {
    // The mount exists for this process only, and ends with it.
    if (::unshare(CLONE_NEWNS) != 0 ||
        ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
        ::mount("tmpfs", (folder / "").c_str(), "tmpfs", 0, "size=64k") != 0) {
      throw std::runtime_error(cannot_mount);
    }
    const auto file = folder.file("a.yaml", kOld);
    std::string refused;
    try {
      write_file(file, kLarge);
    } catch (const InputError& error) {
      refused = error.what();
    }
    const bool kept = folder.read_content(file) == kOld && count_in(folder / "") == 1;
    throw std::runtime_error(refused + (kept ? "; kept" : "; lost"));
  });
  if (message == cannot_mount) GTEST_SKIP() << "only the superuser can mount a small disk";
  EXPECT_THAT(message, HasSubstr("a.yaml: cannot be written: No space left on device; kept"));
}

TEST(ReadLampMap, NamesFileWithoutReadPermission) {
  const TemporaryFolder folder;
  const auto file = folder.file("lamps.yaml", kLampsYaml);
  fs::permissions(file, fs::perms::none);
  const std::string message = thrown_in_child([&] {
    become_nobody();
    read_lamp_map(file);
  });
  EXPECT_EQ(message, file.string() + ": cannot be opened: Permission denied");
}

TEST(WriteFile, LeavesOldOrNewFileWhenKilled) {
  const std::string contents[] = {std::string(300'000, 'a') + "\n",
                                  std::string(200'000, 'b') + "\n"};
  const TemporaryFolder folder;
  const auto file = folder / "a.yaml";
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  for (const std::string& content : contents) write_file(file, content);
  const Clock::duration time_of_two_writes = Clock::now() - start;

  std::mt19937_64 random(5);
  int times_changed = 0;
  int times_interrupted = 0;
  std::size_t last = 1;
  for (int round = 0; round < 100; ++round) {
    int begun[2];
    ASSERT_EQ(::pipe(begun), 0);
    const pid_t child = start_child([&] {
      if (::write(begun[1], "", 1) != 1) ::_exit(1);
      for (std::size_t i = last + 1;; ++i) write_file(file, contents[i % 2]);
    });
    ::close(begun[1]);
    char sign;
    ASSERT_EQ(::read(begun[0], &sign, 1), 1);  // a busy machine may take long to start it
    ::close(begun[0]);
    std::this_thread::sleep_for(time_of_two_writes * double(random() % 1000) / 1000);
    kill_child(child);
    times_interrupted += count_in(folder / "") > 1 ? 1 : 0;  // the next write removes the file
    const std::string found = folder.read_content(file);
    ASSERT_TRUE(found == contents[0] || found == contents[1]) << found.size() << " bytes";
    const std::size_t now = found == contents[0] ? 0 : 1;
    times_changed += now != last ? 1 : 0;
    last = now;
  }
  // Otherwise nothing was tested.
  EXPECT_GT(times_changed, 0) << "no child came to write";
  EXPECT_GT(times_interrupted, 0) << "no child was killed while it wrote";
}

TEST(WriteFile, LeavesContentOfOneWriterWhenThreadsWriteConcurrently) {
  const TemporaryFolder folder;
  const auto file = folder.file("a.yaml", std::string(100'000, 'a'));
  const auto is_whole = [&] {
    const std::string found = folder.read_content(file);
    return found.size() == 100'000 && found == std::string(100'000, found.front());
  };
  std::vector<std::thread> writers;
  for (const char c : {'a', 'b', 'c', 'd'}) {
    writers.emplace_back([&file, c] {
      const std::string content(100'000, c);
      for (int i = 0; i < 50; ++i) EXPECT_NO_THROW(write_file(file, content));
    });
  }
  for (int i = 0; i < 200; ++i) EXPECT_TRUE(is_whole());
  for (std::thread& writer : writers) writer.join();
  EXPECT_TRUE(is_whole());
  EXPECT_EQ(count_in(folder / ""), 1U);
}

}  // namespace
}  // namespace vlp
