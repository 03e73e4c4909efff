// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "station/records/hook.h"
#include "station/records/spool.h"

namespace vlp {

/// Runs the hook of a stored run and records the result as another event of the run. Returns the
/// reason why the event is not recorded; empty if it is. The verdict is valid without the event.
std::string call_hook(const Hook& hook, RunRecord& record, const HookLock& lock, Spool& spool);

struct HookCounts {
  std::size_t runs = 0, failed = 0;
};
/// Runs the open hooks of the station's runs again, sequentially. Calls `report` with each result,
/// with the reason why it is not recorded, or with a note that another program is running the hook.
/// Precondition: the station has a hook.
HookCounts run_open_hooks(
    const StationConfig& config, Spool& spool,
    const std::function<void(const RunRecord& run, const std::string& outcome)>& report);

}  // namespace vlp
