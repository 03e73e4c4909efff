// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "station/records/run_record.h"
#include "station/station_config.h"

namespace vlp {

/// Time at which the state of the golden unit is checked (describe_golden_problem()): at the
/// first image of a unit, or at its verdict.
enum class GoldenCheckTime { first_image, verdict };

/// Returns the human-readable reason why no unit may pass now; empty if units may. Always empty
/// without `verify_due`.
///
/// Reasons: the golden unit
/// - failed,
/// - is due (StationConfig::verification_interval),
/// - was measured with another measuring setup (hash_settings()),
/// - was never measured here.
///
/// The function uses only the note of record_golden_run() in the station's spool,
/// because the records may be offline. The golden unit is due, too, if the clock was set back or
/// the note is damaged.
///
/// GoldenCheckTime::verdict ignores limits of hours and units that expired after the unit was
/// started. At its start the golden unit met `verify_due`, and a repetition would give no further
/// information. A failed golden unit and a changed setup count at both times.
std::string describe_golden_problem(const StationConfig& config,
                                    GoldenCheckTime at = GoldenCheckTime::first_image);

/// Notes a run in the spool: the result of a golden unit, or one more judged unit. Ignores INVALID
/// runs, and all runs without `verify_due`.
///
/// File .golden-DIGEST, with a digest of the station's name: run, verdict and end of the golden run
/// and the hash_settings(), then a line for each later unit. Throws
/// InputError if the file cannot be written. The note is then deleted, so that the golden unit is
/// due.
void record_golden_run(const StationConfig& config, const RunRecord& record);

/// Deletes the note if it is of the golden run `run`, which is no longer valid; the golden unit is
/// then due. Returns true if it was.
bool delete_golden_note(const StationConfig& config, const std::string& run);

}  // namespace vlp
