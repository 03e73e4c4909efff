// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/intrinsics.h"

#include <algorithm>

#include "calibration/intrinsics/intrinsics_solver.h"

namespace vlp {
namespace {

IntrinsicsSolution failure(IntrinsicsStatus status) { return {status, {}, {}, {}, {}, 0, 0, 0}; }

}  // namespace

std::string_view explanation_of(IntrinsicsStatus status) {
  switch (status) {
    case IntrinsicsStatus::ok:
      return "ok";
    case IntrinsicsStatus::too_few_views:
      return "fewer than three views can be used; add views of the board, tilted by 20 to 45 "
             "degrees "
             "to different sides and all over the image";
    case IntrinsicsStatus::all_alike:
      return "all views show the board at the same angle, so that any focal length fits; add views "
             "with the board tilted by 20 to 45 degrees to different sides";
    case IntrinsicsStatus::no_solution:
      return "no lens fits the views; is board.yaml that of the board in the images?";
  }
  return "";
}

IntrinsicsSolution solve_intrinsics(const IntrinsicsInput& input) {
  constexpr std::size_t most_starts = 4;
  if (input.views.size() < IntrinsicsSolver::kLeastViews)
    return failure(IntrinsicsStatus::too_few_views);
  auto starts = focal_lengths(input);
  starts.resize(std::min(starts.size(), most_starts));
  for (const double focal_px : starts) {
    IntrinsicsSolver solver(input);
    if (!solver.start(focal_px) || !solver.refine() || !solver.weigh_regularization() ||
        !solver.take_out_shifts() || !solver.bend() || !solver.weigh_regularization() ||
        !solver.leave_out_outliers() || !solver.weigh_regularization()) {
      continue;
    }
    if (solver.all_alike()) return failure(IntrinsicsStatus::all_alike);
    IntrinsicsSolution solution = solver.solution();
    if (2 * solution.views.size() > input.views.size()) return solution;
  }
  return failure(IntrinsicsStatus::no_solution);
}

}  // namespace vlp
