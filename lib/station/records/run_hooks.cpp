// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/run_hooks.h"

#include "rig/input_error.h"

namespace vlp {

std::string call_hook(const Hook& hook, RunRecord& record, const HookLock& lock, Spool& spool) {
  std::string problem;
  record.events.push_back(run_hook(hook, record, lock));
  try {
    spool.keep(record);
  } catch (const InputError& error) {
    problem = std::string("what became of the hook is not recorded: ") + error.what();
  }
  spool.deliver();
  return problem;
}

HookCounts run_open_hooks(
    const StationConfig& config, Spool& spool,
    const std::function<void(const RunRecord& run, const std::string& outcome)>& report) {
  const auto runs = spool.find_open_hooks(config.station);
  HookCounts result{runs.size()};
  for (const std::string& run : runs) {
    const HookLock lock(spool.folder(), run);
    auto record = spool.find(run);
    // Another program can have called it.
    if (!record || !is_hook_open(*record)) continue;
    if (!lock.held()) {
      report(*record, "is being run");
      continue;
    }
    const std::string unrecorded = call_hook(*config.hook, *record, lock, spool);
    const std::string problem = hook_problem(*record);
    if (!problem.empty()) ++result.failed;
    report(*record, problem.empty() ? "done" : problem);
    if (!unrecorded.empty()) report(*record, unrecorded);
  }
  return result;
}

}  // namespace vlp
