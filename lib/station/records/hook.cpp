// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/hook.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstddef>
#include <filesystem>

#include "captures/child_process.h"
#include "captures/printable.h"
#include "captures/shared_folder.h"
#include "rig/input_error.h"
#include "station/records/run_record.h"

namespace vlp {
namespace {

/// Returns the last non-empty line, shortened.
std::string get_last_line(std::string text) {
  constexpr std::size_t max_bytes = 200;
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back())) != 0) {
    text.pop_back();
  }
  text.erase(0, text.rfind('\n') + 1);  // npos + 1 is 0
  text = escape_for_terminal(text);
  std::replace(text.begin(), text.end(), '\t', ' ');
  return escape_for_terminal(text.substr(0, max_bytes));
}

RunEvent make_failed_event(const std::string& why) { return make_run_event_now(kHookFailed, why); }

/// Returns true if the open file is still the one of this name.
bool is_same_file(int descriptor, const std::filesystem::path& file) {
  struct stat open {
  }, named{};
  return ::fstat(descriptor, &open) == 0 && ::stat(file.c_str(), &named) == 0 &&
         open.st_dev == named.st_dev && open.st_ino == named.st_ino;
}

}  // namespace

RunEvent make_requested_event(const Hook& hook, const std::string& operator_name) {
  return make_run_event_now(kHookRequested,
                            escape_for_line(fmt::format("{}", fmt::join(hook.command, " "))),
                            operator_name);
}

RunEvent run_station_hook(const Hook& hook, const RunRecord& record, const HookLock& lock) {
  constexpr std::size_t max_output_bytes = 4096;
  const ChildResult child = run_child({.words = hook.command,
                                       .input = format_hook_json(record),
                                       .folder = hook.folder,
                                       .time_limit_s = hook.time_limit_s,
                                       .max_output_bytes = max_output_bytes,
                                       .has_stderr = true,
                                       .descriptor = lock.descriptor(),
                                       .kills_descendants = true});
  if (!child.start_error.empty())
    return make_failed_event(hook.command.front() + " cannot be started: " + child.start_error);
  if (!child.status_error.empty())
    return make_failed_event("its exit code is unknown: " + child.status_error);
  const std::string line = get_last_line(child.output);
  if (child.has_succeeded()) return make_run_event_now(kHookDone, line);
  std::string why;
  if (!child.status) {
    // [STATION-9] `s, killed`
    why = fmt::format("no end within {:g} s, killed", hook.time_limit_s);
  } else if (WIFEXITED(*child.status)) {
    why = fmt::format("exit code {}", WEXITSTATUS(*child.status));
  } else {
    why = fmt::format("ended by signal {}", WTERMSIG(*child.status));
  }
  return make_failed_event(line.empty() ? why : why.append(": ").append(line));
}

bool is_hook_pending(const RunRecord& record) {
  return get_last_event_index(record, kHookRequested) > get_last_event_index(record, kHookDone);
}

std::string describe_pending_hook(const RunRecord& record) {
  if (!is_hook_pending(record)) return "";
  const std::ptrdiff_t failed = get_last_event_index(record, kHookFailed);
  // [STATION-9] `not run to its end` | station ended, error, or `time_limit_s` exceeded |
  //   `vlp-station show RUN`, then `vlp-station hook`
  if (failed < get_last_event_index(record, kHookRequested)) return "was not run to its end";
  return "failed: " + record.events[static_cast<std::size_t>(failed)].text;
}

std::string run_and_record_hook(const Hook& hook, RunRecord& record, const HookLock& lock,
                                Spool& spool) {
  std::string problem;
  record.events.push_back(run_station_hook(hook, record, lock));
  try {
    spool.store_run(record);
  } catch (const InputError& error) {
    // [STATION-9] `hook is not recorded`
    problem = std::string("the result of the hook is not recorded: ") + error.what();
  }
  spool.deliver_waiting();
  return problem;
}

HookLock::HookLock(const std::filesystem::path& spool, const std::string& run)
    : file_(spool / (".hook-" + run)) {
  for (;;) {
    try {
      descriptor_ = SharedFolder(spool).open_regular_file(".hook-" + run, O_CREAT | O_RDWR);
    } catch (const InputError&) {  // no folder, or no regular file: no shared lock
      descriptor_ = -1;
    }
    if (descriptor_ < 0) return;
    // On a file system without locks no other program holds one.
    held_ = ::flock(descriptor_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK;
    // The previous holder can have removed the file.
    if (!held_ || is_same_file(descriptor_, file_)) return;
    ::close(descriptor_);
  }
}

HookLock::~HookLock() {
  if (descriptor_ < 0) return;
  if (held_) ::unlink(file_.c_str());
  ::close(descriptor_);
}

}  // namespace vlp
