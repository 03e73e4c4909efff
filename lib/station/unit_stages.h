// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "captures/captures_table.h"
#include "captures/detections_table.h"
#include "detection/boards/detect_boards.h"
#include "evaluation/gnuplot.h"
#include "rig/calibration.h"
#include "station/station_config.h"
#include "station/station_figures.h"

namespace vlp {

/// What a step of the station comes to. Each step takes what the one before gave.
struct StageResult {
  /// Why there is no result, for people; empty when there is one.
  std::string problem;
  /// With the step's part, but for its history.
  Calibration calibration = {};
  std::vector<NamedValue> values = {};
  /// Makes its picture for the report, later; may be empty.
  std::function<Drawing()> drawing = {};
};

/// The lens from views of the board, and how far it can be trusted.
StageResult solve_boards(const StationConfig& config, const std::string& camera_id,
                         const std::vector<BoardView>& views);

/// Rotation centre and tilt from a turn on the spot.
StageResult solve_rotation(const StationConfig& config, const Calibration& calibration,
                           const std::vector<Frame>& frames);

/// What fixes at a known station still lack. Places: those of captures.csv, or of the config. There
/// is a problem when fewer captures than the station wants have one.
StageResult solve_dispersion(const StationConfig& config, const Calibration& calibration,
                             const std::vector<Frame>& frames, const CapturesTable& places);

/// Fixes at known points. Captures without a place are not counted; there is a problem when fewer
/// than the station wants have one.
StageResult check_fixes(const StationConfig& config, const Calibration& calibration,
                        const std::vector<Frame>& frames, const CapturesTable& places);

}  // namespace vlp
