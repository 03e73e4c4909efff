// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/lens_step.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <utility>

#include "calibration/intrinsics/board_check.h"
#include "geometry/angles.h"
#include "report/plots/calibration_plots.h"
#include "rig/calibration_builder.h"
#include "session/step_result.h"

namespace vlp {
namespace {

/// Fraction of the image above which the region is the whole image.
constexpr double kWholeImage = 0.999;

IntrinsicsReport make_report(const LensEstimate& lens) {
  const IntrinsicsSolution& solution = lens.solution;
  std::optional<std::array<double, 2>> board_warp_m;
  if (solution.solved_parameters.warp) {
    const Eigen::Vector2d warp_m =
        solution.problem.warp_m.cwiseProduct(lens.lattice->board_to_part_warp_ratio());
    board_warp_m = {warp_m.x(), warp_m.y()};
  }
  return {static_cast<int>(solution.views.size()),
          solution.corners,
          solution.outliers,
          solution.rms_px,
          board_warp_m,
          lens.report.uncertainty_worst_px,
          lens.intrinsics_covariance,
          lens.report.region_fraction > kWholeImage ? ImageRegion() : lens.report.region};
}

Camera make_camera(Camera camera, const BoardProblem& problem) {
  camera.lens_model = problem.lens_model;
  camera.imager_px = problem.imager_px;
  camera.intrinsics = problem.intrinsics;
  return camera;
}

/// Fails because no image can be used: another board, if the rejected images show one.
void fail_without_views(const LensInput& input, LensResult& result) {
  std::vector<BoardView> views;
  for (const Observation& image : input.observations.images) {
    if (image.board) views.push_back(*image.board);
  }
  const std::string layout = check_board_layout(input.board, views, {}).problem;
  if (!layout.empty())
    return result.set_step_failure(StepFailure::wrong_board, layout, input.board_file);
  result.set_step_failure(StepFailure::undetermined, explain_no_image(input.observations.images));
}

}  // namespace

LensResult run_lens_step(LensInput input, HistoryEntry entry) {
  LensResult result;
  add_intake_remarks(input.observations, result);
  if (!result.has_succeeded()) return result;
  LensViews views{collect_board_views(input.observations.images),
                  input.board,
                  input.camera.lens_model,
                  input.held_out,
                  input.warp,
                  input.choose_lens_model};
  if (views.views.empty()) {
    fail_without_views(input, result);
    return result;
  }
  LensEstimate& lens = result.lens = estimate_lens(std::move(views));
  std::move(lens.warnings.begin(), lens.warnings.end(), std::back_inserter(result.warnings));
  result.inconsistent_captures = lens.inconsistent_views;
  std::move(lens.details.begin(), lens.details.end(), std::back_inserter(result.details));
  if (lens.status == LensStatus::wrong_board) {
    result.set_step_failure(StepFailure::wrong_board, lens.problem, input.board_file);
    return result;
  }
  if (!lens.has_succeeded()) {
    std::string problem = lens.problem;
    const std::string rejections = summarize_rejected_images(input.observations.images);
    if (lens.status == LensStatus::too_few_views && !rejections.empty()) {
      problem += "; not used: " + rejections;
    }
    result.set_step_failure(StepFailure::undetermined, std::move(problem));
    return result;
  }
  const Camera camera = make_camera(input.camera, lens.solution.problem);
  result.calibration = make_calibration(camera, make_report(lens), std::move(entry));
  result.metrics = collect_lens_metrics(lens);
  const std::string title = fmt::format("{}, {}", camera.id, lens_model_name(camera.lens_model));
  result.drawing = [title, solution = lens.solution, lattice = *lens.lattice,
                    sharpness = lens.sharpness] {
    return draw_intrinsics(make_intrinsics_plot(title, solution, lattice, sharpness));
  };
  return result;
}

std::vector<Metric> collect_lens_metrics(const LensEstimate& lens) {
  std::vector<Metric> metrics{{"rms_px", lens.solution.rms_px},
                              {"expected_max_error_px", lens.report.uncertainty_worst_px},
                              {"coverage", lens.coverage.covered_fraction},
                              {"views", static_cast<double>(lens.solution.views.size())},
                              {"board_tilt_deg", deg_from_rad(lens.coverage.tilt_rad)}};
  if (lens.report.split_half_difference)
    metrics.push_back({"split_half_px", lens.report.split_half_difference->rms_px});
  if (lens.print_px) metrics.push_back({"board_print_px", *lens.print_px});
  if (const auto& sharpness = lens.sharpness) {
    metrics.insert(metrics.end(), {{"mtf50", sharpness->mean_mtf50},
                                   {"mtf50_worst_ratio", sharpness->worst_ratio},
                                   {"mtf50_asymmetry", sharpness->asymmetry},
                                   {"black_ratio", sharpness->black_level},
                                   {"local_loss", sharpness->local_loss},
                                   {"local_shadow", sharpness->local_shadow}});
  }
  return metrics;
}

std::vector<Gate> make_lens_gates() {
  return {{"rms_px", 1}, {"expected_max_error_px", 2}, {"split_half_px", 1}, {"coverage", 0.4},
          {"views", 6},  {"board_tilt_deg", 20}};
}

}  // namespace vlp
