// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "calibration/intrinsics/calibration_report.h"
#include "calibration/intrinsics/intrinsics.h"
#include "detection/boards/detect_boards.h"
#include "evaluation/gates.h"
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
};

struct LensResult : StepResult {
  IntrinsicsSolution solution{};
  CalibrationReport report{};
  ViewCoverage coverage{};
  HeldOut held_out{};
  /// Images of the views that were solved for, in their order.
  std::vector<std::string> images;
};

/// The lens from views of the board, and how far it can be trusted. Metrics: rms_px,
/// uncertainty_px, halves_px, coverage. Throws std::invalid_argument for a board without enough
/// rows and columns (BoardLattice). wrong_board, undetermined. Precondition: there is a view.
LensResult solve_lens(const LensInput& input, HistoryEntry entry);

/// The gates of a lens, by the metrics of solve_lens(), met and not. What is not known, as
/// halves_px where half of the views do not determine a lens, has no value (NaN) and is not met.
std::vector<GateResult> check_lens(const IntrinsicsGates& gates,
                                   const std::vector<Metric>& metrics);

}  // namespace vlp
