// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calibration/adjustment/adjustment.h"
#include "captures/captures_table.h"
#include "captures/detections_table.h"
#include "session/step_result.h"

namespace vlp {

/// Captures that were taken together, and what is known of them.
struct AdjustSet {
  std::string name;
  std::vector<Frame> frames;
  CapturesTable captures;
  /// Those without a `spot` are a turn on the spot; heights are told apart as SpotCaptures does.
  bool turn = false;
};

/// Gives sets of one name the paths that they were given by: a spot is one of its set. Throws
/// std::invalid_argument for a path that stands twice.
void name_apart(std::vector<AdjustSet>& sets, const std::vector<std::string>& paths);

struct AdjustStepInput {
  std::vector<AdjustSet> sets;
  LampMap lamps;
  std::filesystem::path lamps_file;
  Calibration calibration;
  std::filesystem::path calibration_file;
  /// Of lamps, and of places, that state none.
  std::optional<double> map_sd_m, place_sd_m;
  /// Of a lens that states none: stated_lens_covariance(); without it such a lens is exact.
  std::optional<double> lens_sd_px = {};
  /// How cameras move, and turn, whose captures.csv has no velocity; the latter's standard
  /// deviation of the yaw rate (motion_of()).
  std::optional<KnownMotion> motion = {};
  double yaw_rate_sd_rad_per_s = 0;
  /// The covariance that is kept is that of the refined map, else that of the map as surveyed.
  bool refine_map = false;
};

struct AdjustStepResult : StepResult {
  AdjustmentResult found;
};

/// One adjustment of all sets (calibration/adjustment). Metrics: tilt_deg, and where it is known
/// lever_arm_mm. undetermined, wrong_map. Warns of lamps that have moved, of places and of a lens
/// that the captures contradict, of residuals that sigma_px does not explain. Throws InputError
/// when a lamp or a place states no standard deviation, when the lens states one and lens_sd_px
/// does, too, or the calibration is adjusted already; std::invalid_argument when a camera moves
/// whose calibration lacks row_time_s or readout.
AdjustStepResult solve_adjustment(const AdjustStepInput& input, HistoryEntry entry);

}  // namespace vlp
