// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/lens_step.h"

#include <fmt/core.h>

#include <utility>

#include "calibration/intrinsics/board_check.h"
#include "calibration/intrinsics/projection_uncertainty.h"
#include "report/plots/calibration_plots.h"
#include "rig/stage.h"

namespace vlp {
namespace {

/// The views that can be used, apart from those that are held out.
struct Sorted {
  IntrinsicsInput solved, held_out;
};

Sorted sorted(const LensInput& input, LensResult& result) {
  const IntrinsicsInput none{
      BoardLattice(input.board), {}, input.views.front().imager_px, input.camera.lens_model};
  Sorted sorted{none, none};
  int usable = 0;
  for (const BoardView& view : input.views) {
    if (!none.lattice.enough(view.seen)) {
      result.skipped.push_back({view.image, fmt::format("only {} tags of the board can be used",
                                                        view.seen.tags.size())});
      continue;
    }
    const bool held_out = input.held_out > 0 && ++usable % input.held_out == 0;
    auto& part = held_out ? sorted.held_out : sorted.solved;
    part.views.push_back(none.lattice.corners(view.seen));
    if (!held_out) result.images.push_back(view.image);
  }
  return sorted;
}

IntrinsicsReport report_of(const LensResult& result, const IntrinsicsInput& input) {
  const IntrinsicsSolution& solution = result.solution;
  const MatrixX covariance = ProjectionUncertainty(solution).intrinsics_covariance();
  const Eigen::Vector2d warp_m =
      solution.problem.warp_m.cwiseProduct(input.lattice.warp_of_board());
  return {static_cast<int>(solution.views.size()),
          solution.corners,
          solution.outliers,
          solution.rms_px,
          std::array{warp_m.x(), warp_m.y()},
          result.report.uncertainty_worst_px,
          covariance.allFinite() ? std::optional(covariance) : std::nullopt};
}

Camera camera_of(Camera camera, const BoardProblem& problem) {
  camera.imager_px = problem.imager_px;
  camera.intrinsics = problem.intrinsics;
  return camera;
}

}  // namespace

LensResult solve_lens(const LensInput& input, HistoryEntry entry) {
  LensResult result;
  const BoardCheck layout = check_board(input.board, input.views, {});
  if (!layout.problem.empty()) {
    result.fail(StepFailure::wrong_board, layout.problem, input.board_file);
    return result;
  }
  const Sorted views = sorted(input, result);
  result.solution = solve_intrinsics(views.solved);
  const IntrinsicsSolution& solution = result.solution;
  if (!solution.ok()) {
    result.fail(StepFailure::undetermined,
                fmt::format("{} views with the board: {}", views.solved.views.size(),
                            explanation_of(solution.status)));
    return result;
  }
  for (const auto& [view, rms_px] : solution.dropped) {
    result.warnings.push_back(fmt::format(
        "{}: fits no pose that goes with the other views ({:.1f} px are left over); dropped",
        result.images[view], rms_px));
  }
  const BoardCheck exact = check_board(input.board, input.views, solution.lens());
  if (!exact.problem.empty()) {
    result.fail(StepFailure::wrong_board, exact.problem, input.board_file);
    return result;
  }
  result.report = report_on(solution, views.solved);
  result.coverage = coverage_of(solution, views.solved);
  result.held_out = held_out_fit(solution, views.held_out);
  result.calibration = with_camera(camera_of(input.camera, solution.problem),
                                   report_of(result, views.solved), std::move(entry));
  result.metrics = {{"rms_px", solution.rms_px},
                    {"uncertainty_px", result.report.uncertainty_worst_px},
                    {"coverage", result.coverage.share}};
  if (result.report.halves) result.metrics.push_back({"halves_px", result.report.halves->rms_px});
  const std::string title =
      fmt::format("{}, {}", input.camera.id, name_of(input.camera.lens_model));
  result.drawing = [title, solution] { return drawing_of(plot_of(title, solution)); };
  return result;
}

std::vector<Gate> lens_gates() { return {{"rms_px", 1}, {"uncertainty_px", 2}, {"halves_px", 1}}; }

}  // namespace vlp
