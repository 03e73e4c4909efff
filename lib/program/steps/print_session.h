// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "program/progress.h"
#include "session/session.h"

namespace vlp {

/// Log of the steps of a session: a line on stdout and the remarks on stderr when a step ends, and
/// a progress display while it runs.
class SessionLog {
 public:
  /// Returns the callbacks that write the log during one call of run_session(). They
  /// refer to this log, which must outlive the run.
  SessionObserver make_observer();

 private:
  using Clock = std::chrono::steady_clock;

  void print_step(const SessionStep& step);

  Clock::time_point step_start_;
  std::unique_ptr<Progress> progress_;
};

/// Prints the main metrics of a session, its failed gates and the verdict to stdout.
void print_session(const SessionResult& result, const std::string& results);

}  // namespace vlp
