// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calibration/intrinsics/calibration_report.h"
#include "calibration/intrinsics/intrinsics.h"
#include "calibration/intrinsics/lens_choice.h"
#include "detection/boards/detect_boards.h"
#include "evaluation/gate.h"
#include "rig/board.h"
#include "session/step_result.h"

namespace vlp {

/// What the lens is found from.
struct LensInput {
  std::vector<BoardView> views;
  Board board;
  std::filesystem::path board_file;
  /// All that is known of the camera without it: id, lens model, row time, read-out, pixel pitch.
  /// The imager is that of the views, the intrinsics are not looked at.
  Camera camera;
  /// Every so many-th view is kept out of the solve, to say how well the lens fits it; 0: none.
  int held_out = 0;
  WarpChoice warp = WarpChoice::automatic;
  /// Takes the model that the views call for, choose_lens(), and not the camera's.
  bool choose_lens_model = false;
};

struct LensResult : StepResult {
  IntrinsicsSolution solution{};
  CalibrationReport report{};
  ViewCoverage coverage{};
  HeldOut held_out{};
  /// When it was asked for.
  std::optional<LensChoice> choice{};
  /// One that fits clearly better than the camera's, which was asked for, or as well where the
  /// board is seen near a right angle off the axis.
  std::optional<LensModel> better_model{};
  /// Images of the views that were solved for, in their order.
  std::vector<std::string> images;
};

/// What of the board's bend can be solved for. A square chessboard looks the same after a quarter
/// turn, which takes its bend along one edge for that along the other: its bend is left out, and
/// std::invalid_argument is thrown when it is wanted.
WarpChoice possible_warp(const Board& board, WarpChoice wanted);

/// The lens from views of the board, and how far it can be trusted; views that are alike count as
/// one. Metrics: lens_metrics().
/// Throws std::invalid_argument for a board without enough rows and columns (BoardLattice).
/// wrong_board, undetermined. Precondition: there is a view.
LensResult solve_lens(const LensInput& input, HistoryEntry entry);

/// rms_px, uncertainty_px, halves_px, coverage, views, board_tilt_deg.
std::vector<Metric> lens_metrics(const IntrinsicsSolution& solution,
                                 const CalibrationReport& report, const ViewCoverage& coverage);

/// What a lens has to reach unless other limits are asked for, by what was seen on rendered and
/// real boards of 800 to 4000 px: more rms_px than 1 means blurred images or the wrong lens model,
/// more uncertainty_px than 2 or halves_px than 1 too few views, too much alike; a board that was
/// seen in less of the image, in fewer places, or less tilted leaves what no figure shows.
std::vector<Gate> lens_gates();

}  // namespace vlp
