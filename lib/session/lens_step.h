// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "calibration/intrinsics/lens_estimate.h"
#include "evaluation/gate.h"
#include "frontend/observation.h"
#include "rig/board.h"
#include "session/step_result.h"

namespace vlp {

/// Images of a board and what is known of the camera.
struct LensInput {
  /// Those that are not rejected are used.
  Observations seen;
  Board board;
  std::filesystem::path board_file;
  /// Id, lens model, row time, readout and pixel pitch; imager and intrinsics are estimated.
  Camera camera;
  /// As in LensViews.
  int held_out = 0;
  WarpChoice warp = WarpChoice::automatic;
  bool choose_lens_model = false;
};

struct LensResult : StepResult {
  LensEstimate lens;
};

/// Estimates the lens from images of a board, with its uncertainty (estimate_lens()).
/// Warnings and skipped images include those of the intake. Metrics: lens_metrics().
/// Failures: wrong_board, undetermined. Throws std::invalid_argument as BoardLattice does.
LensResult solve_lens(LensInput input, HistoryEntry entry);

/// Returns rms_px, uncertainty_px, halves_px, coverage, views, board_tilt_deg; board_print_px of a
/// board with print_sd; with the edges of
/// AprilTags mtf50, mtf50_worst_ratio, mtf50_asymmetry, black_ratio, local_loss, local_shadow.
std::vector<Metric> lens_metrics(const LensEstimate& lens);

/// Returns the limits of the metrics unless others are stated, from rendered and real boards of 800
/// to 4000 px. rms_px above 1: blurred images or the wrong lens model. uncertainty_px above 2 or
/// halves_px above 1: too few views, or too similar ones. The others ask that the board was seen in
/// most of the image, in several places, and tilted, which no metric of the fit shows.
std::vector<Gate> lens_gates();

}  // namespace vlp
