// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "detection/labelled_lights.h"
#include "lamps/signal/row_time.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"
#include "session/step_result.h"

namespace vlp {

/// The lights that flicker in folders of images.
struct SeenLights : StepResult {
  /// As many as folders.
  std::vector<std::vector<ImageLights>> folders;
  DetectorCamera camera;
};

/// The lights of each folder's images, whatever their lamps. `calibration` gives lens and read-out
/// where they are known; `readout` goes before it. Throws InputError when no image can be used.
SeenLights see_lights(const std::vector<std::filesystem::path>& folders, const LampMap& lamps,
                      const std::optional<Calibration>& calibration,
                      const std::optional<Readout>& readout, bool with_row_time, int threads,
                      const StepProgress& progress = {});

struct RowTimeStepResult : StepResult {
  RowTime found{};
};

/// Finds the row time from lamps whose frequencies the map knows (estimate_row_time()) and, where
/// several row times explain their periods, from their places (compute_position_costs()). It
/// completes the camera of `calibration`, where there is one.
/// Throws InputError when no lamp has a frequency. undetermined.
RowTimeStepResult find_row_time(const SeenLights& seen,
                                const std::vector<std::vector<Frame>>& labels, const LampMap& lamps,
                                const std::filesystem::path& lamps_file,
                                const std::optional<Calibration>& calibration, HistoryEntry entry);

}  // namespace vlp
