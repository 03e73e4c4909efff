// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/lens_step.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "calibration/intrinsics/board_check.h"
#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/projection_uncertainty.h"
#include "calibration/intrinsics/spline_fit.h"
#include "camera/spline_surface.h"
#include "geometry/angles.h"
#include "geometry/median.h"
#include "geometry/polygon.h"
#include "report/plots/calibration_plots.h"
#include "rig/stage.h"
#include "session/skipped_images.h"

namespace vlp {
namespace {

std::string too_few(const Board& board, const SeenBoard& seen) {
  if (board.kind == BoardKind::chessboard && seen.points.empty()) {
    return "the chessboard is not seen as a whole";
  }
  if (board.has_squares() || !seen.points.empty()) {
    return fmt::format("only {} corners of the board can be used, or too many of them in a line",
                       seen.points.size());
  }
  std::string words = fmt::format("only {} tags of the board can be used", seen.tags.size());
  if (2 * seen.overexposed > seen.unusable) {
    words += fmt::format(", around {} more white is overexposed and runs over the corners",
                         seen.overexposed);
  } else if (seen.unusable > 0) {
    words += fmt::format(", {} more are blurred, hidden or cut", seen.unusable);
  }
  return words;
}

/// Whether white runs over most of the tags that cannot be used in views of too little.
bool overexposed(const std::vector<BoardView>& views, const BoardLattice& lattice) {
  int unusable = 0, overexposed = 0;
  for (const BoardView& view : views) {
    if (lattice.enough(view.seen)) continue;
    unusable += view.seen.unusable;
    overexposed += view.seen.overexposed;
  }
  return 2 * overexposed > unusable;
}

/// Whether two views show the board in the same place: what both show is 1 % of the image's width
/// apart, rms, or less, and neither shows much that the other does not.
bool alike(const std::vector<SeenPoint>& corners, const std::vector<SeenPoint>& others,
           int width_px) {
  constexpr double near = 0.01, shared = 0.7;
  double squares = 0, common = 0;
  auto other = others.begin();
  for (const SeenPoint& corner : corners) {
    while (other != others.end() && other->index < corner.index) ++other;
    if (other == others.end()) break;
    if (other->index != corner.index) continue;
    ++common;
    squares += (corner.pixel - other->pixel).squaredNorm();
  }
  const auto most = static_cast<double>(std::max(corners.size(), others.size()));
  return common >= shared * most && std::sqrt(squares / common) <= near * width_px;
}

/// A region of more of the image than this is all of it.
constexpr double kWhole = 0.999;

/// The views that can be used, apart from those that are held out.
struct Sorted {
  IntrinsicsInput solved, held_out;
};

Sorted sorted(const LensInput& input, LensResult& result) {
  const IntrinsicsInput none{BoardLattice(input.board),
                             {},
                             input.views.front().imager_px,
                             input.camera.lens_model,
                             possible_warp(input.board, input.warp)};
  Sorted sorted{none, none};
  int usable = 0;
  SkippedViews skipped;
  std::vector<const BoardView*> different;
  std::vector<std::vector<SeenPoint>> corners_of_different;
  for (const BoardView& view : input.views) {
    if (!none.lattice.enough(view.seen)) {
      skipped.add(view.image, too_few(input.board, view.seen), "show too little of the board");
      continue;
    }
    auto corners = corners_of(view.seen);
    const auto like =
        std::find_if(corners_of_different.begin(), corners_of_different.end(),
                     [&](const auto& others) { return alike(corners, others, view.imager_px[0]); });
    if (like != corners_of_different.end()) {
      const BoardView& other =
          *different[static_cast<std::size_t>(like - corners_of_different.begin())];
      skipped.add(view.image,
                  "shows the board where " + other.image + " does: the two count as one",
                  "show the board where others do: each place counts once");
      continue;
    }
    different.push_back(&view);
    corners_of_different.push_back(std::move(corners));
    ++usable;
    const bool held_out = input.held_out > 0 && usable % input.held_out == 0;
    auto& part = held_out ? sorted.held_out : sorted.solved;
    part.views.push_back(none.lattice.corners(view.seen));
    if (!held_out) result.images.push_back(view.image);
  }
  skipped.tell(result);
  if (input.held_out > 0 && sorted.held_out.views.empty()) {
    result.warnings.push_back(fmt::format("of {} views none is held out: there are fewer than {}",
                                          usable, input.held_out));
  }
  return sorted;
}

IntrinsicsReport report_of(const LensResult& result, const IntrinsicsInput& input) {
  const IntrinsicsSolution& solution = result.solution;
  const ProjectionUncertainty uncertainty(solution, input.lattice);
  const Eigen::VectorXd& pull = uncertainty.intrinsics_pull();
  const MatrixX covariance = uncertainty.intrinsics_covariance() + pull * pull.transpose();
  std::optional<std::array<double, 2>> board_warp_m;
  if (solution.solved_for.warp) {
    const Eigen::Vector2d warp_m =
        solution.problem.warp_m.cwiseProduct(input.lattice.warp_of_board());
    board_warp_m = {warp_m.x(), warp_m.y()};
  }
  return {static_cast<int>(solution.views.size()), solution.corners, solution.outliers,
          solution.rms_px, board_warp_m, result.report.uncertainty_worst_px,
          // Of hundreds of control points it would be larger than all else, and of no use to fixes.
          covariance.allFinite() && !is_splined(solution.problem.lens_model)
              ? std::optional(covariance)
              : std::nullopt,
          result.report.region_share > kWhole ? ImageRegion() : result.report.region};
}

Camera camera_of(Camera camera, const BoardProblem& problem) {
  camera.imager_px = problem.imager_px;
  camera.intrinsics = problem.intrinsics;
  return camera;
}

/// How far off the axis, in the stereographic plane of OPENCV_FISHEYE, boards are seen.
struct SeenReach {
  Eigen::Vector2d farthest{0, 0};
  /// Boards, not only corners, that lie within the grid; and all of them.
  std::size_t boards_within = 0, boards = 0;
};

SeenReach seen_reach(const IntrinsicsSolution& by_fisheye, const Eigen::Vector2d& grid_reach) {
  const Lens lens = by_fisheye.lens();
  const BoardProblem& problem = by_fisheye.problem;
  const std::size_t points = problem.points_of_a_board();
  SeenReach seen;
  for (std::size_t board = 0; board < problem.poses.size(); ++board) {
    Eigen::Vector2d of_board(0, 0);
    for (std::size_t i = board * points; i < (board + 1) * points; ++i) {
      if (!(problem.points[i].z() > 0)) continue;
      const auto ray = lens.unproject(problem.points[i].head<2>());
      if (!ray) continue;
      const Eigen::Vector3d& x = ray->direction;
      of_board = of_board.cwiseMax(x.head<2>().cwiseAbs() * (2 / (x.norm() + x.z())));
    }
    seen.farthest = seen.farthest.cwiseMax(of_board);
    ++seen.boards;
    if ((of_board.array() <= grid_reach.array()).all()) ++seen.boards_within;
  }
  return seen;
}

/// Why the grid of a splined lens is not for the views, by OPENCV_FISHEYE: more than a tenth of the
/// boards in them (of a board of four parts each) reach beyond it, and solves of such views fail,
/// some after a minute. Or it has too few control points where the lens sees. Else empty.
std::string why_not_this_grid(IntrinsicsInput input) {
  constexpr double fits_px = 2, more = 1.05;
  const LensModel wanted = input.lens_model;
  const SplineGrid grid = grid_of(input.lens_model);
  input.lens_model = LensModel::fisheye;
  const IntrinsicsSolution solution = solve_intrinsics(input);
  if (!solution.ok() || solution.rms_px > fits_px) return "";
  const Eigen::Vector2d reach =
      SplineSurface(grid, std::vector<double>(2 * grid.control_points())).reach();
  const SeenReach seen = seen_reach(solution, reach);
  if (10 * seen.boards_within >= 9 * seen.boards) {
    const Lens lens = solution.lens();
    const auto core = core_like(lens, seen_px(solution.problem));
    return splined_like(lens, input.imager_px, wanted, core)
               ? ""
               : why_too_coarse(lens, input.imager_px, wanted, core);
  }
  const auto angle_deg = [](double u) { return deg_from_rad(2 * std::atan(u / 2)); };
  return fmt::format(
      "the control points of {} reach {:.0f} degrees off the axis to the sides and {:.0f} up and "
      "down, but the board is seen {:.0f} and {:.0f} degrees off: take --lens {}",
      name_of(grid), angle_deg(reach.x()), angle_deg(reach.y()), angle_deg(seen.farthest.x()),
      angle_deg(seen.farthest.y()), name_of(reaching(grid, reach.cwiseMax(more * seen.farthest))));
}

std::string but_fits(LensModel wanted, const IntrinsicsSolution& other) {
  const std::string name(name_of(other.problem.lens_model));
  return fmt::format("no lens of {} is found, but {} fits to {:.2f} px: take --lens {}",
                     name_of(wanted), name, other.rms_px, name);
}

/// Why no lens of the model fits: the model, if another one does.
std::string why_none_fits(IntrinsicsInput input, const std::optional<FisheyeFit>& fisheye) {
  const LensModel wanted = input.lens_model;
  std::string words = fisheye ? but_fits(wanted, fisheye->solution) : "";
  double best_px = fisheye ? fisheye->solution.rms_px : 2;  // more is no fit
  for (const LensModel other : {LensModel::opencv4, LensModel::opencv8, LensModel::fisheye}) {
    if (other == wanted || (other == LensModel::fisheye && fisheye)) continue;
    input.lens_model = other;
    const IntrinsicsSolution solution = solve_intrinsics(input);
    if (!solution.ok() || solution.rms_px >= best_px) continue;
    best_px = solution.rms_px;
    words = but_fits(wanted, solution);
  }
  return words;
}

bool is_opencv(LensModel model) {
  return model == LensModel::opencv4 || model == LensModel::opencv5 ||
         model == LensModel::opencv8 || model == LensModel::opencv12;
}

/// Whether a lens leaves no more than another, up to what the corners do not tell: 20 times the
/// mean square of its residuals, as for the warp.
bool fits_as_well(const IntrinsicsSolution& one, const IntrinsicsSolution& other) {
  constexpr double much = 20;
  const double ratio = one.rms_px / other.rms_px;
  return ratio * ratio <= 1 + much / (2.0 * other.corners);
}

/// Where it is more than noise explains, how far the two lenses are apart where the lens is said to
/// be known, is how well it is.
void state_how_far_apart(const Lens& lens, const Lens& other, CalibrationReport& report,
                         const std::array<int, 2>& imager_px) {
  std::vector<Eigen::Vector2d> pixels = pixel_grid(imager_px);
  std::erase_if(pixels, [&](const auto& pixel) { return !polygon_contains(report.region, pixel); });
  const auto lens_from_other = b_from_a(other, lens, pixels);
  if (!lens_from_other) return;
  for (const Eigen::Vector2d& pixel : pixels) {
    const auto ray = other.unproject(pixel);
    const auto seen = ray ? lens.project(*lens_from_other * ray->direction) : std::nullopt;
    const double apart_px = seen ? (*seen - pixel).norm() : std::numeric_limits<double>::infinity();
    report.uncertainty_worst_px = std::max(report.uncertainty_worst_px, apart_px);
  }
}

/// That OPENCV_FISHEYE is the lens to take, when it fits clearly better or the board is seen nearly
/// as far off the axis as the rays of the lens go.
void tell_better(const FisheyeFit& fisheye, LensResult& result) {
  constexpr double clearly = 0.95, near_rad = 1.3;
  const IntrinsicsSolution& solution = result.solution;
  const LensModel model = solution.problem.lens_model;
  if (fisheye.solution.rms_px > clearly * solution.rms_px && fisheye.farthest_rad < near_rad) {
    result.details.push_back(
        fmt::format("{} fits the views as well as {}, so that nothing is known beyond the corners",
                    name_of(LensModel::fisheye), name_of(model)));
    return;
  }
  result.better_model = LensModel::fisheye;
  result.warnings.push_back(fmt::format(
      "the board is seen up to {:.0f} degrees off the axis, and {} fits it to {:.3f} px, {} to "
      "{:.3f} px, with no rays from 90 degrees on: take --lens {}",
      deg_from_rad(fisheye.farthest_rad), name_of(LensModel::fisheye), fisheye.solution.rms_px,
      name_of(model), solution.rms_px, name_of(LensModel::fisheye)));
}

/// A shift of the edges that a wrong gap between the tags makes rather than a camera.
void tell_shift(const IntrinsicsSolution& solution, LensResult& result) {
  constexpr double much_px = 0.4;  // cameras, sharpened and at three times white: 0.25
  const double shift_px = upper_median(solution.edge_shifts_px);
  if (std::abs(shift_px) <= much_px) return;
  result.warnings.push_back(fmt::format(
      "the edges of the tags are {:.2f} px towards the {}, more than a camera that is in "
      "focus makes; is tag_spacing of board.yaml right?",
      std::abs(shift_px), shift_px < 0 ? "light" : "dark"));
}

}  // namespace

WarpChoice possible_warp(const Board& board, WarpChoice wanted) {
  if (board.kind != BoardKind::chessboard || board.cols != board.rows) return wanted;
  if (wanted == WarpChoice::on) {
    throw std::invalid_argument(
        "a square chessboard looks the same after a quarter turn, so that its bend cannot be told: "
        "leave --warp on out");
  }
  return WarpChoice::off;
}

LensResult solve_lens(const LensInput& input, HistoryEntry entry) {
  LensResult result;
  const BoardCheck layout = check_board(input.board, input.views, {});
  if (!layout.problem.empty()) {
    result.fail(StepFailure::wrong_board, layout.problem, input.board_file);
    return result;
  }
  Sorted views = sorted(input, result);
  Camera camera = input.camera;
  if (input.choose_lens_model) {
    result.choice = choose_lens(views.solved);
    if (views.solved.views.size() < kLeastViewsToChoose) {
      result.fail(StepFailure::undetermined,
                  fmt::format("{} views with the board do not tell the lens model, which takes {}; "
                              "add views, or name the model with --lens",
                              views.solved.views.size(), kLeastViewsToChoose));
      return result;
    }
    // When none fits, the camera's says why.
    if (result.choice) camera.lens_model = result.choice->model;
    views.solved.lens_model = views.held_out.lens_model = camera.lens_model;
  }
  if (is_splined(camera.lens_model)) {
    const std::string why = why_not_this_grid(views.solved);
    if (!why.empty()) {
      result.fail(StepFailure::undetermined,
                  fmt::format("{} views with the board: {}", views.solved.views.size(), why));
      return result;
    }
  }
  std::optional<FisheyeFit> fisheye;
  if (is_opencv(camera.lens_model) && may_be_wide(views.solved)) {
    fisheye = result.choice ? result.choice->fisheye : fit_fisheye(views.solved);
    if (fisheye && fisheye->farthest_rad >= kRightAngle_rad) {
      result.fail(
          StepFailure::undetermined,
          fmt::format(
              "{} views with the board: it is seen up to {:.0f} degrees off the axis, where "
              "{} has no rays: take --lens {}",
              views.solved.views.size(), deg_from_rad(fisheye->farthest_rad),
              name_of(camera.lens_model), name_of(LensModel::fisheye)));
      return result;
    }
  }
  result.solution = solve_intrinsics(views.solved);
  const IntrinsicsSolution& solution = result.solution;
  if (!solution.ok()) {
    std::string why;
    if (solution.status == IntrinsicsStatus::no_solution) {
      why = why_none_fits(views.solved, fisheye);
    }
    if (solution.status == IntrinsicsStatus::too_few_views &&
        overexposed(input.views, views.solved.lattice)) {
      why = "in the others white is overexposed and runs over the corners; expose shorter";
    }
    if (why.empty()) why = explanation_of(solution.status);
    result.fail(StepFailure::undetermined,
                fmt::format("{} views with the board: {}", views.solved.views.size(), why));
    return result;
  }
  for (const auto& [view, rms_px] : solution.dropped) {
    if (!std::isfinite(rms_px) && is_splined(camera.lens_model)) {
      result.warnings.push_back(
          fmt::format("{}: shows the board where {} has no control points; take a larger "
                      "fov_x_deg, or Ny; dropped",
                      result.images[view], name_of(camera.lens_model)));
      continue;
    }
    result.warnings.push_back(fmt::format(
        "{}: fits no pose that goes with the other views ({:.1f} px are left over); dropped",
        result.images[view], rms_px));
  }
  const BoardCheck exact =
      check_board(input.board, input.views, solution.lens(), upper_median(solution.edge_shifts_px));
  if (!exact.problem.empty()) {
    result.fail(StepFailure::wrong_board, exact.problem, input.board_file);
    return result;
  }
  tell_shift(solution, result);
  result.solution.another_fits = fisheye && fits_as_well(fisheye->solution, solution);
  result.report = report_on(solution, views.solved);
  if (solution.another_fits) {
    state_how_far_apart(solution.lens(), fisheye->solution.lens(), result.report,
                        views.solved.imager_px);
    if (!input.choose_lens_model) tell_better(*fisheye, result);
  }
  result.coverage = coverage_of(solution, views.solved);
  result.held_out = held_out_fit(solution, views.held_out);
  result.calibration = with_camera(camera_of(camera, solution.problem),
                                   report_of(result, views.solved), std::move(entry));
  result.metrics = lens_metrics(solution, result.report, result.coverage);
  const std::string title = fmt::format("{}, {}", camera.id, name_of(camera.lens_model));
  result.drawing = [title, solution, lattice = views.solved.lattice] {
    return drawing_of(plot_of(title, solution, lattice));
  };
  return result;
}

std::vector<Metric> lens_metrics(const IntrinsicsSolution& solution,
                                 const CalibrationReport& report, const ViewCoverage& coverage) {
  std::vector<Metric> metrics{{"rms_px", solution.rms_px},
                              {"uncertainty_px", report.uncertainty_worst_px},
                              {"coverage", coverage.share},
                              {"views", static_cast<double>(solution.views.size())},
                              {"board_tilt_deg", deg_from_rad(coverage.tilt_rad)}};
  if (report.halves) metrics.push_back({"halves_px", report.halves->rms_px});
  return metrics;
}

std::vector<Gate> lens_gates() {
  return {{"rms_px", 1},     {"uncertainty_px", 2}, {"halves_px", 1},
          {"coverage", 0.4}, {"views", 6},          {"board_tilt_deg", 20}};
}

}  // namespace vlp
