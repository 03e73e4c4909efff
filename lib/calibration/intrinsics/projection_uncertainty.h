// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "calibration/intrinsics/intrinsics.h"

namespace vlp {

/// How far the noise of the corners moves the projection of a point at infinity, as mrcal reports
/// it ("Projection uncertainty" in its documentation): the state's covariance is
///   s^2 N^-1 (Jo' Jo) N^-1,  N = J' J,
/// with J the Jacobian at the solution, Jo its rows of the corners (without those of the
/// regularization, Jr) and s the standard deviation of the residuals. A pixel depends on the
/// intrinsics and, because the camera's own orientation is what the boards make it, on the mean
/// over all boards of the changes of their rotations.
///
/// That takes the errors of all corners for independent. The corners of a tag share its edges, and
/// so their errors: each edge's fit moves both of its ends. With the lattice of the board it is,
/// instead,
///   c N^-1 (sum over tags (Jt' rt) (Jt' rt)') N^-1,  c = n / (n - k),
/// with Jt and rt the rows and residuals of a tag in a view, n their number and k that of the
/// states (Liang and Zeger, "Longitudinal data analysis using generalized linear models", 1986:
/// errors may be anything within a tag, and of any size). Of a board of squares each corner is by
/// itself.
class ProjectionUncertainty {
 public:
  /// As mrcal. Precondition: solution.ok().
  explicit ProjectionUncertainty(const IntrinsicsSolution& solution);
  /// By the board's tags. Preconditions: solution.ok(), and it is of boards of that lattice.
  ProjectionUncertainty(const IntrinsicsSolution& solution, const BoardLattice& lattice);

  /// False when the views leave something open.
  bool determined() const { return determined_; }

  /// Of the projection of the ray seen at `pixel`, in px^2. Infinite where the lens sees no ray, or
  /// when nothing is determined.
  Eigen::Matrix2d covariance(const Eigen::Vector2d& pixel) const;

  /// Standard deviation in the direction in which it is largest.
  double worst_px(const Eigen::Vector2d& pixel) const;

  /// Of the intrinsics alone; of a splined lens with zeros for its core, which no solve moves.
  Eigen::MatrixXd intrinsics_covariance() const;

  /// How much further the intrinsics would be, to first order, from where mrcal's regularization
  /// draws them (coefficients to zero, the principal point to the imager's middle), were it made
  /// for the noise s of these corners instead of BoardProblem::noise_px, a pixel here. With its
  /// residuals r
  ///   (Jo' Jo + s^2 Jr' Jr)^-1 (1 - s^2) Jr' r,  s at least 0.01 and at most 1.
  /// Zero where there is none. A standard deviation of the intrinsics that no noise explains.
  const Eigen::VectorXd& intrinsics_pull() const { return intrinsics_pull_; }

  /// Of the focal length along x. Infinite when nothing is determined, and of a splined lens, whose
  /// control points make up for it.
  double focal_sd_px() const;

 private:
  ProjectionUncertainty(const IntrinsicsSolution& solution, const BoardLattice* lattice);

  Lens lens_;
  bool determined_;
  /// Of the intrinsics and of the mean rotation, in rad, in the camera.
  Eigen::MatrixXd covariance_;
  Eigen::VectorXd intrinsics_pull_;
};

}  // namespace vlp
