// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "station/records/run_record.h"
#include "station/unit/unit.h"

namespace vlp {

/// Returns the images of all steps with the reasons of rejected ones.
std::vector<RunRecord::Image> list_run_images(const Unit& unit);

/// Makes the record of a unit's run with the id `run`. The current time is the end of the run.
RunRecord make_unit_record(const Unit& unit, const std::string& run, const ProgramVersion& program);

/// Makes the verdict of a run INVALID because its images are those of an earlier judged run of the
/// unit. The run would otherwise count twice. The caller has compared the images.
/// @param earlier       id of the earlier run, for the message
/// @param station_file  path of station.yaml, for the command in the message
void invalidate_reuse(RunRecord& record, const std::string& earlier,
                      const std::filesystem::path& station_file);

/// Returns the reasons why a unit does not pass, the most important one first; empty if it passes.
/// Faults of the station and of the operator precede results that depend on them. The camera
/// therefore fails by decide_verdict() only for its own errors.
std::vector<Cause> list_failure_causes(const Unit& unit);

}  // namespace vlp
