// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "station/station_config.h"

namespace vlp {

/// SHA-256 of what of a station measures and decides, as it was read: camera type, board, lamp map,
/// the station's place, what is enough, what is refused, gates with their guard bands, the golden
/// unit. Two files that say the same have the same, however they are written, commented, ordered
/// and named. Not in it is what measures nothing: the station's name, when the golden unit is due,
/// serials, folders, records, spool, hook, retention.
std::string measuring_digest(const StationConfig& config);

}  // namespace vlp
