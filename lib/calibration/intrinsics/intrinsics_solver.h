// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <set>
#include <utility>
#include <vector>

#include "calibration/intrinsics/edge_shift.h"
#include "calibration/intrinsics/intrinsics.h"
#include "calibration/intrinsics/pose_seeds.h"

namespace vlp {

/// The stages of solve_intrinsics(), in turn; each is false when it fails.
class IntrinsicsSolver {
 public:
  static constexpr std::size_t kLeastViews = 3;

  explicit IntrinsicsSolver(const IntrinsicsInput& input);

  /// Stage 2, from a focal length.
  bool start(double focal_px);
  /// Of a splined lens the start of stage 3, the symmetric one; no stage of others.
  void start_symmetric();
  /// Stage 3.
  bool refine();
  /// Of a splined lens, the regularization made for the noise of the corners; no stage of others.
  bool weigh_regularization();
  /// Stages 4 and 7: take_bows_of_lens().
  bool take_bows();
  /// Stages 5, even ones, and 7: what edge_shifts() finds, twice at most, until it is below 0.002
  /// px.
  bool take_out_shifts(ShiftForm form);
  /// Stage 6: the warp of the board, if it is to be.
  bool bend();
  /// Stage 7: corners weighted by what they are good for (CornerWeights), when images tell it of
  /// some.
  bool weigh_corners();
  /// Stage 8.
  bool leave_out_outliers();
  /// Stage 9, of a splined lens: true also when the turn has not settled.
  bool turn_to_axis();

  IntrinsicsSolution solution() const;

 private:
  /// A view of the input and a corner of it.
  using CornerOfView = std::pair<std::size_t, std::size_t>;

  Lens lens() const { return Lens(problem_.lens_model, problem_.intrinsics); }
  bool solve(SolveFor what);
  /// Poses of every view through this lens; views without one wait for another lens.
  void seed(const Lens& lens);
  /// The problem of the views used, at their seeds.
  void assemble(const Lens& lens);
  /// Of the problem, by a view's place in used_.
  std::size_t point_of(std::size_t used, const BoardLattice::Corner& corner) const;
  /// Where the corners of the input are now, and what they weigh.
  void move_points();
  /// Of the views used, in their order.
  std::vector<double> rms_of_views() const;
  /// Whether the lens can see all corners of most views. mrcal solves for points behind the camera,
  /// too, and goes on for long.
  bool sees_most() const;
  /// Of the views used, the corners that lie elsewhere than their neighbours in their residuals.
  std::set<CornerOfView> slips() const;
  /// Tries both poses of each view that fits badly, and drops the worst of those that stay bad.
  /// True when there is something to solve again.
  bool change_poses();
  /// Views that were dropped because a worse one had spoilt the lens, and that fit it now.
  bool take_back();

  IntrinsicsInput input_;
  /// What was taken out of the views of the input.
  std::vector<double> edge_shifts_px_;
  /// The warp only after bend().
  SolveFor solved_for_{true, true, false, false};
  PoseSeeds seeds_;
  std::vector<std::size_t> used_;
  std::vector<IntrinsicsSolution::Dropped> dropped_;
  BoardProblem problem_{};
  /// Of a splined lens, the parameters of OPENCV_FISHEYE for the same corners, however well it fits
  /// them; empty when it was not solved for.
  std::vector<double> symmetric_;
  /// Of a splined lens, corners that it would bend to where they are few: outliers from the start.
  std::set<CornerOfView> slips_;
};

/// No two boards are tilted differently, by five degrees or more.
bool all_alike(const BoardProblem& problem);

/// solve(), without the distortions of a model that has none.
bool solve_for_lens(BoardProblem& problem, SolveFor what);

}  // namespace vlp
