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

/// Least squares on residuals in the plane (pixels over their sigma) of which some are wrong:
/// Cauchy's loss, its width from the residuals' median, finds them; the last fit is plain least
/// squares without outliers: residuals beyond 4.5 standard deviations, with the limit raised for
/// few degrees of freedom (planar_outlier_bound()). Used in this folder only, as it needs Ceres'
/// headers.
class RobustFit {
 public:
  /// @param noise_is_stated  whether residuals are in units of a stated sigma. Those within 4.5 are
  ///                         then no outliers, even if the others scatter less
  explicit RobustFit(bool noise_is_stated) : noise_is_stated_(noise_is_stated) {}

  /// A residual of two rows and the parameters it depends on, which stay the caller's.
  void add(std::unique_ptr<ceres::CostFunction> cost, std::vector<double*> parameters);
  /// Keeps a parameter at its value.
  void hold(const double* parameter) { held_.push_back({parameter}); }
  /// Keeps the first of them that a residual still depends on: all of them together have a freedom
  /// that no residual shows.
  void hold_one_of(std::vector<const double*> parameters) {
    held_.push_back(std::move(parameters));
  }

  /// False when it does not converge.
  bool solve();
  /// The last fit again, from where the parameters are now.
  bool refine();
  /// Indices of the residuals that were left out, in the order in which they were added.
  std::vector<std::size_t> outliers() const;
  /// Length of each residual, the outliers among them.
  const std::vector<double>& lengths() const { return lengths_; }
  /// Rows of the residuals that are used, less the parameters that are free.
  int degrees_of_freedom() const;
  /// Derivatives of a used residual by each of its parameters, in their order; held ones too.
  struct Jacobians {
    std::size_t residual;
    std::vector<double*> parameters;
    std::vector<Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::RowMajor>> by_parameter;
  };
  std::vector<Jacobians> jacobians() const;
  /// Parameters of used residuals that the last fit held.
  std::vector<const double*> held() const;
  /// Of parameter blocks of two, for the scatter found: their block of s^2 (J^T J)^-1, a row for
  /// each of the first. Nothing when there are no more residuals than parameters, or the residuals
  /// do not determine it.
  std::optional<Matrix2> covariance(const double* parameter, const double* other) const;
  std::optional<Matrix2> covariance(const double* parameter) const {
    return covariance(parameter, parameter);
  }

 private:
  struct Block {
    std::unique_ptr<ceres::CostFunction> cost;
    std::vector<double*> parameters;
  };
  /// Where parameters are for Ceres: copies of some, the others themselves.
  struct Places {
    mutable std::vector<double> values;
    std::map<const double*, std::size_t> begins;

    template <typename Number>
    Number* of(Number* parameter) const {
      const auto begin = begins.find(parameter);
      return begin == begins.end() ? parameter : &values[begin->second];
    }
  };
  /// Copies of the parameters that are used, in the order in which residuals name them.
  Places places_in_order() const;
  std::unique_ptr<ceres::Problem> problem(double loss_width, const Places& places = {}) const;
  bool minimize(double loss_width);
  void measure();
  /// Variance of the used residuals per axis, from their median, above rounding.
  double variance() const;

  bool noise_is_stated_;
  std::vector<Block> blocks_;
  std::vector<std::vector<const double*>> held_;
  std::vector<bool> used_;
  std::vector<double> lengths_;
};

}  // namespace vlp
