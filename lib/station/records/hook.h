// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "station/records/run_record.h"
#include "station/records/spool.h"
#include "station/station_config.h"

namespace vlp {

/// Makes the event that a hook is to run, which is recorded together with the run. It identifies
/// hooks that did not finish.
RunEvent make_requested_event(const Hook& hook, const std::string& operator_name);

/// Returns true if a hook of the run still has to run: it was requested at the verdict or at the
/// voiding, and has not succeeded since. Decided from the events of the record.
bool is_hook_pending(const RunRecord& record);
/// Returns the human-readable reason why a hook is open, in one line; empty if it is not open.
std::string describe_pending_hook(const RunRecord& record);

/// Lock for the hook of a run among the programs that share a spool: file .hook-RUN in the spool.
/// If the file cannot be written, no lock is needed, because the spool is not shared.
class HookLock {
 public:
  HookLock(const std::filesystem::path& spool, const std::string& run);
  ~HookLock();
  HookLock(const HookLock&) = delete;
  HookLock& operator=(const HookLock&) = delete;

  /// Returns true unless another program is running the hook.
  bool is_holding() const { return held_; }
  /// Returns the file descriptor of the lock; negative if there is no lock file. A process that has
  /// the descriptor holds the lock.
  int descriptor() const { return descriptor_; }

 private:
  std::filesystem::path file_;
  int descriptor_ = -1;
  bool held_ = true;
};

/// Runs the hook with format_hook_json() of the run on its stdin, and returns the event of its
/// result. Sets SIGCHLD to its default.
///
///   kHookDone    the last line of its output
///   kHookFailed  exit code, signal or time limit, then the last line of its output; or the reason
///                why it could not be started
///
/// At the time limit the hook is killed with all processes that it has started. That includes
/// processes that left its group, but not those of another user. The hook inherits the lock's
/// descriptor as 3. If this program is killed, no other program runs the hook until it has ended.
RunEvent run_station_hook(const Hook& hook, const RunRecord& record, const HookLock& lock);

/// Runs the hook of a stored run and records the result as another event of the run. Returns the
/// reason why the event is not recorded; empty if it is. The verdict is valid without the event.
std::string run_and_record_hook(const Hook& hook, RunRecord& record, const HookLock& lock,
                                Spool& spool);

}  // namespace vlp
