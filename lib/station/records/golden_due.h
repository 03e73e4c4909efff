// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "station/records/run_record.h"
#include "station/station_config.h"

namespace vlp {

/// When it is asked whether the golden unit is due.
enum class GoldenAt { first_image, verdict };

/// Why no unit may pass now, for people: the golden unit failed, is due
/// (StationConfig::verify_due), was measured with something else that measures
/// (measuring_digest()), or never here; empty when units may. Of what note_for_golden() has noted
/// in the station's spool, whatever the records say, which may be away. A clock that was set back
/// makes it due, a damaged note too.
/// Of a unit that was begun when nothing stood against it, hours and units that ran out since do
/// not count at its verdict: it was measured as soon after the golden unit as `verify_due` asks,
/// and to do it again would tell nothing more. What tells against the station does: that the golden
/// unit failed, or that something that measures was changed.
std::string golden_problem(const StationConfig& config, GoldenAt at = GoldenAt::first_image);

/// Notes a run: of the golden unit that it passed or failed, of a unit that was judged that it is
/// one more. An INVALID run is neither. File .golden-DIGEST of the station's name: run, verdict and
/// end of the golden unit and the measuring_digest(), then a line for each unit since.
/// Throws InputError when it cannot be noted; then there is no note any more, and the golden unit
/// is due. Without `verify_due` nothing is noted.
void note_for_golden(const StationConfig& config, const RunRecord& record);

/// Of a golden run that counts no more: when it is the one that is noted, the golden unit is due.
bool forget_golden(const StationConfig& config, const std::string& run);

}  // namespace vlp
