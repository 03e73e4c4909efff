// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ceres/ceres.h>

#include <Eigen/Core>
#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "geometry/types.h"

namespace vlp {

/// Robust least-squares problem with residuals in the plane, in pixels divided by their sigma.
///
/// A Cauchy loss, whose width follows from the median of the residuals, identifies outliers. The
/// final fit is plain least squares without outliers. Outliers are residuals beyond 4.5 standard
/// deviations; the limit is raised for few degrees of freedom (compute_squared_outlier_bound_2d()).
///
/// For internal use in this folder, because the header includes Ceres.
class RobustFit {
 public:
  /// Creates an empty problem.
  /// @param noise_is_stated  true if the residuals are divided by a given sigma; residuals within
  ///     4.5 are then inliers even if the other residuals scatter less
  explicit RobustFit(bool noise_is_stated) : noise_is_stated_(noise_is_stated) {}

  /// Adds a residual with two components, a function of `parameters`. The caller owns `parameters`,
  /// which must outlive the fit.
  void add_residual_block(std::unique_ptr<ceres::CostFunction> cost,
                          std::vector<double*> parameters);
  /// Fixes a parameter at its value.
  void set_parameter_constant(const double* parameter) { fixed_.push_back({parameter}); }
  /// Fixes the first of `parameters` on which a used residual depends. Removes a degree of freedom
  /// that these parameters have in common and that no residual determines.
  void set_first_used_parameter_constant(std::vector<const double*> parameters) {
    fixed_.push_back(std::move(parameters));
  }

  /// Runs the robust fit, then refine_fit_without_outliers(). Returns false if Ceres finds no
  /// usable solution.
  bool solve_robust_fit();
  /// Repeats the final fit without outliers, from the current parameters. Returns false if Ceres
  /// finds no usable solution.
  bool refine_fit_without_outliers();
  /// Returns, for each residual in the order of add_residual_block(), true if it is used and false
  /// if it is rejected.
  const std::vector<bool>& residual_inlier_flags() const { return used_; }
  /// Returns the norm of each residual, including outliers, in the order of add_residual_block().
  const std::vector<double>& residual_norms() const { return lengths_; }
  /// Returns the number of rows of the used residuals minus the number of free parameters.
  int degrees_of_freedom() const;

  /// Used residuals and unknowns at the solution.
  struct Linearization {
    /// Used residual: its index in the order of add_residual_block(), and its derivatives with
    /// respect to `unknowns`, including fixed ones.
    struct Residual {
      std::size_t index;
      std::vector<Eigen::Index> unknowns;
      Eigen::Matrix2Xd jacobian;
    };
    std::vector<Residual> residuals;
    /// Index of the first unknown of each parameter, in the order in which residuals refer to them.
    std::map<const double*, Eigen::Index> first_unknown;
    /// Inverse (J^T J)^-1 of the normal equations; zero for fixed unknowns.
    Eigen::MatrixXd inverse;
    /// Variance of the used residuals per component, in the units of the residuals squared.
    double variance;

    /// Returns the covariance s^2 (J^T J)^-1 of two parameters of size two. Its rows belong to
    /// `parameter`.
    Matrix2 covariance(const double* parameter, const double* other) const {
      return variance * inverse.block<2, 2>(first_unknown.at(parameter), first_unknown.at(other));
    }
  };
  /// Linearizes the used residuals. Returns std::nullopt if there are no more residual rows than
  /// parameters, or if the residuals do not determine the parameters.
  std::optional<Linearization> linearize_used_residuals() const;

 private:
  struct Block {
    std::unique_ptr<ceres::CostFunction> cost;
    std::vector<double*> parameters;
  };
  std::unique_ptr<ceres::Problem> make_ceres_problem(double loss_width) const;
  bool minimize_residuals_with_cauchy_loss(double loss_width);
  void update_residual_norms();
  /// Estimates the variance of the used residuals per axis from their median. Never returns less
  /// than the numeric noise.
  double estimate_residual_variance() const;

  bool noise_is_stated_;
  std::vector<Block> blocks_;
  std::vector<std::vector<const double*>> fixed_;
  std::vector<bool> used_;
  std::vector<double> lengths_;
};

}  // namespace vlp
