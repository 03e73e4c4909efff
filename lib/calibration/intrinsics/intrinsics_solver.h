// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <set>
#include <utility>
#include <vector>

#include "calibration/intrinsics/edge_displacement.h"
#include "calibration/intrinsics/initial_board_poses.h"
#include "calibration/intrinsics/intrinsics.h"

namespace vlp {

/// Stages of solve_intrinsics(), in their order. Each returns false if it fails.
class IntrinsicsSolver {
 public:
  static constexpr std::size_t kMinViews = 3;

  explicit IntrinsicsSolver(const IntrinsicsInput& input);

  /// Stage 2: estimates the poses of all views and a STEREOGRAPHIC lens, from an initial focal
  /// length in px. Returns false if the solve fails.
  bool solve_from_focal_length(double focal_px);
  /// Splined lenses only: initializes stage 3 with the rotationally symmetric lens OPENCV_FISHEYE.
  /// Keeps the initial lens STEREOGRAPHIC if that fails.
  void initialize_with_symmetric_lens();
  /// Stage 3: solves the requested lens model with all poses and drops views that fit no pose.
  /// Returns false if the solve fails.
  bool refine_intrinsics();
  /// Splined lenses only: scales the regularization to the noise of the corners.
  bool scale_spline_regularization();
  /// Stages 4 and 7: applies correct_corners_for_curved_edges() to all views and solves again.
  bool correct_corners_and_solve_again();
  /// Stages 5 (DisplacementForm::constant) and 7 (DisplacementForm::varying): corrects the corners
  /// for estimate_tag_edge_displacements() and solves again, at most twice, until the terms of the
  /// shifts are below 0.002 px.
  bool correct_tag_edge_displacements(DisplacementForm form);
  /// Stage 6: estimates the warp of the board if WarpChoice permits it.
  bool solve_board_warp();
  /// Stage 7: weights the corners by their variances (CornerWeights) if standard deviations of some
  /// corners are known.
  bool reweight_corners();
  /// Stage 8: solves again without the outliers among the corners. Returns false if the solve
  /// fails.
  bool reject_outliers();
  /// Stage 9, splined lenses only: rotates the camera frame so that +Z is the optical axis. Returns
  /// true also if the rotation has not converged.
  bool rotate_camera_frame_to_optical_axis();

  /// Returns the current state as a solution.
  IntrinsicsSolution make_solution() const;

 private:
  /// A view of the input and a corner of it.
  using CornerOfView = std::pair<std::size_t, std::size_t>;

  Lens lens() const { return Lens(problem_.lens_model, problem_.intrinsics); }
  bool solve(SolveOptions what);
  /// Estimates the pose of every view with a lens. Views without a pose are unused until the next
  /// call.
  void initialize_board_poses(const Lens& lens);
  /// Sets up the problem of the views used, at their initial poses.
  void assemble_board_problem(const Lens& lens);
  /// Returns the index of a corner in the points of the problem; `used` is the index of its view in
  /// used_.
  std::size_t find_problem_point_index(std::size_t used, const BoardLattice::Corner& corner) const;
  /// Copies pixels and weights of the corners from the input to the problem; outliers are kept.
  void update_problem_points();
  /// Returns the RMS residual of each view used, px, in the order of used_; infinity if not finite.
  std::vector<double> compute_view_rms_px() const;
  /// Returns true if the lens projects all corners of most views. mrcal also solves for points
  /// behind the camera, and takes long.
  bool can_project_most_views() const;
  /// Returns the corners of tags with a corner whose residual differs from those of its neighbors.
  /// Skips views in which these would be more than a quarter of the corners.
  std::set<CornerOfView> find_corners_of_outlier_tags() const;
  /// If a view fits badly, re-estimates the poses of all views used and drops the worst of the
  /// views that still fit badly. Returns true if the problem has to be solved again.
  bool reestimate_board_poses();
  /// Reinstates dropped views that fit the current lens: a worse view had distorted the earlier
  /// lens. Returns true if there are any.
  bool reinstate_dropped_views();

  IntrinsicsInput input_;
  /// Mean shift by which the corners of each view of the input were corrected, px.
  std::vector<double> edge_shifts_px_;
  /// Parameters to estimate; the warp only after solve_board_warp().
  SolveOptions solved_for_{true, true, false, false};
  InitialPoses initial_poses_;
  std::vector<std::size_t> used_;
  std::vector<IntrinsicsSolution::Dropped> dropped_;
  BoardProblem problem_{};
  /// Splined lenses only: parameters of OPENCV_FISHEYE fitted to the same corners, regardless of
  /// the quality of its fit; empty if it was not fitted.
  std::vector<double> symmetric_;
  /// Splined lenses only: corners that the lens would overfit where corners are sparse. Outliers
  /// from the start.
  std::set<CornerOfView> displaced_corners_;
};

/// Returns true if all board normals lie within five degrees of each other.
bool are_all_boards_parallel(const BoardProblem& problem);

/// Calls solve(), without the distortions if the model has none.
bool solve_lens_parameters(BoardProblem& problem, SolveOptions what);

}  // namespace vlp
