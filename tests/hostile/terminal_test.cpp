// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Terminal whose program is stopped or ended by a key.
#include "program/station/terminal.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <pty.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <csignal>
#include <string>

namespace vlp {
namespace {

bool echoes() {
  termios settings{};
  return ::tcgetattr(STDIN_FILENO, &settings) == 0 && (settings.c_lflag & ECHO) != 0;
}

/// Waits at most ten seconds until the terminal's echo is on or off.
bool wait_for_echo(bool is_wanted) {
  constexpr useconds_t interval_us = 10'000;
  for (int i = 0; i < 1000 && echoes() != is_wanted; ++i) ::usleep(interval_us);
  return echoes() == is_wanted;
}

/// Reads keys as the station does, in the foreground of the terminal.
[[noreturn]] void read_keys() {
  const rlimit no_core{0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  ::setpgid(0, 0);
  std::signal(SIGTTOU, SIG_IGN);
  ::tcsetpgrp(STDIN_FILENO, ::getpid());
  std::signal(SIGTTOU, SIG_DFL);
  Terminal terminal;
  constexpr int wait_ms = 10;
  while (!was_interrupted()) terminal.wait_for_key(wait_ms);
  ::_exit(0);
}

/// Starts a program at the terminal like a shell, sends it signals, and writes the terminal's
/// state.
std::string stop_and_quit() {
  const pid_t program = ::fork();
  if (program == 0) read_keys();
  std::string found;
  if (wait_for_echo(false)) found += "keys ";
  int status = 0;
  ::kill(program, SIGTSTP);
  ::waitpid(program, &status, WUNTRACED);
  if (WIFSTOPPED(status) && wait_for_echo(true)) found += "stopped ";
  ::kill(program, SIGCONT);
  if (wait_for_echo(false)) found += "keys ";
  ::kill(program, SIGQUIT);
  ::waitpid(program, &status, 0);
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGQUIT && wait_for_echo(true)) found += "quit";
  return found;
}

TEST(TerminalSettings, AreRestoredWhenProgramIsStoppedOrEndedByKey) {
  int ends[2], terminal = -1;
  ASSERT_EQ(::pipe(ends), 0);
  const pid_t shell = ::forkpty(&terminal, nullptr, nullptr, nullptr);
  ASSERT_GE(shell, 0);
  if (shell == 0) {
    const std::string found = stop_and_quit();
    const bool is_written = ::write(ends[1], found.data(), found.size()) > 0;
    ::_exit(is_written ? 0 : 1);
  }
  ::close(ends[1]);
  char found[64];
  const ssize_t count = ::read(ends[0], found, sizeof found);
  ::close(ends[0]);
  ::close(terminal);
  ::waitpid(shell, nullptr, 0);
  ASSERT_GT(count, 0);
  EXPECT_EQ(std::string(found, static_cast<std::size_t>(count)), "keys stopped keys quit");
}

}  // namespace
}  // namespace vlp
