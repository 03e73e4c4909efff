// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "program/progress.h"
#include "session/session.h"

namespace vlp {

/// Tells of each step of a session as it ends: a line on stdout, and what it has to say on stderr;
/// meanwhile how far it is.
class SessionLog {
 public:
  /// For one run; the log has to live as long.
  SessionObserver observer();

 private:
  using Clock = std::chrono::steady_clock;

  void ended(const SessionStep& step);

  Clock::time_point begin_;
  std::unique_ptr<Progress> progress_;
};

/// The figures of a session that people ask for first, its gates that are not met, and the verdict,
/// on stdout.
void print_session(const SessionResult& result, const std::string& results);

}  // namespace vlp
