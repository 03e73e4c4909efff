// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace vlp {

/// Where a unit, a shift or the golden unit is measured, by whom, and from which images.
struct StationRunOptions {
  /// Without a camera it is a shift: unit after unit.
  std::string station, camera_id;
  /// Who measures, and in which shift; asked for at the beginning of a shift where it is not said.
  std::string operator_name, shift;
  /// A folder whose steps are full; empty: the folder of the station is watched.
  std::string batch;
  /// A camera or video for a step, "boards=/dev/video0"; without a step for those that have none.
  std::vector<std::string> sources;
  /// Give the verdict when no image came for so long, of a source none that could be used.
  std::optional<double> idle_s;
  int threads = 1;
};

/// vlp-station run with a camera: a unit to its verdict. Throws GateNotMet when it fails,
/// Undetermined when the run is invalid.
void run_unit(const StationRunOptions& options);

/// vlp-station verify: the golden unit, from the folder `batch` or from where its images arrive.
/// Throws GateNotMet when the station has moved, Undetermined when that is not known.
void run_verify(const StationRunOptions& options);

/// vlp-station hook: the hook again for the station's runs whose hook failed or was not run to its
/// end, of the records, when they answer, and of those that wait. Throws std::runtime_error when it
/// fails again.
void run_hooks(const StationRunOptions& options);

}  // namespace vlp
