// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/mrcal_library.h"

#include <dlfcn.h>

#include "codecs/load_function.h"

namespace vlp {
namespace {

const MrcalFunctions& mrcal_functions() {
  static const MrcalFunctions& functions = *load_function<const MrcalFunctions*()>(
      VLP_MRCAL_LIBRARY, "vlp_mrcal_functions", "lenses cannot be solved", RTLD_NOW)();
  return functions;
}

}  // namespace

bool solve_by_mrcal(BoardProblem& problem, const SolveOptions& solve_options) {
  return mrcal_functions().solve(problem, solve_options);
}

Linearization linearize_by_mrcal(const BoardProblem& problem, const SolveOptions& solve_options) {
  return mrcal_functions().linearize(problem, solve_options);
}

}  // namespace vlp
