// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <exception>
#include <iostream>
#include <string>
#include <vector>

namespace vlp {

/// Starts a child process that runs `action` and exits, with 1 if it throws. Returns its id.
template <typename Action>
pid_t start_child(Action action) {
  const pid_t child = ::fork();
  if (child != 0) return child;
  try {
    action();
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    ::_exit(1);
  } catch (...) {
    ::_exit(1);
  }
  ::_exit(0);
}

/// Waits until a child has ended. Returns its status; 0 for success.
inline int wait_for_child(pid_t child) {
  int status = 0;
  ::waitpid(child, &status, 0);
  return status;
}

/// Waits until all children have ended. Returns true if all succeeded.
inline bool end_well(const std::vector<pid_t>& children) {
  bool well = true;
  for (const pid_t child : children) well = wait_for_child(child) == 0 && well;
  return well;
}

/// Kills a child with SIGKILL, which it cannot handle, and waits until it has ended.
inline void kill_child(pid_t child) {
  ::kill(child, SIGKILL);
  wait_for_child(child);
}

/// Runs `action` in a child process, for changes of the process: its user, limits or mounts.
/// Returns the message of its exception; "" if it does not throw.
template <typename Action>
std::string thrown_in_child(Action action) {
  int channel[2];
  if (::pipe(channel) != 0) return "no pipe";
  const pid_t child = start_child([&] {
    std::string message;
    try {
      action();
    } catch (const std::exception& error) {
      message = error.what();
    }
    if (::write(channel[1], message.data(), message.size()) < 0) ::_exit(1);
  });
  ::close(channel[1]);
  std::string message;
  char block[4096];
  for (ssize_t size; (size = ::read(channel[0], block, sizeof block)) > 0;) {
    message.append(block, static_cast<std::size_t>(size));
  }
  ::close(channel[0]);
  return wait_for_child(child) == 0 ? message : "the child did not end well";
}

}  // namespace vlp
