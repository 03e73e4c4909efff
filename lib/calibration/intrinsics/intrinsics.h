// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "calibration/intrinsics/board_lattice.h"
#include "calibration/intrinsics/board_problem.h"
#include "camera/lens.h"

namespace vlp {

/// Selects whether the warp of the board is estimated. `automatic`: keeps the warp if it reduces
/// the sum of squared residuals by more than 20 times their mean, which happens by chance once in
/// 20,000.
enum class WarpChoice { automatic, on, off };

/// Input of solve_intrinsics(): corners of a board in images of one camera, and the lens model.
/// `views` has the corners of each image; `imager_px` is (width, height).
struct IntrinsicsInput {
  BoardLattice lattice;
  std::vector<std::vector<BoardLattice::Corner>> views;
  std::array<int, 2> imager_px;
  LensModel lens_model;
  WarpChoice warp = WarpChoice::automatic;
};

/// Result of a solve.
enum class IntrinsicsStatus {
  ok,
  too_few_views,  // fewer than three that can be used
  all_parallel,   // every view shows the board at the same angle: any focal length fits
  no_solution,    // no lens of the model fits
};
/// Describes a status in one line, with the remedy.
std::string_view describe_status(IntrinsicsStatus status);

/// Result of solve_intrinsics(): lens, poses and board warp with their fit.
struct IntrinsicsSolution {
  IntrinsicsStatus status;
  /// Problem at the solution; like all members below, valid with status ok only. The poses are
  /// those of the parts of views[0], then of views[1] and so on; each has its points.
  BoardProblem problem;
  /// Indices in IntrinsicsInput::views of the views in the solution.
  std::vector<std::size_t> views;
  /// View of the input that fits no pose with the lens of the other views, and its RMS residual.
  struct DroppedView {
    std::size_t view;
    double rms_px;
  };
  std::vector<DroppedView> dropped_views;
  /// Mean shift of the tag edges towards the dark in each of `views`, px. The corners are corrected
  /// for it (fit_displacements()).
  std::vector<double> edge_displacements_px;
  /// RMS of the weighted residuals per axis, without outliers: sqrt(sum of squares / (2 corners)),
  /// px.
  double rms_px;
  /// Number of used corners, and number of corners that are outliers.
  int corners, outliers;

  bool has_succeeded() const { return status == IntrinsicsStatus::ok; }
  /// Computes rms_px, corners and outliers from `problem`.
  void update_statistics();
  Lens fitted_lens() const { return Lens(problem.lens_model, problem.intrinsics); }
  /// Estimated parameters: the intrinsics (splined lenses: without the core), and the warp if
  /// selected.
  SolveOptions solved_parameters{.core = true, .distortions = true, .warp = true};
};

/// Estimates lens, poses and warp of the board. Needs no initial focal length. Stages:
/// 1. Selects up to four focal lengths of a geometric series: those of STEREOGRAPHIC that fit the
///   poses of the views best. The following stages start from one after another until one succeeds
///   with more than half of the views.
/// 2. Solves STEREOGRAPHIC with all poses and re-estimates the poses with that lens, until
///   convergence.
/// 3. Solves the requested model, regularized as in mrcal, and re-estimates the poses. Drops views
///   that fit no pose. Splined lenses: see below.
/// 4. Corrects the corners of the tags for the edge curvature of this lens
///   (correct_curvature()).
/// 5. Corrects the shift of the tag edges, constant over a view
///   (fit_displacements()), and solves again, at most twice.
/// 6. Estimates the warp of the board (WarpChoice).
/// 7. Weights the corners by their variances if the images provide them (CornerWeights). Repeats
///   stage 4, then stage 5 with shifts that vary over a view, then the weights.
/// 8. Solves again without outliers.
/// 9. Splined lenses: aligns the frame to the axis of the lens.
///
/// Stages 3, 8 and 9 call solve_board_problem(). Other solves call the faster
/// solve_intermediate_stage(); stage 8 refines their result.
///
/// Splined lenses start stage 3 from OPENCV_FISHEYE, whose center becomes their center. Their
/// regularization is scaled to the residual noise instead of 1 px, which would bias the lens by
/// more than the noise does. Tags with a corner whose residual of OPENCV_FISHEYE differs from those
/// of its neighbors are outliers: near the rim a splined lens would overfit them.
///
/// The control points of a splined lens can compensate any rotation of the camera, so that its
/// frame is a convention. It is the frame of the OPENCV_FISHEYE that fits the same corners best: +Z
/// is the axis of the lens, imaged near (cx, cy), and +X is that of the image. Rays of that frame
/// fix it in the solve (BoardProblem::fixed_rays).
///
/// The alignment ends when the remaining rotation is below 0.006 degrees. It also ends after four
/// iterations, or if OPENCV_FISHEYE cannot be fitted again; the solution does not report these
/// cases. If OPENCV_FISHEYE was never fitted, the frame is the one with the smallest control
/// points.
///
/// Both poses of each view are tried with each lens, to resolve the planar pose ambiguity
/// (estimate_view_pose()). The result depends on the input only, not on threads.
IntrinsicsSolution solve_intrinsics(const IntrinsicsInput& input);

/// Views of a solve, and the results of its first stages. Stages 1 and 2 of solve_intrinsics() do
/// not depend on the lens model and serve the solves of several models. Each result is computed at
/// its first use and kept. Not for use by several threads at the same time.
class InitialSolutions {
 public:
  /// @param input  views; its lens model is ignored
  explicit InitialSolutions(IntrinsicsInput input);
  InitialSolutions(InitialSolutions&&) noexcept;
  InitialSolutions& operator=(InitialSolutions&&) noexcept;
  ~InitialSolutions();

  const IntrinsicsInput& input() const;
  /// Returns the focal lengths of rank_initial_focal_lengths(), px, the best one first.
  const std::vector<double>& focal_lengths_px() const;
  /// Estimates a lens of a model by stages 1 to 3, from the best focal length. Returns std::nullopt
  /// if there are fewer than three views or a stage fails.
  std::optional<IntrinsicsSolution> solve_first_stages(LensModel lens_model) const;

 private:
  friend IntrinsicsSolution solve_intrinsics(const InitialSolutions& initial, LensModel lens_model);
  struct Stages;
  std::unique_ptr<Stages> stages_;
};

/// Estimates a lens of a model as solve_intrinsics(input) does, from the results of its first
/// stages.
IntrinsicsSolution solve_intrinsics(const InitialSolutions& initial, LensModel lens_model);

/// Solves for every second view of a solution, beginning with view `first`, starting from that
/// solution. Estimates lens, poses and warp. Keeps from `whole` the edge shifts, the weights, the
/// outliers, and whether the warp is estimated.
/// @pre whole.has_succeeded()
IntrinsicsSolution solve_half_of_views(const IntrinsicsSolution& whole, std::size_t first);

/// Returns the residuals of the points of a problem, measured minus projected, px, including
/// outliers. NaN for points that were not seen or cannot be projected.
std::vector<Eigen::Vector2d> compute_board_residuals(const BoardProblem& problem);

}  // namespace vlp
