// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "station/records/run_record.h"
#include "station/station_config.h"

namespace vlp {

/// The trail's entry that a run's hook is to be run, which is kept together with the run: a hook
/// that never came to its end is known by it.
RunEvent hook_wanted(const Hook& hook, const std::string& operator_name);

/// Whether a hook was wanted for a run, at its verdict or when it was voided, and has not been done
/// since.
bool hook_is_open(const RunRecord& record);
/// Why a hook is open, for people in one line; empty when it is not.
std::string hook_problem(const RunRecord& record);

/// The right to run the hook of a run, among the programs that share a spool: file .hook-RUN there.
/// Where that cannot be written, there is none to share.
class HookLock {
 public:
  HookLock(const std::filesystem::path& spool, const std::string& run);
  ~HookLock();
  HookLock(const HookLock&) = delete;
  HookLock& operator=(const HookLock&) = delete;

  /// Whether no other program runs it now.
  bool held() const { return held_; }
  /// Who has it holds the lock; negative where there is none.
  int descriptor() const { return descriptor_; }

 private:
  std::filesystem::path file_;
  int descriptor_ = -1;
  bool held_ = true;
};

/// Runs the hook with hook_json() of the run on its stdin. Whatever becomes of it is what the event
/// tells: kHookDone with the last line that it wrote, kHookFailed with exit code, signal or time
/// limit before that line, or why it could not be started. Takes no longer than the time limit, at
/// which it is killed with all that it has started, those that left its group too, unless they run
/// as another user. It has the lock's descriptor, 3: when this program is killed, nobody else runs
/// the hook before it has ended. Sets SIGCHLD to its default.
RunEvent run_hook(const Hook& hook, const RunRecord& record, const HookLock& lock);

}  // namespace vlp
