// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <array>
#include <vector>

#include "camera/lens_model.h"

namespace vlp {

/// Pose of a board: x_in_camera = R(rotation) x_in_board + translation_m. `rotation` is a rotation
/// vector: axis times angle, rad.
struct BoardPose {
  Eigen::Vector3d rotation;
  Eigen::Vector3d translation_m;
};

/// Lens, board and poses of the board in all views, with the measured points, in the formulation of
/// mrcal (mrcal documentation, "Formulation"). The board is a lattice of cols x rows points at
/// spacing_m in x and y. A board in four parts (BoardLattice) counts as four boards, each with
/// poses of its own. The warp, in m, is
///   z = warp_m.x (1 - (2 i / (cols - 1) - 1)^2) + warp_m.y (1 - (2 j / (rows - 1) - 1)^2)
/// at column i and row j.
struct BoardProblem {
  LensModel lens_model;
  std::vector<double> intrinsics;
  std::array<int, 2> imager_px;
  int cols, rows;
  double spacing_m;
  Eigen::Vector2d warp_m = Eigen::Vector2d::Zero();
  std::vector<BoardPose> poses;
  /// Measured points (u_px, v_px, weight), row by row, pose by pose. The residual is multiplied by
  /// the weight. A point that was not seen has the weight kUnseen, an outlier another negative
  /// weight. Every pose needs at least four points that are not on a line.
  std::vector<Eigen::Vector3d> points;
  static constexpr double kUnseen = -1e9;  // weights are 1000 at most
  /// Corner noise for which the regularization is scaled, px; the default is that of mrcal. With
  /// more accurate corners the regularization would be a larger fraction of the sum of squares and
  /// bias the lens.
  double noise_px = 1;
  /// Ray in the camera frame and the pixel to which the lens has to project it, weighted like a
  /// corner. Such rays fix the frame of a splined lens, whose control points can compensate any
  /// rotation.
  struct FixedRay {
    Eigen::Vector2d pixel;
    Eigen::Vector3d ray;
  };
  std::vector<FixedRay> fixed_rays = {};

  std::size_t points_per_board() const {
    return static_cast<std::size_t>(cols) * static_cast<std::size_t>(rows);
  }
};

/// Returns the measured pixels of the points that are not outliers.
std::vector<Eigen::Vector2d> list_inlier_pixels(const BoardProblem& problem);

/// Parameters that a solve may change in addition to the poses.
struct SolveOptions {
  bool core = false;         // fx fy cx cy
  bool distortions = false;  // if the model has any; regularized as in mrcal
  bool warp = false;
  bool reject_outliers = false;  // gives outliers a negative weight
};

/// Minimizes the residuals in place: by mrcal_optimize, or by Ceres for models that mrcal lacks.
/// Ceres regularizes as mrcal does, except for models that mrcal lacks. It rejects outliers beyond
/// 5 sigma.
///
/// Ceres also replaces mrcal if mrcal goes from a lens that projects all points to one that does
/// not. The result of mrcal is kept if the RMS residual of Ceres is more than 5 % larger. Reason:
/// the rational functions of OPENCV8 and OPENCV12 can have poles between the points and still fit.
/// The steps of mrcal cross such poles. Ceres rejects steps to a lens that does not project a
/// point.
///
/// @return false if the solve fails: no lens of the model can project the points, too few points
///     for the unknowns, or a focal length that is not positive
bool solve_board_problem(BoardProblem& problem, SolveOptions solve_options);

/// Minimizes the same sum faster, without rejecting outliers and with a larger tolerance, for a
/// result that a later solve refines. Uses Ceres; calls solve_board_problem() for splined lenses or
/// if Ceres fails.
/// @pre solve_options.core, unless the lens is splined
/// @return false if the solve fails
bool solve_intermediate_stage(BoardProblem& problem, SolveOptions solve_options);

/// Residuals and Jacobian of a problem. State and Jacobian are packed: the state is divided by
/// `scale`, so that its entries have similar magnitudes.
struct Linearization {
  /// Weighted residuals of the points in their order, u and v alternating, px; 0 for points with a
  /// negative weight.
  Eigen::VectorXd residuals_px;
  /// Residuals of the regularization; empty for models that mrcal lacks.
  Eigen::VectorXd regularization;
  /// Transposed Jacobian with a column per residual: those of the points first, then the
  /// regularization.
  Eigen::SparseMatrix<double> jacobian_transposed;
  /// Ratio of the state to the packed state, element by element.
  Eigen::VectorXd scale;
  /// First intrinsic parameter in the state, which begins with the intrinsics; index of the poses
  /// in the state (6 entries each). The warp follows the poses.
  Eigen::Index first_intrinsic, poses;
};
/// Linearizes a problem at its current parameters.
Linearization linearize_board_problem(const BoardProblem& problem,
                                      const SolveOptions& solve_options);

/// Returns true if mrcal has the lens model.
bool can_mrcal_solve(LensModel model);
/// Implementations of solve_board_problem() and linearize_board_problem() by mrcal and by Ceres.
bool solve_by_mrcal(BoardProblem& problem, const SolveOptions& solve_options);
bool solve_by_ceres(BoardProblem& problem, const SolveOptions& solve_options);
Linearization linearize_by_mrcal(const BoardProblem& problem, const SolveOptions& solve_options);
/// Linearizes with analytic Jacobians, with respect to all intrinsics and poses, and to the warp if
/// solve_options.warp.
Linearization linearize_analytically(const BoardProblem& problem,
                                     const SolveOptions& solve_options);

}  // namespace vlp
