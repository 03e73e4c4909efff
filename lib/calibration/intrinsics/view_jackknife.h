// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "calibration/intrinsics/intrinsics.h"

namespace vlp {

/// Normal equations of each view of a solution in the parameters common to all views, intrinsics
/// and warp, with the poses of the view eliminated.
struct ViewEquations {
  struct View {
    Eigen::MatrixXd normal;
    Eigen::VectorXd gradient;
    /// Sum of the squared residuals of the view, px^2, and their number.
    double squares, count;
  };

  /// @pre solution.has_succeeded()
  ViewEquations(const IntrinsicsSolution& solution);  // NOLINT(google-explicit-constructor)

  std::vector<View> views;
  /// Sum of the normal matrices of all views and of the regularization.
  Eigen::MatrixXd normal;
  /// Ratio of the estimated intrinsics, the last ones of the model, to those of the equations.
  Eigen::VectorXd scale;
  Eigen::Index num_intrinsics;
};

/// Estimates the covariance of the intrinsics, in the order of the lens model, by leaving out one
/// view at a time:
///   (n - 1) / n sum over views (d_v - mean d) (d_v - mean d)'
///   n    number of views
///   d_v  change of the intrinsics without view v, to first order; poses and warp change with them
/// Source: Efron, "The Jackknife, the Bootstrap and Other Resampling Plans", 1982.
///
/// @return infinite elements if the remaining views do not determine a lens
///
/// ProjectionUncertainty assumes independent errors of tags or of corners. This estimate assumes
/// independence of views only. It includes errors common to the corners of a view: a varying warp
/// of the board, a rolling shutter, a lens model that does not fit. With few views it is imprecise,
/// by a relative 1 / sqrt(2 (n - 1)), and often too large.
Eigen::MatrixXd jackknife_covariance(const ViewEquations& equations);

/// Estimates the mean squared residual per axis of each view, px^2, for a lens that is solved
/// without the block of the view, to first order. The pose of the view is fitted. View i of n is in
/// block i blocks / n, rounded down.
///
/// Without the block, lens and warp change by d = (sum of N outside the block)^-1 (sum of g in the
/// block), with the normal matrix N and the gradient g of each view. The sum of squares of the view
/// changes by 2 d' g + d' N d.
/// @return infinity for a view if the views outside its block do not determine a lens
std::vector<double> compute_left_out_squares_px2(const ViewEquations& equations,
                                                 std::size_t blocks);

}  // namespace vlp
