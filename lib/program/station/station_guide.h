// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "program/station/station_run.h"
#include "program/station/terminal.h"
#include "station/unit/step_sources.h"

namespace vlp {

/// Takes a unit's images as they come and guides the operator, until the unit is done, or hopeless,
/// or the operator wants the verdict. Throws std::runtime_error when the operator leaves.
void guide_unit(const StationRunOptions& options, Unit& unit, WatchedRun& watched,
                StepSources& sources, Spool& spool, Terminal& terminal);

}  // namespace vlp
