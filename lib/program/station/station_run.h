// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace vlp {

/// Options for measuring a unit, a shift of units, or the golden unit.
struct StationRunOptions {
  /// Path of the file station.yaml, and id of the camera to be measured. If `camera_id` is empty,
  /// the ids are scanned one after another (measure_scanned_units()).
  std::string station, camera_id;
  /// Name of the operator, and of the work shift; requested at the beginning of a shift if empty.
  std::string operator_name, shift;
  /// Folder with the images of all steps; empty: the folder of the station is watched.
  std::string batch;
  /// Camera or video for a step, "boards=/dev/video0"; without "STEP=": for all steps without one.
  std::vector<std::string> sources;
  /// Time without a new image after which the verdict is given, s. Unused frames of a source are
  /// ignored.
  std::optional<double> idle_s;
  int threads = 1;
};

/// Measures a unit up to its verdict (vlp-station run with a camera). Throws GateNotMet if the unit
/// fails, Undetermined if the run is invalid.
void measure_unit(const StationRunOptions& options);

/// Measures units whose ids are scanned or typed, a line each, until `q` or the end of the input
/// (vlp-station run without a camera). The id of the golden unit verifies the station.
///
/// Each unit runs in a separate process of this program on the same terminal. Memory that libraries
/// leak per unit (mrcal 2.2: about 3 MB) is released with the process, and a crash does not end the
/// shift.
void measure_scanned_units(StationRunOptions options);

/// Measures the golden unit, from the folder `batch` or the folder where its images arrive
/// (vlp-station verify). Throws GateNotMet if the station has moved, Undetermined if the run is
/// invalid.
void verify_with_golden(const StationRunOptions& options);

/// Runs the hook again for the runs of the station whose hook failed or did not finish (vlp-station
/// hook). Uses the records, if available, and the runs in the spool. Throws std::runtime_error if
/// the hook fails again.
void rerun_hooks(const StationRunOptions& options);

}  // namespace vlp
