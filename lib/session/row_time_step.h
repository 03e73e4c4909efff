// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "frontend/labeled_lights.h"
#include "frontend/lamp_intake.h"
#include "frontend/options.h"
#include "lamps/signal/row_time.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"
#include "session/step_result.h"

namespace vlp {

/// Lights in folders of images, not identified as lamps.
struct DetectedLights {
  /// Observations of each folder.
  std::vector<Observations> folders;
  DetectorCamera camera;
};

/// Detects the lights in the images of each folder without identifying lamps. `calibration`
/// supplies the lens and the readout direction if it has them. If `with_row_time` is false, its row
/// time is ignored. Throws InputError if no image can be read.
DetectedLights detect_lights(const std::vector<std::filesystem::path>& folders,
                             const LampMap& lamps, const std::optional<Calibration>& calibration,
                             bool with_row_time, const FrontendOptions& options,
                             const IntakeProgress& progress = {});

/// Adds the remarks of all folders to the result of a step, see add_remarks().
void add_remarks(const DetectedLights& seen, StepResult& result);

/// Chooses a row time by periods and duty cycles of the lights in the images of each folder. Also
/// uses their positions if several row times fit (compute_position_costs()).
///
/// @param labels  lights of each folder that are lamps; empty: all lights
RowTimeResult choose_row_time_by_places(const std::vector<const std::vector<Observation>*>& folders,
                                        const std::vector<std::vector<Frame>>& labels,
                                        const LampMap& lamps, const std::optional<Lens>& lens);

/// Result of find_row_time().
struct RowTimeStepResult : StepResult {
  RowTime found{};
};

/// Estimates the row time from lamps with a frequency in the map (estimate_row_time()). If several
/// row times explain their periods, chooses by their positions (compute_position_costs()). Adds row
/// time and readout direction to the camera of `calibration`, if given, and warns if it states
/// another row time (compare_row_times()). Failure: undetermined. Throws InputError if no lamp has
/// a frequency.
RowTimeStepResult find_row_time(const DetectedLights& seen,
                                const std::vector<std::vector<Frame>>& labels, const LampMap& lamps,
                                const std::filesystem::path& lamps_file,
                                const std::optional<Calibration>& calibration, HistoryEntry entry);

}  // namespace vlp
