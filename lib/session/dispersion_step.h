// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibration/dispersion/dispersion.h"
#include "captures/captures_table.h"
#include "session/rotation_step.h"

namespace vlp {

/// Captures with a known position, as input of run_dispersion_step().
struct KnownPositions {
  std::vector<ReferencePointCapture> captures;
  /// Point whose position is known, the camera or the axis of rotation, for each capture, in the
  /// order of `captures`.
  std::vector<MeasuredPoint> measured_points = {};
  /// Number of captures without a known position; they are not in `captures`.
  std::size_t captures_without_position = 0;
};

/// Collects the captures at known places, with the inclinations of the table. A place is that of
/// the table, or `place_m` of the point `measured_point` for captures without one in the table.
KnownPositions collect_known_captures(std::span<const Frame> frames, const CapturesTable& table,
                                      const std::optional<Eigen::Vector2d>& place_m = {},
                                      MeasuredPoint measured_point = MeasuredPoint::camera);

/// Returns a result that fails with wrong_place if no capture has a known position, or if fewer
/// than `required` have one and others have none.
StepResult check_known_positions(std::size_t known, std::size_t captures, int required = 1);

/// Result of run_dispersion_step().
struct DispersionResult : StepResult {
  DispersionFit fit;
};

/// Estimates the dispersion offset, the remaining heading-dependent error of fixes, from captures
/// at known places. Propagates the errors of lens, zenith and lever arm into the result.
///
/// Places of the axis are moved to the camera by the calibration's lever arm and the yaw of the
/// fix; without a lever arm the result is undetermined. Warns of an offset that equals the lever
/// arm, which results if places of the axis are labeled as places of the camera.
///
/// Metrics: dispersion_mm, dispersion_offset_px, and world_offset_mm if the world offset is known.
/// Failures: wrong_map, wrong_place, undetermined.
/// @pre at least one capture
DispersionResult run_dispersion_step(const LampCaptures& input, const KnownPositions& places,
                                     DispersionMethod method, DispersionCircle circle,
                                     HistoryEntry entry);

}  // namespace vlp
