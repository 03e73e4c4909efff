// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace vlp {

struct StationRunOptions {
  std::string station, camera_id;
  /// A folder whose steps are full; empty: the folder of the station is watched.
  std::string batch;
  /// A camera or video for a step, "boards=/dev/video0"; without a step for those that have none.
  std::vector<std::string> sources;
  /// Give the verdict when no image came for so long, of a source none that could be used.
  std::optional<double> idle_s;
  int threads = 1;
};

/// vlp-station run: a unit to its verdict. Throws GateNotMet when it fails, Undetermined when the
/// run is invalid.
void run_unit(const StationRunOptions& options);

/// vlp-station verify: the golden unit, from the folder `batch` or from where its images arrive.
/// Throws GateNotMet when the station has moved, Undetermined when that is not known.
void run_verify(const StationRunOptions& options);

}  // namespace vlp
