// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/intrinsics/board_problem.h"

namespace vlp {

/// Functions of mrcal_adapter.cpp. mrcal loads some 30 shared libraries. It is therefore linked to
/// a library of its own, which is loaded at the first solve.
struct MrcalFunctions {
  bool (*solve)(BoardProblem&, const SolveOptions&);
  Linearization (*linearize)(const BoardProblem&, const SolveOptions&);
};

}  // namespace vlp
