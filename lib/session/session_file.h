// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "session/session.h"

namespace vlp {

/// `session.json`, for programs: format "vlp-session/1". Objects: verdict ("pass", "gate",
/// "no result"), reason, failure ("none", "bad_input", "undetermined", ...), camera, version,
/// metrics (each with step, name, value, unit where it has a MetricKind, and where it is a gate
/// limit, asked, met), steps (each with name, warnings, notes, skipped images with reasons, lamps
/// left out with their numbers of captures, offsets of each lamp as the others see it), calibration
/// (focal length, centre, tilt, lever arm, dispersion, in the unit that the key ends in; zenith_deg
/// is the zenith's x/z and y/z; standard deviations, _sd_, are of the step's captures alone, but
/// that of the zenith, which has the lens's part), history (inputs with their digests). It is
/// written last: without it the results are of a run that was killed. The same run gives the same
/// bytes.
std::string session_json(const SessionResult& result, const SessionOptions& options);

/// `junit.xml`, for CI systems: a test for each step with its warnings, then one for each gate. A
/// step without a result is an error of the type SessionResult::failure, with its message; a
/// session that cannot be read is an error of a test named "session".
std::string session_junit(const SessionResult& result);

}  // namespace vlp
