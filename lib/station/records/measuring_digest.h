// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "station/station_config.h"

namespace vlp {

/// Computes the SHA-256 of the parsed configuration that affects measurements and verdicts.
///
///   included  camera type, board, lamp map, position, completion and rejection limits, gates with
///             guard bands, golden unit
///   excluded  name of the station, `verify_due`, serials, folders, records, spool, hook, retention
///
/// Format, comments, order and names of files do not change it.
std::string measuring_digest(const StationConfig& config);

}  // namespace vlp
