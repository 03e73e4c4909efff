// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "station/records/hook.h"
#include "station/records/spool.h"

namespace vlp {

/// Runs the hook of a run that is kept, and keeps what became of it, as another event of the run.
/// Why that is not recorded; empty when it is. A verdict is a verdict without it.
std::string call_hook(const Hook& hook, RunRecord& record, const HookLock& lock, Spool& spool);

struct HooksRun {
  std::size_t runs = 0, failed = 0;
};
/// Runs the hooks of the station's runs again that have not ended well, one after the other, and
/// tells what became of each, why that is not recorded, or that another program runs it now.
/// Precondition: the station has a hook.
HooksRun run_open_hooks(
    const StationConfig& config, Spool& spool,
    const std::function<void(const RunRecord& run, const std::string& outcome)>& tell);

}  // namespace vlp
