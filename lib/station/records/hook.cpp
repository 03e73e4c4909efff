// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/hook.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <system_error>
#include <thread>
#include <vector>

#include "captures/printable.h"
#include "captures/shared_folder.h"
#include "rig/input_error.h"
#include "station/records/run_record.h"

namespace vlp {
namespace {

using Clock = std::chrono::steady_clock;

class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() { close(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  int get() const { return number_; }
  void close() {
    if (number_ >= 0) ::close(number_);
    number_ = -1;
  }

 private:
  int number_;
};

/// Returns the child processes of this process; empty if /proc is not readable.
std::vector<pid_t> list_children() {
  std::vector<pid_t> found;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator("/proc", none)) {
    const std::string name = entry.path().filename().string();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    std::string stat;
    std::getline(std::ifstream(entry.path() / "stat"), stat);
    // PID (NAME) STATE PARENT; NAME can contain any character.
    std::istringstream after_name(stat.substr(std::min(stat.size(), stat.rfind(')') + 1)));
    std::string state;
    pid_t parent = 0;
    if (after_name >> state >> parent && parent == ::getpid()) found.push_back(std::stoi(name));
  }
  return found;
}

/// Adopts orphaned descendants of this process in place of init while it exists. A hook's processes
/// therefore cannot evade the time limit by an own group or session.
class Subreaper {
 public:
  Subreaper() : before_(list_children()) { ::prctl(PR_SET_CHILD_SUBREAPER, 1); }
  ~Subreaper() { ::prctl(PR_SET_CHILD_SUBREAPER, 0); }
  Subreaper(const Subreaper&) = delete;
  Subreaper& operator=(const Subreaper&) = delete;

  /// Kills the new children, and the orphans that they leave.
  void kill_process_tree() const {
    constexpr int tries = 100;
    for (int i = 0; i < tries; ++i) {
      bool any = false;
      for (const pid_t child : list_children()) {
        if (std::find(before_.begin(), before_.end(), child) != before_.end()) continue;
        any = true;
        ::kill(child, SIGKILL);
        ::waitpid(child, nullptr, WNOHANG);
      }
      if (!any) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }

 private:
  std::vector<pid_t> before_;
};

/// Process in its own group, with its output and its exit status.
struct Process {
  pid_t id;
  int output;
  /// End of the output.
  std::string written = {};
  bool closed = false;

  /// Reads at most the capacity of a pipe, so that a permanently full pipe does not delay the time
  /// limit.
  void read() {
    constexpr std::size_t max_bytes = 4096;
    constexpr int parts = 16;
    std::array<char, max_bytes> part{};
    for (int i = 0; i < parts; ++i) {
      const ssize_t count = ::read(output, part.data(), part.size());
      closed = closed || count == 0;
      if (count <= 0) return;
      written.append(part.data(), static_cast<std::size_t>(count));
      if (written.size() > max_bytes) written.erase(0, written.size() - max_bytes);
    }
  }
  /// Waits for the process. Returns its status; std::nullopt if it was killed at the time limit.
  /// Throws std::system_error if the status is not available.
  std::optional<int> wait_for_process(double time_limit_s) {
    constexpr int interval_ms = 10;
    const auto start = Clock::now();
    int status = 0;
    for (;;) {
      const pid_t ended = ::waitpid(id, &status, WNOHANG);
      if (ended == id) break;
      if (ended < 0 && errno != EINTR) throw std::system_error(errno, std::generic_category());
      if (std::chrono::duration<double>(Clock::now() - start).count() > time_limit_s) {
        ::kill(-id, SIGKILL);
        ::kill(id, SIGKILL);  // it can have left its group
        while (::waitpid(id, &status, 0) < 0 && errno == EINTR) continue;
        return std::nullopt;
      }
      pollfd ready{output, POLLIN, 0};
      if (closed) {
        std::this_thread::sleep_for(std::chrono::milliseconds(interval_ms));
      } else if (::poll(&ready, 1, interval_ms) > 0) {
        read();
      }
    }
    read();  // not to its end: a remaining child can hold the pipe
    return status;
  }
};

/// Returns an anonymous file with the text, open at its beginning; negative, with errno, on
/// failure.
int make_memory_file(const std::string& text) {
  const int file = ::memfd_create("run", MFD_CLOEXEC);
  if (file < 0) return file;
  // Memory is written as a whole, or is exhausted: signals do not interrupt it.
  if (::write(file, text.data(), text.size()) != static_cast<ssize_t>(text.size())) {
    ::close(file);
    errno = ENOSPC;
    return -1;
  }
  ::lseek(file, 0, SEEK_SET);
  return file;
}

/// Starts the hook in its own group, with no other descriptor than the lock's and default signal
/// handling. Returns an errno on failure, otherwise 0.
int start_process(const Hook& hook, int input, int output, int lock, pid_t& id) {
  posix_spawn_file_actions_t actions;
  posix_spawnattr_t attributes;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawnattr_init(&attributes);
  ::posix_spawn_file_actions_adddup2(&actions, input, STDIN_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, output, STDOUT_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, output, STDERR_FILENO);
  int first_closed = STDERR_FILENO + 1;
  if (lock >= 0) ::posix_spawn_file_actions_adddup2(&actions, lock, first_closed++);
  ::posix_spawn_file_actions_addclosefrom_np(&actions, first_closed);
  ::posix_spawn_file_actions_addchdir_np(&actions, hook.folder.c_str());
  ::posix_spawnattr_setflags(
      &attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSIGMASK);
  ::posix_spawnattr_setpgroup(&attributes, 0);
  sigset_t signals;
  ::sigemptyset(&signals);
  ::posix_spawnattr_setsigmask(&attributes, &signals);
  for (const int each : {SIGPIPE, SIGCHLD, SIGINT, SIGHUP}) ::sigaddset(&signals, each);
  ::posix_spawnattr_setsigdefault(&attributes, &signals);
  std::vector<char*> arguments;
  for (const std::string& word : hook.command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  const int error =
      ::posix_spawnp(&id, arguments[0], &actions, &attributes, arguments.data(), environ);
  ::posix_spawnattr_destroy(&attributes);
  ::posix_spawn_file_actions_destroy(&actions);
  return error;
}

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
  std::array<int, 2> pipe{};
  const Descriptor input(make_memory_file(format_hook_json(record)));
  if (input.get() < 0 || ::pipe2(pipe.data(), O_CLOEXEC) != 0) {
    return make_failed_event("cannot be started: " + std::generic_category().message(errno));
  }
  const Descriptor from(pipe[0]);
  Descriptor to(pipe[1]);
  ::fcntl(from.get(), F_SETFL, O_NONBLOCK);
  Process process{0, from.get()};
  std::signal(SIGCHLD, SIG_DFL);  // if SIGCHLD is ignored, no status is available
  const Subreaper subreaper;
  if (const int error = start_process(hook, input.get(), to.get(), lock.descriptor(), process.id);
      error != 0) {
    return make_failed_event(hook.command.front() +
                             " cannot be started: " + std::generic_category().message(error));
  }
  to.close();
  std::optional<int> status;
  try {
    status = process.wait_for_process(hook.time_limit_s);
  } catch (const std::system_error& error) {
    return make_failed_event("its exit code is unknown: " + error.code().message());
  }
  if (!status) subreaper.kill_process_tree();
  const std::string line = get_last_line(process.written);
  if (status && WIFEXITED(*status) && WEXITSTATUS(*status) == 0)
    return make_run_event_now(kHookDone, line);
  std::string why;
  if (!status) {
    // [STATION-9] `s, killed`
    why = fmt::format("no end within {:g} s, killed", hook.time_limit_s);
  } else if (WIFEXITED(*status)) {
    why = fmt::format("exit code {}", WEXITSTATUS(*status));
  } else {
    why = fmt::format("ended by signal {}", WTERMSIG(*status));
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
