// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

namespace vlp {

/// A lens evaluated by mrcal, for comparison. Model names and parameters are mrcal's. Throws
/// std::runtime_error if mrcal reports a failure.
class MrcalOracle {
 public:
  MrcalOracle(std::string model, std::vector<double> parameters);

  /// Returns mrcal_project() of each point.
  std::vector<Eigen::Vector2d> project(std::span<const Eigen::Vector3d> points) const;

  struct Gradients {
    Eigen::Matrix<double, 2, 3> d_pixel_d_point;
    Eigen::Matrix<double, 2, Eigen::Dynamic> d_pixel_d_parameters;
  };
  /// Returns the gradients of mrcal_project().
  Gradients gradients(const Eigen::Vector3d& point) const;

  /// Returns mrcal_unproject() of each pixel: rays of any length.
  std::vector<Eigen::Vector3d> unproject(std::span<const Eigen::Vector2d> pixels) const;

 private:
  std::string model_;
  std::vector<double> parameters_;
};

}  // namespace vlp
