// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/intrinsics/board_problem.h"

namespace vlp {

/// Addresses of the functions of mrcal_adapter.cpp that implement solve_by_mrcal()
/// and linearize_by_mrcal(). They are in a separate library, which is loaded at the
/// first solve, because mrcal loads some 30 shared libraries.
struct MrcalFunctions {
  bool (*solve)(BoardProblem&, const SolveOptions&);
  Linearization (*linearize)(const BoardProblem&, const SolveOptions&);
};

}  // namespace vlp
