// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "captures/captures_table.h"
#include "captures/detections_table.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"

/// Causes of contradictions between lamps in captures, their map, known positions and calibration,
/// ranked by likelihood.
namespace vlp {

/// Captures of lamps in one step of a unit.
struct StepCaptures {
  /// Name of the step for messages.
  std::string step;
  std::vector<Frame> frames;
  /// Positions of captures, where they are known.
  CapturesTable positions = {};
};

enum class LampCauseKind { moved_lamp, wrong_positions, moved_camera, other_camera, other_lens };

/// Cause of contradictions, described in one line.
struct LampCause {
  LampCauseKind kind;
  std::string text;
  /// Fraction of chi^2 - f that it removes, together with the causes before it.
  double explained = 0;
};

/// Options of rank_lamp_causes().
struct CauseOptions {
  /// True if the calibration is that of another run, as of a golden unit: a tilt or displacement of
  /// the camera is then a cause. Otherwise the calibration is from these captures, and tilt and
  /// displacement common to all of them are unknown.
  bool camera_is_known = false;
  /// Smallest displacement of a lamp, projected to the image, that is a cause.
  double min_lamp_offset_px = 0.25;
  /// Standard deviation of the known positions, per axis.
  double position_sd_m = 2e-4;
};

/// Ranks causes by which captures contradict map, positions and calibration.
///
/// The residuals r of pixels and known positions, weighted by their standard deviations, are
/// linear in the unknown poses p of the captures, in the common unknowns u, and in the sizes a of a
/// cause c:
///   r = J_p p + J_u u + J_c a + noise
///   u  tilt and displacement of the camera, fx, fy, cx, cy with their covariance, positions of the
///      lamps with their sd_m
/// Causes: a displaced lamp; known positions of a step with a common displacement; a camera that
/// moved or tilted on its mount between steps; a step with another camera; another lens for the
/// lamps than for the boards.
///
/// With chi^2 the squares left by least squares, f = rows - 4 captures, and noise of a common,
/// unknown factor of at least 3, the logarithm of the likelihood is
///   -1/2 g(chi^2 / 9),   g(x) = x up to f, then f + f ln(x / f)
/// The lower bound covers errors of the lens, and of centers that were detected at another tilt.
/// The causes are ranked by its increase, less (number of sizes) / 2 ln f (Schwarz, "Estimating the
/// dimension of a model", 1978). A cause is named if the increase is above 10 and if it removes at
/// least a quarter of chi^2 - f. The test is repeated with the named causes among u. A second cause
/// is named beside the first if the increases differ by less than 3.
///
/// @return the causes, the most likely one first; empty for fewer than three captures with a fix
///     from three lamps or more
std::vector<LampCause> rank_lamp_causes(std::span<const StepCaptures> steps, const LampMap& map,
                                        const Calibration& calibration,
                                        const CauseOptions& options = {});

/// Returns true if ranked causes remove nine tenths of the contradiction. Otherwise single captures
/// with errors may be the cause.
bool is_contradiction_explained(const std::vector<LampCause>& ranked);

/// Describes a map whose lamps are swapped or mirrored, a map of another room, and a lamp that is
/// inconsistent (calibration/map/map_errors.h), one line each. Requires three captures.
std::vector<std::string> list_map_contradictions(std::span<const Frame> frames, const LampMap& map,
                                                 const Calibration& calibration);

/// Returns a message for each lamp of the map that no frame contains, one line each. Empty if all
/// lamps were detected, and for fewer than three frames.
std::vector<std::string> list_missing_lamps(std::span<const Frame> frames, const LampMap& map);

}  // namespace vlp
