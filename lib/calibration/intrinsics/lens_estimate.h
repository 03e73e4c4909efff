// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration/intrinsics/calibration_report.h"
#include "calibration/intrinsics/intrinsics.h"
#include "calibration/intrinsics/lens_choice.h"
#include "calibration/intrinsics/lens_sharpness.h"
#include "calibration/intrinsics/model_uncertainty.h"
#include "detection/boards/board_detector.h"
#include "rig/board.h"

namespace vlp {

/// Views of a board from which a lens is estimated.
struct LensViews {
  /// Detections of the board, one per image, in different poses; at least one. Each has enough
  /// corners to determine a pose (BoardLattice::can_determine_pose()).
  std::vector<BoardView> views;
  Board board;
  LensModel lens_model = LensModel::opencv8;
  /// Every n-th view is held out of the solve for validation; 0: none.
  int held_out = 0;
  WarpChoice warp = WarpChoice::automatic;
  /// Selects the lens model by cross-validation (select_lens_model()) instead of `lens_model`.
  bool choose_lens_model = false;
};

enum class LensStatus {
  ok,
  wrong_board,    // the views show another board than stated
  too_few_views,  // fewer than the solve, or the choice of the model, needs
  undetermined    // the views do not determine a lens of the model
};

/// Result of estimate_lens(): the lens with its uncertainty, or the reason why there is none.
struct LensEstimate {
  LensStatus status = LensStatus::ok;
  /// Reason for another status than ok, with what to add or correct.
  std::string problem = {};

  IntrinsicsSolution solution{};
  /// Uncertainty of the lens. `uncertainty_mean_px` and `uncertainty_worst_px` include those of the
  /// lens model and of the printed board.
  CalibrationReport report{};
  ViewCoverage coverage{};
  HeldOutFit held_out{};
  /// Sharpness of all views; std::nullopt if the board's edges are not measured.
  std::optional<LensSharpness> sharpness = {};
  /// Result of the selection of the lens model, if it was requested.
  std::optional<LensChoice> choice = {};
  /// True if the lens models were compared (compare_lens_models()): not with splined lenses, or
  /// fewer than kMinViewsToCompare views. The uncertainty then lacks the choice of the model.
  bool are_models_compared = false;
  /// Uncertainty from the choice of the lens model; std::nullopt if noise explains all differences
  /// between the models.
  std::optional<ModelUncertainty> model_uncertainty = {};
  /// Model that fits clearly better than the requested one, or equally well if the board is seen
  /// near a right angle off the axis.
  std::optional<LensModel> better_model = {};
  /// Change of projections by one standard deviation of the board's print
  /// (estimate_aspect_effect()), RMS over the image, px; std::nullopt if
  /// Board::print_sd is 0 or the solve fails.
  std::optional<double> print_px = {};
  /// Lattice of the corners in `solution`. Covariance of the intrinsics including the bias of the
  /// regularization, the choice of the lens model and the print of the board; std::nullopt for
  /// splined lenses and if not finite.
  std::optional<BoardLattice> lattice = {};
  std::optional<MatrixX> intrinsics_covariance = {};

  /// Gamma of the camera's tone curve, 1 for none; the views with corners corrected for it.
  double gamma = 1;
  std::vector<BoardView> views = {};
  /// Images of the views in the solve, in the order of IntrinsicsSolution.
  std::vector<std::string> images = {};
  /// Describes views that do not fit the lens of the others (test_view_consistency());
  /// empty if all fit. Also one of the warnings.
  std::string inconsistent_views = {};
  std::vector<std::string> warnings = {}, details = {};

  bool has_succeeded() const { return status == LensStatus::ok; }
};

/// Returns `warp`, or WarpChoice::off for a square chessboard. Such a board looks the same after a
/// quarter turn, so that the direction of its warp cannot be determined.
/// @throws std::invalid_argument if the warp of such a board is requested
WarpChoice select_board_warp(const Board& board, WarpChoice warp);

/// Estimates a lens from views of a board in these stages: tone curve of the camera
/// (correct_tone_curve()), layout of the board (check_board_layout()), lens model,
/// solve (solve_intrinsics()), board again with the lens, uncertainty
/// (make_lens_report(), combine_model_fits()).
/// @throws std::invalid_argument as BoardLattice
LensEstimate estimate_lens(LensViews input);

}  // namespace vlp
