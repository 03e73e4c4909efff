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

/// Images of a board and the known properties of the camera.
struct LensInput {
  /// Observations of the board in the images, one per image. Rejected images are not used but
  /// reported as skipped.
  Observations observations;
  Board board;
  std::filesystem::path board_file;
  /// Id, lens model, row time, readout and pixel pitch; imager and intrinsics are estimated.
  Camera camera;
  /// Every n-th view is held out of the solve for validation (LensViews); 0: none.
  int held_out = 0;
  WarpChoice warp = WarpChoice::automatic;
  bool choose_lens_model = false;
};

/// Result of run_lens_step().
struct LensResult : StepResult {
  LensEstimate lens;
};

/// Estimates the lens from images of a board, with its uncertainty (estimate_lens()).
/// Warnings and skipped images include those of the intake. Metrics: collect_lens_metrics().
/// Failures: wrong_board, undetermined. Throws std::invalid_argument as BoardLattice does.
LensResult run_lens_step(LensInput input, HistoryEntry entry);

/// Returns the metrics rms_px, expected_max_error_px, coverage, views and board_tilt_deg, and if
/// available
///
///   split_half_px                       if both halves of the views could be solved
///   board_print_px                      for a board with print_sd
///   mtf50, mtf50_worst_ratio, mtf50_asymmetry, black_ratio, local_loss, local_shadow
///                                       from the edges of AprilTags
std::vector<Metric> collect_lens_metrics(const LensEstimate& lens);

/// Returns the default limits of collect_lens_metrics(), chosen from rendered and real boards of
/// 800 to 4000 px.
///
///   rms_px <= 1                  larger: blurred images or the wrong lens model
///   expected_max_error_px <= 2   larger: too few views, or too similar ones
///   split_half_px <= 1           larger: too few views, or too similar ones
///   coverage >= 0.4, views >= 6, board_tilt_deg >= 20
///
/// The last three require a tilted board in several places over most of the image, which the
/// metrics of the fit do not check.
std::vector<Gate> make_lens_gates();

}  // namespace vlp
