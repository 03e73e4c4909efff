// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/child_process.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <fstream>
#include <sstream>
#include <system_error>
#include <thread>
#include <utility>

namespace vlp {
namespace {

using Clock = std::chrono::steady_clock;

std::string describe_errno(int error) { return std::generic_category().message(error); }

/// File descriptor that is closed at the end of its scope.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() { close(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  int number() const { return number_; }
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

/// Adopts orphaned descendants of this process in place of init while it exists. They therefore
/// cannot evade the time limit by an own group or session.
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
  std::size_t max_output_bytes;
  /// End of the output.
  std::string written = {};
  bool closed = false;

  /// Reads at most the capacity of a pipe, so that a permanently full pipe does not delay the time
  /// limit.
  void read() {
    constexpr int parts = 16;
    std::array<char, 4096> part{};
    for (int i = 0; i < parts; ++i) {
      const ssize_t count = ::read(output, part.data(), part.size());
      closed = closed || count == 0;
      if (count <= 0) return;
      written.append(part.data(), static_cast<std::size_t>(count));
      if (written.size() > max_output_bytes) written.erase(0, written.size() - max_output_bytes);
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
  const int file = ::memfd_create("input", MFD_CLOEXEC);
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

/// Starts the program. Returns an errno on failure, otherwise 0.
int start_process(const ChildCommand& command, int input, int output, pid_t& id) {
  posix_spawn_file_actions_t actions;
  posix_spawnattr_t attributes;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawnattr_init(&attributes);
  ::posix_spawn_file_actions_adddup2(&actions, input, STDIN_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, output, STDOUT_FILENO);
  if (command.has_stderr) {
    ::posix_spawn_file_actions_adddup2(&actions, output, STDERR_FILENO);
  } else {
    ::posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  }
  int first_closed = STDERR_FILENO + 1;
  if (command.descriptor >= 0)
    ::posix_spawn_file_actions_adddup2(&actions, command.descriptor, first_closed++);
  ::posix_spawn_file_actions_addclosefrom_np(&actions, first_closed);
  if (!command.folder.empty())
    ::posix_spawn_file_actions_addchdir_np(&actions, command.folder.c_str());
  ::posix_spawnattr_setflags(
      &attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSIGMASK);
  ::posix_spawnattr_setpgroup(&attributes, 0);
  sigset_t signals;
  ::sigemptyset(&signals);
  ::posix_spawnattr_setsigmask(&attributes, &signals);
  for (const int each : {SIGPIPE, SIGCHLD, SIGINT, SIGHUP}) ::sigaddset(&signals, each);
  ::posix_spawnattr_setsigdefault(&attributes, &signals);
  std::vector<char*> arguments;
  for (const std::string& word : command.words)
    arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  const int error =
      ::posix_spawnp(&id, arguments[0], &actions, &attributes, arguments.data(), environ);
  ::posix_spawnattr_destroy(&attributes);
  ::posix_spawn_file_actions_destroy(&actions);
  return error;
}

}  // namespace

bool ChildResult::has_succeeded() const {
  return status && WIFEXITED(*status) && WEXITSTATUS(*status) == 0;
}

ChildResult run_child(const ChildCommand& command) {
  std::array<int, 2> pipe{};
  const Descriptor input(make_memory_file(command.input));
  if (input.number() < 0 || ::pipe2(pipe.data(), O_CLOEXEC) != 0)
    return {.start_error = describe_errno(errno)};
  const Descriptor from(pipe[0]);
  Descriptor to(pipe[1]);
  ::fcntl(from.number(), F_SETFL, O_NONBLOCK);
  Process process{0, from.number(), command.max_output_bytes};
  std::signal(SIGCHLD, SIG_DFL);  // if SIGCHLD is ignored, no status is available
  std::optional<Subreaper> subreaper;
  if (command.kills_descendants) subreaper.emplace();
  if (const int error = start_process(command, input.number(), to.number(), process.id); error != 0)
    return {.start_error = describe_errno(error)};
  to.close();
  ChildResult result;
  try {
    result.status = process.wait_for_process(command.time_limit_s);
    if (!result.status && subreaper) subreaper->kill_process_tree();
  } catch (const std::system_error& error) {
    result.status_error = error.code().message();
  }
  result.output = std::move(process.written);
  return result;
}

}  // namespace vlp
