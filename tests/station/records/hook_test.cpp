// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/hook.h"

#include <gmock/gmock.h>

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <nlohmann/json.hpp>
#include <thread>

#include "station/records/run_record.h"
#include "support/child_process.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;

RunRecord judged_run() {
  RunRecord run;
  run.run = "20261121T134501Z-0123456789abcdef";
  run.camera = "a";
  run.verdict = "PASS";
  run.metrics = {{"rms_px", "px", 0.25, 1, Direction::at_most, {}}};
  // More than a pipe holds.
  for (int i = 0; i < 2000; ++i) {
    run.images.push_back({"boards", std::to_string(i) + ".png", std::string(64, 'a'), ""});
  }
  return run;
}

class RunStationHook : public testing::Test {
 protected:
  RunEvent run(const std::string& script, double time_limit_s = 20) {
    const auto begun = std::chrono::steady_clock::now();
    RunEvent event = run_station_hook({{"sh", "-c", script}, folder / ".", time_limit_s},
                                      judged_run(), HookLock(folder / ".", judged_run().run));
    took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
    return event;
  }
  TemporaryFolder folder;
  double took_s = 0;
};

TEST_F(RunStationHook, PassesRunAsJsonOnStdinInHookFolder) {
  const RunEvent event = run("cat >seen.json; echo first; echo label 7; echo");
  EXPECT_EQ(event.kind, kHookDone);
  EXPECT_EQ(event.text, "label 7");
  const std::string seen = TemporaryFolder::read_content(folder / "seen.json");
  EXPECT_EQ(seen, format_hook_json(judged_run()));
  const auto json = nlohmann::json::parse(seen);
  EXPECT_EQ(json["verdict"], "PASS");
  EXPECT_EQ(json["metrics"]["rms_px"]["passed"], true);
}

TEST_F(RunStationHook, SucceedsIfHookIgnoresInputOrLeavesChildren) {
  EXPECT_EQ(run("exec <&-; head -c 3000000 /dev/zero | tr '\\0' '\\n'; echo end >&2").text, "end");
  // Remaining children do not delay the caller.
  EXPECT_EQ(run("sleep 10 & echo printed").text, "printed");
  EXPECT_LT(took_s, 5);
  EXPECT_EQ(run("exec >&- 2>&-; sleep 0.1").kind, kHookDone);
}

TEST_F(RunStationHook, DescribesExitCodeSignalOrStartFailure) {
  EXPECT_EQ(run("echo the printer is out of labels; exit 3").kind, kHookFailed);
  EXPECT_EQ(run("echo the printer is out of labels; exit 3").text,
            "exit code 3: the printer is out of labels");
  EXPECT_EQ(run("kill -9 $$").text, "ended by signal 9");
  EXPECT_EQ(run("printf '\\033[31m\\377'; exit 1").text, "exit code 1: \\x1b[31m\\xff");
  const RunEvent missing = run_station_hook({{"/nowhere/label"}, folder / ".", 1}, judged_run(),
                                            HookLock(folder / ".", judged_run().run));
  EXPECT_EQ(missing.kind, kHookFailed);
  EXPECT_THAT(missing.text, HasSubstr("/nowhere/label cannot be started: No such file"));
}

TEST_F(RunStationHook, KillsHookAtTimeLimitDespiteOutputFloodOrOtherProcessGroup) {
  EXPECT_EQ(run("exec cat /dev/zero", 0.3).kind, kHookFailed);
  EXPECT_LT(took_s, 5);
  const RunEvent event =
      run("exec python3 -c 'import os, time; os.setpgid(0, os.getpgid(os.getppid())); "
          "time.sleep(100)' || exit 7",
          1);
  EXPECT_EQ(event.text, "no end within 1 s, killed");
  EXPECT_LT(took_s, 5);
}

TEST_F(RunStationHook, KillsChildrenInOtherSessionsAtTimeLimit) {
  const RunEvent event = run(
      "setsid sh -c 'sleep 100 & echo $! >child'; setsid sleep 100 & echo $! >other; sleep 100", 1);
  EXPECT_EQ(event.text, "no end within 1 s, killed");
  EXPECT_LT(took_s, 5);
  for (const char* name : {"child", "other"}) {
    std::string process = TemporaryFolder::read_content(folder / name);
    ASSERT_FALSE(process.empty());
    process.pop_back();
    EXPECT_FALSE(std::filesystem::exists("/proc/" + process)) << name;
  }
}

/// The hook of a killed station continues, and is not run a second time meanwhile.
TEST_F(RunStationHook, HookKeepsLockWhenStationIsKilled) {
  const std::string name = judged_run().run;
  const pid_t station = start_child([&] {
    run_station_hook(
        {{"sh", "-c", "touch begun; until [ -e end ]; do sleep 0.02; done"}, folder / ".", 20},
        judged_run(), HookLock(folder / ".", name));
  });
  const auto wait_for = [](const auto& is) {
    for (int i = 0; i < 1000 && !is(); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return is();
  };
  ASSERT_TRUE(wait_for([&] { return std::filesystem::exists(folder / "begun"); }));
  kill_child(station);
  EXPECT_FALSE(HookLock(folder / ".", name).is_holding());
  folder.file("end", "");
  EXPECT_TRUE(wait_for([&] { return HookLock(folder / ".", name).is_holding(); }));
}

/// The parent of this program can ignore signals and leave files open.
TEST_F(RunStationHook, HookInheritsNoIgnoredSignalsOrOpenFiles) {
  std::signal(SIGCHLD, SIG_IGN);
  EXPECT_EQ(run("exit 3").text, "exit code 3");
  const auto interrupt = std::signal(SIGINT, SIG_IGN), pipe = std::signal(SIGPIPE, SIG_IGN);
  const int open = ::open("/dev/null", O_RDONLY), far = ::fcntl(open, F_DUPFD, 57);
  EXPECT_EQ(run("kill -INT $$").text, "ended by signal 2");
  EXPECT_EQ(run("kill -PIPE $$").text, "ended by signal 13");
  EXPECT_EQ(run("test ! -e /proc/self/fd/" + std::to_string(far)).kind, kHookDone);
  ::close(open);
  ::close(far);
  std::signal(SIGINT, interrupt);
  std::signal(SIGPIPE, pipe);
}

TEST_F(RunStationHook, IsHookPendingUntilRequestedHookSucceeds) {
  RunRecord run = judged_run();
  EXPECT_FALSE(is_hook_pending(run));
  EXPECT_EQ(describe_pending_hook(run), "");
  run.events.push_back(make_requested_event({{"label", "it"}, {}, 1}, "Ann"));
  EXPECT_EQ(run.events.back().text, "label it");
  EXPECT_THAT(run.events.back().author, testing::MatchesRegex("Ann [(][^@]+@[^@]*[)]"));
  EXPECT_TRUE(is_hook_pending(run));
  EXPECT_EQ(describe_pending_hook(run), "was not run to its end");
  run.events.push_back(make_run_event_now(kHookFailed, "exit code 3"));
  EXPECT_EQ(describe_pending_hook(run), "failed: exit code 3");
  run.events.push_back(make_run_event_now(kHookDone, ""));
  EXPECT_FALSE(is_hook_pending(run));
  EXPECT_EQ(describe_pending_hook(run), "");
  // Requested again for a voided run.
  run.events.push_back(make_run_event_now(kHookRequested, "label it"));
  EXPECT_TRUE(is_hook_pending(run));
  EXPECT_EQ(describe_pending_hook(run), "was not run to its end");
  run.events.push_back(make_run_event_now(kHookDone, ""));
  EXPECT_FALSE(is_hook_pending(run));
}

TEST_F(RunStationHook, SecondHookLockOfSameRunIsNotAcquired) {
  const std::string name = judged_run().run;
  {
    const HookLock first_lock(folder / ".", name), other(folder / ".", name);
    EXPECT_TRUE(first_lock.is_holding());
    EXPECT_FALSE(other.is_holding());
    EXPECT_TRUE(HookLock(folder / ".", "another").is_holding());
  }
  EXPECT_TRUE(HookLock(folder / ".", name).is_holding());
  EXPECT_TRUE(std::filesystem::is_empty(folder / "."));
}

TEST(HookLock, CreatesNoFileThroughSymbolicLink) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "spool");
  std::filesystem::create_symlink(folder / "elsewhere", folder / "spool/.hook-run");
  EXPECT_LT(HookLock(folder / "spool", "run").descriptor(), 0);
  EXPECT_LT(HookLock(folder / "spool", "/../../elsewhere").descriptor(), 0);
  EXPECT_FALSE(std::filesystem::exists(folder / "elsewhere"));
}

}  // namespace
}  // namespace vlp
