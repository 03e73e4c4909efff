// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <array>
#include <vector>

#include "camera/lens_model.h"

namespace vlp {

/// Where a board is: x_in_camera = R(rotation) x_in_board + translation_m, with the rotation's axis
/// times its angle.
struct BoardPose {
  Eigen::Vector3d rotation;
  Eigen::Vector3d translation_m;
};

/// A camera and the boards that it saw, as mrcal solves for them (mrcal documentation,
/// "Formulation"): boards are uniform lattices of cols x rows points, spacing_m apart, bent by
///   z = warp_m.x (1 - (2 i / (cols - 1) - 1)^2) + warp_m.y (1 - (2 j / (rows - 1) - 1)^2).
struct BoardProblem {
  LensModel lens_model;
  std::vector<double> intrinsics;
  std::array<int, 2> imager_px;
  int cols, rows;
  double spacing_m;
  Eigen::Vector2d warp_m = Eigen::Vector2d::Zero();
  std::vector<BoardPose> poses;
  /// u_px, v_px, weight; row by row, pose by pose. The weight is what the residual is multiplied
  /// by; kUnseen, or another below 0 for an outlier. Every pose needs four points or more, not on a
  /// line.
  std::vector<Eigen::Vector3d> points;
  static constexpr double kUnseen = -1e9;  // weights are 1000 at most
  /// Of the corners, for which the regularization is made: of a pixel, as mrcal makes it. Of
  /// corners that are better known its share of all squares would be the larger, and draw the lens
  /// off.
  double noise_px = 1;
  /// Rays in the camera and where the lens has to see them, each as good as a corner: they hold the
  /// frame of a splined lens, whose control points make up for any turn of it.
  struct Held {
    Eigen::Vector2d pixel;
    Eigen::Vector3d ray;
  };
  std::vector<Held> held = {};

  std::size_t points_of_a_board() const {
    return static_cast<std::size_t>(cols) * static_cast<std::size_t>(rows);
  }
};

/// Of the points that are no outliers.
std::vector<Eigen::Vector2d> seen_px(const BoardProblem& problem);

/// What a solve may change besides the poses.
struct SolveFor {
  bool core = false;         // fx fy cx cy
  bool distortions = false;  // regularized, as mrcal does it
  bool warp = false;
  bool without_outliers = false;  // gives outliers a negative weight
};

/// Minimizes the residuals in place, by mrcal_optimize, or by Ceres for the models that mrcal does
/// not have: without regularization, outliers beyond 5 sigmas. By Ceres, too, where mrcal goes from
/// a lens that sees all points to one that does not, unless that fits worse: the quotient of
/// OPENCV8 and OPENCV12 can have poles between the points and fit them all the same, which mrcal's
/// steps go over; Ceres takes no step to a lens that does not see a point. False when it fails:
/// points that no lens of the model can see there, too few for the unknowns, or a focal length that
/// is not above 0.
bool solve(BoardProblem& problem, const SolveFor& what);

/// The problem at its solution. State and Jacobian are packed: the state is divided by `scale`, so
/// that its entries are of like size.
struct Linearization {
  /// Of the points, u and v in turn, in their order, weighted; 0 for those with a negative weight.
  Eigen::VectorXd residuals_px;
  /// Of the regularization; none of the models that mrcal does not have.
  Eigen::VectorXd regularization;
  /// A column for each row of the Jacobian: of the points first, then of the regularization.
  Eigen::SparseMatrix<double> jacobian_transposed;
  /// State / packed state.
  Eigen::VectorXd scale;
  /// The intrinsics come first in the state, those from `first_intrinsic` on; where the poses (6
  /// each) begin, and the warp after them.
  Eigen::Index first_intrinsic, poses;
};
Linearization linearized(const BoardProblem& problem, const SolveFor& what);

/// Both, by either.
bool has_mrcal(LensModel model);
bool solve_by_mrcal(BoardProblem& problem, const SolveFor& what);
bool solve_by_ceres(BoardProblem& problem, const SolveFor& what);
Linearization linearized_by_mrcal(const BoardProblem& problem, const SolveFor& what);
/// The intrinsics are solved for, the warp where `what` says so.
Linearization linearized_by_us(const BoardProblem& problem, const SolveFor& what);

}  // namespace vlp
