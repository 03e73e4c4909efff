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
/// deviations; the limit is raised for few degrees of freedom (planar_outlier_bound()).
///
/// For internal use in this folder, because the header includes Ceres.
class RobustFit {
 public:
  /// @param noise_is_stated  true if the residuals are in units of a given sigma; residuals within
  ///     4.5 are then inliers even if the other residuals scatter less
  explicit RobustFit(bool noise_is_stated) : noise_is_stated_(noise_is_stated) {}

  /// Adds a residual of two rows. The caller owns `parameters`, which must outlive the fit.
  void add(std::unique_ptr<ceres::CostFunction> cost, std::vector<double*> parameters);
  /// Fixes a parameter at its value.
  void fix_parameter(const double* parameter) { fixed_.push_back({parameter}); }
  /// Fixes the first of `parameters` on which a used residual depends. Removes a degree of freedom
  /// that these parameters have in common and that no residual determines.
  void fix_one_of(std::vector<const double*> parameters) {
    fixed_.push_back(std::move(parameters));
  }

  /// Runs the robust fit, then refine(). Returns false if Ceres finds no usable solution.
  bool solve();
  /// Repeats the final fit without outliers, from the current parameters. Returns false if Ceres
  /// finds no usable solution.
  bool refine();
  /// Returns the indices of the rejected residuals, in the order of add().
  std::vector<std::size_t> outliers() const;
  /// Returns the norm of each residual, including outliers, in the order of add().
  const std::vector<double>& lengths() const { return lengths_; }
  /// Returns the number of rows of the used residuals minus the number of free parameters.
  int degrees_of_freedom() const;
  /// Derivatives of a used residual with respect to each of its parameters, including fixed ones,
  /// in the order of add().
  struct Jacobians {
    std::size_t residual;
    std::vector<double*> parameters;
    std::vector<Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::RowMajor>> d_residual_d_parameter;
  };
  /// Returns the derivatives of all used residuals.
  std::vector<Jacobians> jacobians() const;
  /// Returns the parameters of used residuals that the last fit kept fixed.
  std::vector<const double*> fixed_parameters() const;
  /// Returns the block of s^2 (J^T J)^-1 of two parameter blocks of size two. Its rows belong to
  /// `parameter`; s^2 is the variance of the residuals found. Returns std::nullopt if there are no
  /// more residual rows than parameters, if a block is fixed or unused, or if the residuals do not
  /// determine it.
  std::optional<Matrix2> covariance(const double* parameter, const double* other) const;
  std::optional<Matrix2> covariance(const double* parameter) const {
    return covariance(parameter, parameter);
  }

 private:
  struct Block {
    std::unique_ptr<ceres::CostFunction> cost;
    std::vector<double*> parameters;
  };
  /// Addresses of the parameters for Ceres: copies of those in `begins`, the original otherwise.
  struct ParameterMap {
    mutable std::vector<double> values;
    std::map<const double*, std::size_t> begins;

    template <typename Number>
    Number* address_of(Number* parameter) const {
      const auto begin = begins.find(parameter);
      return begin == begins.end() ? parameter : &values[begin->second];
    }
  };
  /// Returns copies of the used parameters, in the order in which residuals refer to them.
  ParameterMap copy_parameters() const;
  std::unique_ptr<ceres::Problem> problem(double loss_width, const ParameterMap& places = {}) const;
  bool minimize(double loss_width);
  void update_lengths();
  /// Estimates the variance of the used residuals per axis from their median. Never returns less
  /// than the numeric noise.
  double estimate_variance() const;

  bool noise_is_stated_;
  std::vector<Block> blocks_;
  std::vector<std::vector<const double*>> fixed_;
  std::vector<bool> used_;
  std::vector<double> lengths_;
};

}  // namespace vlp
