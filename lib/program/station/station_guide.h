// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "program/station/station_run.h"
#include "program/station/terminal.h"
#include "station/unit/step_sources.h"

namespace vlp {

/// Processes the images of a unit as they arrive and guides the operator. Returns when the unit is
/// complete or cannot pass any more, the frames end, no image arrives for options.idle_s, or the
/// operator requests the verdict. Throws std::runtime_error if the operator leaves.
void guide_unit(const StationRunOptions& options, Unit& unit, WatchedRun& watched,
                StepSources& sources, Spool& spool, Terminal& terminal);

}  // namespace vlp
