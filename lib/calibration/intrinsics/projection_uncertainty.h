// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "calibration/intrinsics/intrinsics.h"

namespace vlp {

/// Uncertainty of the projection of a point at infinity from the noise of the corners, as mrcal
/// reports it ("Projection uncertainty" in its documentation). The covariance of the state is
///   s^2 N^-1 (Jo' Jo) N^-1,  N = J' J,
/// with
///   J   Jacobian at the solution
///   Jo  its rows of the corners, without those of the regularization, Jr
///   s   standard deviation of the residuals
/// A pixel depends on the intrinsics and on the mean, over all boards, of the changes of their
/// rotations: the boards define the orientation of the camera.
///
/// This assumes independent errors of all corners. The corners of a tag share its edges and
/// therefore have correlated errors: the fit of an edge moves both of its ends. With the lattice of
/// the board, the covariance is instead
///   c N^-1 (sum over tags (Jt' rt) (Jt' rt)') N^-1,  c = n / (n - k),
/// with
///   Jt, rt  rows and residuals of a tag in a view
///   n, k    number of residuals, number of states
/// (Liang and Zeger, "Longitudinal data analysis using generalized linear models", 1986). Errors
/// within a tag may then have any correlation and size. On a board of squares each corner is its
/// own group.
class ProjectionUncertainty {
 public:
  /// Computes the covariances of a solution, assuming that the errors of all corners are
  /// independent, as mrcal does.
  /// @pre solution.has_succeeded()
  explicit ProjectionUncertainty(const IntrinsicsSolution& solution);
  /// Computes the covariances of a solution, allowing for correlated errors of the corners of a
  /// tag.
  /// @pre solution.has_succeeded(), with boards of that lattice
  ProjectionUncertainty(const IntrinsicsSolution& solution, const BoardLattice& lattice);

  /// Returns false if the views do not determine all parameters.
  bool is_determined() const { return is_determined_; }

  /// Returns the covariance of the projection of the ray at `pixel`, px^2. Infinite if the lens has
  /// no ray there, or if the views do not determine all parameters.
  Eigen::Matrix2d projection_covariance(const Eigen::Vector2d& pixel) const;

  /// Returns the standard deviation in the direction in which it is largest, px.
  double worst_direction_sd_px(const Eigen::Vector2d& pixel) const;

  /// Returns the covariance of the intrinsics; 0 for the core of splined lenses, which is not
  /// estimated.
  Eigen::MatrixXd intrinsics_covariance() const;

  /// Returns the bias of the intrinsics by mrcal's regularization, to first order.
  ///
  /// The regularization pulls coefficients to zero and the principal point to the middle of the
  /// imager. The regularization is scaled to BoardProblem::noise_px, here 1 px. The bias is the
  /// change of the intrinsics if it were scaled to the noise s of these corners. With the residuals
  /// r of the regularization it is
  ///   (Jo' Jo + s^2 Jr' Jr)^-1 (1 - s^2) Jr' r,  s at least 0.01 and at most 1.
  /// 0 without regularization. Use it as a standard deviation of the intrinsics in addition to that
  /// from noise.
  const Eigen::VectorXd& regularization_bias() const { return regularization_bias_; }

  /// Returns the standard deviation of the focal length along x, px. Infinite if the views do not
  /// determine all parameters, and for splined lenses, whose control points compensate the focal
  /// length.
  double focal_x_sd_px() const;

  /// Uncertainties of a solution for both assumptions.
  struct ByCornersAndByTags;
  /// Computes both uncertainties from one linearization, which takes most of the time.
  /// @pre solution.has_succeeded(), with boards of that lattice
  static ByCornersAndByTags compare_corners_and_tags(const IntrinsicsSolution& solution,
                                                     const BoardLattice& lattice);

 private:
  struct Sensitivity;
  ProjectionUncertainty(const IntrinsicsSolution& solution, const Sensitivity& sensitivity,
                        const BoardLattice* lattice);

  Lens lens_;
  bool is_determined_;
  /// Covariance of the intrinsics and of the mean rotation, rad, in the camera frame.
  Eigen::MatrixXd covariance_;
  Eigen::VectorXd regularization_bias_;
};

struct ProjectionUncertainty::ByCornersAndByTags {
  /// For independent corners; for correlated errors within tags.
  ProjectionUncertainty by_corners, by_tags;
};

}  // namespace vlp
