// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/lens_estimate.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>
#include <vector>

#include "calibration/intrinsics/board_check.h"
#include "calibration/intrinsics/board_print.h"
#include "calibration/intrinsics/inconsistent_views.h"
#include "calibration/intrinsics/projection_uncertainty.h"
#include "calibration/intrinsics/spline_fit.h"
#include "calibration/intrinsics/tone_curve_estimation.h"
#include "camera/spline_surface.h"
#include "geometry/angles.h"
#include "geometry/median.h"

namespace vlp {
namespace {

/// Residual above which a lens does not fit, per axis.
constexpr double kMaxFit_px = 2;

/// Views in the solve, and views that are held out.
struct SplitViews {
  IntrinsicsInput solved, held_out;
};

SplitViews split_views(const LensViews& input, LensEstimate& result) {
  const IntrinsicsInput empty{BoardLattice(input.board),
                              {},
                              input.views.front().imager_px,
                              input.lens_model,
                              select_board_warp(input.board, input.warp)};
  SplitViews split{empty, empty};
  int count = 0;
  for (const BoardView& view : result.views) {
    ++count;
    const bool is_held_out = input.held_out > 0 && count % input.held_out == 0;
    auto& part = is_held_out ? split.held_out : split.solved;
    part.views.push_back(empty.lattice.list_corners(view.detection));
    if (!is_held_out) result.images.push_back(view.image);
  }
  if (input.held_out > 0 && split.held_out.views.empty()) {
    result.warnings.push_back(
        fmt::format("no view is held out: {} views are fewer than {}", count, input.held_out));
  }
  return split;
}

void fail(LensEstimate& result, LensStatus status, std::string problem) {
  result.status = status;
  result.problem = std::move(problem);
}

void fail_undetermined(LensEstimate& result, const SplitViews& views, const std::string& problem) {
  fail(result, LensStatus::undetermined,
       fmt::format("{} views with the board: {}", views.solved.views.size(), problem));
}

/// Distance from the axis, in the stereographic plane of OPENCV_FISHEYE, at which boards are seen.
struct BoardExtent {
  Eigen::Vector2d farthest{0, 0};
  /// Number of boards that lie within the grid with all of their corners; number of boards.
  std::size_t boards_within = 0, boards = 0;
};

BoardExtent measure_extent(const IntrinsicsSolution& fisheye, const Eigen::Vector2d& grid_reach) {
  const Lens lens = fisheye.fitted_lens();
  const BoardProblem& problem = fisheye.problem;
  const std::size_t points = problem.points_per_board();
  BoardExtent reach;
  for (std::size_t board = 0; board < problem.poses.size(); ++board) {
    Eigen::Vector2d board_reach(0, 0);
    for (std::size_t i = board * points; i < (board + 1) * points; ++i) {
      if (!(problem.points[i].z() > 0)) continue;
      const auto ray = lens.unproject_pixel(problem.points[i].head<2>());
      if (!ray) continue;
      const Eigen::Vector3d& x = ray->direction;
      board_reach = board_reach.cwiseMax(x.head<2>().cwiseAbs() * (2 / (x.norm() + x.z())));
    }
    reach.farthest = reach.farthest.cwiseMax(board_reach);
    ++reach.boards;
    if ((board_reach.array() <= grid_reach.array()).all()) ++reach.boards_within;
  }
  return reach;
}

/// Returns the reason why the grid of a splined lens does not suit the views, judged by
/// OPENCV_FISHEYE; empty if it does. Either more than a tenth of the boards extend beyond the grid,
/// where solves fail, some after a minute (a board of four parts counts four times). Or the grid
/// has too few control points in the field of view.
std::string explain_unsuitable_grid(const InitialSolutions& initial, LensModel splined) {
  constexpr double margin = 1.05;
  const std::array<int, 2>& imager_px = initial.input().imager_px;
  const SplineGrid grid = spline_grid_of(splined);
  const IntrinsicsSolution solution = solve_intrinsics(initial, LensModel::fisheye);
  if (!solution.has_succeeded() || solution.rms_px > kMaxFit_px) return "";
  const Eigen::Vector2d grid_reach =
      SplineSurface(grid, std::vector<double>(2 * grid.num_control_points())).spline_half_extent();
  const BoardExtent reach = measure_extent(solution, grid_reach);
  if (10 * reach.boards_within >= 9 * reach.boards) {
    const Lens lens = solution.fitted_lens();
    const auto core = fit_spline_core(lens, list_inlier_pixels(solution.problem));
    return fit_splined_lens(lens, imager_px, splined, core)
               ? ""
               : explain_coarse_grid(lens, imager_px, splined, core);
  }
  const auto angle_deg = [](double u) { return deg_from_rad(2 * std::atan(u / 2)); };
  return fmt::format(
      "the control points of {} extend to {:.0f} degrees off axis horizontally and {:.0f} "
      "vertically, but the board is visible to {:.0f} and {:.0f} degrees: use --lens {}",
      splined_lens_name(grid), angle_deg(grid_reach.x()), angle_deg(grid_reach.y()),
      angle_deg(reach.farthest.x()), angle_deg(reach.farthest.y()),
      splined_lens_name(resize_spline_grid(grid, grid_reach.cwiseMax(margin * reach.farthest))));
}

std::string recommend_model(LensModel requested, const IntrinsicsSolution& other) {
  const std::string name(lens_model_name(other.problem.lens_model));
  return fmt::format("no lens of {} fits, but {} fits with {:.2f} px: use --lens {}",
                     lens_model_name(requested), name, other.rms_px, name);
}

/// Recommends another model that fits if the requested one does not; empty if there is none.
std::string explain_no_fit(const InitialSolutions& initial, LensModel requested) {
  std::string problem;
  double best_px = kMaxFit_px;
  for (const LensModel other : {LensModel::opencv4, LensModel::opencv8, LensModel::fisheye}) {
    if (other == requested) continue;
    const IntrinsicsSolution solution = solve_intrinsics(initial, other);
    if (!solution.has_succeeded() || solution.rms_px >= best_px) continue;
    best_px = solution.rms_px;
    problem = recommend_model(requested, solution);
  }
  return problem;
}

bool is_opencv_model(LensModel model) {
  return model == LensModel::opencv4 || model == LensModel::opencv5 ||
         model == LensModel::opencv8 || model == LensModel::opencv12;
}

/// Recommends OPENCV_FISHEYE if it fits clearly better, or as well with the board seen nearly as
/// far off the axis as the rays of the lens reach.
void recommend_fisheye(const IntrinsicsSolution& fisheye, LensEstimate& result) {
  constexpr double better_ratio = 0.95, equal_ratio = 1.01, min_angle_rad = 1.3;
  const IntrinsicsSolution& solution = result.solution;
  const LensModel model = solution.problem.lens_model;
  const double max_angle_rad = compute_max_corner_angle_rad(fisheye);
  const double max_ratio = max_angle_rad < min_angle_rad ? better_ratio : equal_ratio;
  if (fisheye.rms_px > max_ratio * solution.rms_px) return;
  result.better_model = LensModel::fisheye;
  result.warnings.push_back(fmt::format(
      "the board is visible up to {:.0f} degrees off axis; {} fits with {:.3f} px, {} with {:.3f} "
      "px and no rays beyond 90 degrees: use --lens {}",
      deg_from_rad(max_angle_rad), lens_model_name(LensModel::fisheye), fisheye.rms_px,
      lens_model_name(model), solution.rms_px, lens_model_name(LensModel::fisheye)));
}

/// Warns of a displacement of the edges that a wrong gap between the tags causes, not a camera.
void warn_about_edges(const IntrinsicsSolution& solution, LensEstimate& result) {
  constexpr double max_shift_px = 0.4;  // cameras, sharpened and at three times white: 0.25
  const double shift_px = upper_median(solution.edge_displacements_px);
  if (std::abs(shift_px) <= max_shift_px) return;
  // [LENS-4] `that is in focus makes`
  result.warnings.push_back(fmt::format(
      "the edges of the tags are {:.2f} px towards the {}, more than a camera that is in "
      "focus makes; is tag_spacing of board.yaml right?",
      std::abs(shift_px), shift_px < 0 ? "light" : "dark"));
}

void warn_about_dropped(LensEstimate& result) {
  const LensModel model = result.solution.problem.lens_model;
  for (const auto& [view, rms_px] : result.solution.dropped_views) {
    if (!std::isfinite(rms_px) && is_splined_lens_model(model)) {
      result.warnings.push_back(
          fmt::format("{}: dropped, as the board is where {} has no control points; use a larger "
                      "fov_x_deg or Ny",
                      result.images[view], lens_model_name(model)));
      continue;
    }
    // [LENS-5] `no pose that goes with`
    result.warnings.push_back(fmt::format(
        "{}: fits no pose that goes with the other views ({:.1f} px are left over); dropped",
        result.images[view], rms_px));
  }
}

void warn_about_views(LensEstimate& result) {
  const InconsistentViews found = test_view_consistency(result.solution);
  if (found.views.empty()) return;
  result.inconsistent_views = describe_bad_views(found, result.images);
  result.warnings.push_back(result.inconsistent_views);
}

/// Selects the lens model of the views. Returns false if there are too few.
bool select_lens_model_for_views(const InitialSolutions& initial, SplitViews& views,
                                 LensEstimate& result) {
  result.choice = select_lens_model(initial);
  if (views.solved.views.size() < kMinViewsToChoose) {
    fail(result, LensStatus::too_few_views,
         fmt::format("{} views of the board do not determine the lens model, which needs {}; add "
                     "views, or give the model with --lens",
                     views.solved.views.size(), kMinViewsToChoose));
    return false;
  }
  // If no model fits, the solve with the stated one gives the reason.
  if (result.choice) views.solved.lens_model = views.held_out.lens_model = result.choice->model;
  return true;
}

/// Returns the reason why the solver found no lens.
std::string explain_why_lens_not_found(const InitialSolutions& initial, LensModel requested,
                                       IntrinsicsStatus status) {
  std::string problem;
  if (status == IntrinsicsStatus::no_solution) problem = explain_no_fit(initial, requested);
  return problem.empty() ? std::string(describe_status(status)) : problem;
}

/// Fits of other models to the corners of a solution.
struct OtherFits {
  /// Those that may describe the lens.
  std::vector<IntrinsicsSolution> possible;
  std::optional<IntrinsicsSolution> fisheye;
};

/// Fits other models. Sets are_models_compared.
OtherFits fit_other_models(LensEstimate& result) {
  const IntrinsicsSolution& solution = result.solution;
  if (is_splined_lens_model(solution.problem.lens_model)) return {};
  const auto comparison = compare_lens_models(solution);
  result.are_models_compared = comparison.has_value();
  if (!comparison) return {};
  const auto fisheye =
      std::ranges::find(comparison->candidates, LensModel::fisheye, &LensCandidate::model);
  return {list_plausible_model_fits(solution, *comparison), fisheye->fit};
}

/// Returns the region in which the lens is calibrated and each of the other models has rays.
ImageRegion compute_region(const IntrinsicsSolution& solution,
                           const std::vector<IntrinsicsSolution>& others) {
  std::vector<Lens> other_lenses;
  other_lenses.reserve(others.size());
  for (const IntrinsicsSolution& other : others) other_lenses.push_back(other.fitted_lens());
  const auto compute = [&](const std::vector<Lens>& lenses) {
    return make_valid_region(list_inlier_pixels(solution.problem), solution.problem.imager_px,
                             solution.fitted_lens(), lenses);
  };
  // Without a region no fix would be checked.
  const ImageRegion region = compute(other_lenses);
  return region.empty() ? compute({}) : region;
}

/// Adds the uncertainty from the choice of the lens model to the report.
void add_model_uncertainty(const std::vector<IntrinsicsSolution>& others, LensEstimate& result) {
  CalibrationReport& report = result.report;
  result.model_uncertainty =
      combine_model_fits(result.solution, others, report.region, report.uncertainty_worst_px);
  if (!result.model_uncertainty) return;
  const ModelUncertainty& model = *result.model_uncertainty;
  report.uncertainty_mean_px = std::hypot(report.uncertainty_mean_px, model.mean_px);
  report.uncertainty_worst_px = std::hypot(report.uncertainty_worst_px, model.worst_px);
}

/// Adds the uncertainty from the print of the board to the report. `print_sd` is Board::print_sd.
std::optional<AspectErrorEffect> add_print_uncertainty(double print_sd, LensEstimate& result) {
  if (print_sd == 0) return {};
  CalibrationReport& report = result.report;
  auto print = estimate_aspect_effect(result.solution, print_sd, report.region);
  if (print) {
    result.print_px = print->rms_px;
    report.uncertainty_mean_px = std::hypot(report.uncertainty_mean_px, print->mean_in_region_px);
    report.uncertainty_worst_px =
        std::hypot(report.uncertainty_worst_px, print->worst_in_region_px);
  } else {
    result.warnings.emplace_back(
        "the effect of print_sd of board.yaml cannot be computed, and the lens's uncertainty lacks "
        "it");
  }
  return print;
}

/// Adds the uncertainty of a solution. `print_sd` is Board::print_sd.
void add_uncertainty(const SplitViews& views, double print_sd,
                     const std::vector<IntrinsicsSolution>& others, LensEstimate& result) {
  const IntrinsicsSolution& solution = result.solution;
  const auto uncertainties =
      ProjectionUncertainty::compare_corners_and_tags(solution, views.solved.lattice);
  result.report =
      make_lens_report(solution, views.solved, uncertainties, compute_region(solution, others));
  result.coverage = measure_view_coverage(solution, views.solved);
  result.held_out = fit_held_out_views(solution, views.held_out);
  result.lattice = views.solved.lattice;
  result.sharpness = measure_sharpness(result.views, views.solved.imager_px);
  add_model_uncertainty(others, result);
  const auto print = add_print_uncertainty(print_sd, result);
  // The covariance of hundreds of control points would fill the file, without use for fixes.
  if (is_splined_lens_model(solution.problem.lens_model)) return;
  const ProjectionUncertainty& uncertainty = uncertainties.by_tags;
  MatrixX covariance = uncertainty.intrinsics_covariance();
  const Eigen::VectorXd& bias = uncertainty.regularization_bias();
  covariance += bias * bias.transpose();
  if (result.model_uncertainty) covariance += result.model_uncertainty->intrinsics_covariance;
  if (print) covariance += print->intrinsics * print->intrinsics.transpose();
  if (covariance.allFinite()) result.intrinsics_covariance = covariance;
}

}  // namespace

WarpChoice select_board_warp(const Board& board, WarpChoice warp) {
  if (board.kind != BoardKind::chessboard || board.cols != board.rows) return warp;
  if (warp == WarpChoice::on) {
    throw std::invalid_argument(
        "--warp on: not possible for a square chessboard, which has the same appearance after a "
        "rotation by 90 degrees; leave it out");
  }
  return WarpChoice::off;
}

LensEstimate estimate_lens(LensViews input) {
  LensEstimate result;
  result.views = std::move(input.views);
  input.views = {result.views.front()};
  result.gamma = correct_tone_curve(result.views, input.board);
  const BoardCheck layout = check_board_layout(input.board, result.views, {});
  if (!layout.problem.empty()) {
    fail(result, LensStatus::wrong_board, layout.problem);
    return result;
  }
  SplitViews views = split_views(input, result);
  const InitialSolutions initial(views.solved);
  if (input.choose_lens_model && !select_lens_model_for_views(initial, views, result))
    return result;
  const LensModel model = views.solved.lens_model;
  if (is_splined_lens_model(model)) {
    const std::string problem = explain_unsuitable_grid(initial, model);
    if (!problem.empty()) {
      fail_undetermined(result, views, problem);
      return result;
    }
  }
  const bool may_be_fisheye =
      !result.choice && is_opencv_model(model) && may_be_wide_angle(initial);
  if (may_be_fisheye && may_exceed_right_angle(initial)) {
    const auto fisheye = fit_fisheye_lens(initial);
    if (fisheye && fisheye->max_corner_angle_rad >= kRightAngle_rad) {
      fail_undetermined(
          result, views,
          fmt::format(
              "it is visible up to {:.0f} degrees off axis, where {} has no rays: use --lens {}",
              deg_from_rad(fisheye->max_corner_angle_rad), lens_model_name(model),
              lens_model_name(LensModel::fisheye)));
      return result;
    }
  }
  result.solution = solve_intrinsics(initial, model);
  if (!result.solution.has_succeeded()) {
    fail_undetermined(result, views,
                      explain_why_lens_not_found(initial, model, result.solution.status));
    if (result.solution.status == IntrinsicsStatus::too_few_views) {
      result.status = LensStatus::too_few_views;
    }
    return result;
  }
  warn_about_dropped(result);
  const BoardCheck exact =
      check_board_layout(input.board, result.views, result.solution.fitted_lens(),
                         upper_median(result.solution.edge_displacements_px));
  if (!exact.problem.empty()) {
    fail(result, LensStatus::wrong_board, exact.problem);
    return result;
  }
  warn_about_views(result);
  warn_about_edges(result.solution, result);
  OtherFits others = fit_other_models(result);
  if (may_be_fisheye && !others.fisheye) {
    if (auto fisheye = fit_fisheye_lens(initial)) others.fisheye = std::move(fisheye->solution);
  }
  if (may_be_fisheye && others.fisheye) recommend_fisheye(*others.fisheye, result);
  add_uncertainty(views, input.board.print_sd, others.possible, result);
  return result;
}

}  // namespace vlp
