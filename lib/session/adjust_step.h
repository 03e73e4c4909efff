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

/// Captures of one folder, with the rows of their captures.csv.
struct AdjustSet {
  std::string name;
  std::vector<Frame> frames;
  CapturesTable captures;
  /// True if the captures that name no pivot (Capture::pivot) were taken during one rotation in
  /// place. They are then grouped by height, as in RotationCaptures. False: each of them has a
  /// position of its own.
  bool is_in_place_rotation = false;
};

/// Replaces the names of sets that share one name by their paths, because a pivot is identified by
/// the name of its set. `paths` are in the order of `sets`. Throws std::invalid_argument if a path
/// occurs twice.
void make_set_names_unique(std::vector<AdjustSet>& sets, const std::vector<std::string>& paths);

/// Input of run_adjust_step().
struct AdjustStepInput {
  std::vector<AdjustSet> sets;
  LampMap lamps;
  std::filesystem::path lamps_file;
  Calibration calibration;
  std::filesystem::path calibration_file;
  /// Standard deviations per axis, m, for lamps and for known positions without one of their own;
  /// std::nullopt: none.
  std::optional<double> map_sd_m, position_sd_m;
  /// Standard deviation of a lens without a covariance
  /// (make_intrinsics_covariance()). std::nullopt: such a lens is exact.
  std::optional<double> lens_sd_px = {};
  /// Motion of captures without velocity and yaw rate in captures.csv, and the standard deviation
  /// of the yaw rates in captures.csv (find_motion()).
  std::optional<KnownMotion> motion = {};
  double yaw_rate_sd_rad_per_s = 0;
  /// Keeps the covariance and the lamps of the refined map; otherwise those of the surveyed map.
  bool refine_map = false;
};

/// Result of run_adjust_step().
struct AdjustStepResult : StepResult {
  AdjustmentResult adjustment;
};

/// Adjusts the captures of all sets jointly (calibration/adjustment).
///
/// Metrics: tilt_deg, and lever_arm_mm if the lever arm is known. Failures: undetermined,
/// wrong_map. Warns of moved lamps, of places and of a lens that contradict the captures, and of
/// residuals larger than sigma_px explains. Places without a standard deviation are ignored with a
/// warning.
///
/// @throws InputError if a lamp has no standard deviation; if a place has a standard deviation of
///     0; if lens_sd_px is given for a lens with a covariance; if the calibration is adjusted
///     already
/// @throws std::invalid_argument if the camera moves and its calibration lacks row_time_s or
/// readout
AdjustStepResult run_adjust_step(const AdjustStepInput& input, HistoryEntry entry);

}  // namespace vlp
