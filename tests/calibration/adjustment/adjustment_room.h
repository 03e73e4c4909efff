// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "calibration/adjustment/adjustment.h"
#include "camera/lens.h"

namespace vlp {

/// Lamps with ids 11 to 16 and captures of a rolling shutter camera beside its axis, far from the
/// origin of the world. Two captures rotate at pivot "b", three at pivot "a". The last lamp is in
/// no capture. The second lamp is exact.
class AdjustmentRoom : public testing::Test {
 protected:
  static constexpr std::size_t kLamps = 6;

  AdjustmentRoom();

  /// Multiplies errors and standard deviations of the survey by a factor.
  void scale_survey(double factor);

  /// Measures the input from the ground truth: detections with `sigma_px` and errors up to
  /// `noise_px`, and known positions with errors below their standard deviations.
  void measure(double sigma_px, double noise_px);

  /// Solution of the equations of adjustment.h by one dense matrix.
  struct Solution {
    /// Intrinsics, zenith, lever arm and the five lamps in view, with their covariance. The exact
    /// lamp has none.
    Eigen::VectorXd parameters;
    Eigen::MatrixXd covariance;
    /// Correction of the lens in standard deviations along each direction, with its covariance.
    Eigen::Vector3d lens;
    Eigen::Matrix3d lens_covariance;
    /// Adjusted minus measured position of each known position: mean over its captures.
    std::vector<Eigen::Vector3d> position_residuals_m;
    double noise_scale, degrees_of_freedom;
    /// Square root of the mean square of the whitened residuals per degree of freedom.
    double residual;
    double lamp_height_m;
  };
  /// Solves without outliers. The noise scale is at least `min_scale`; it is increased to the
  /// residuals until it changes by 1 % at most. If given, `whitening` converts the residual of each
  /// detection in px to one in standard deviations, in the order of the input.
  Solution solve(double min_scale, const std::vector<Eigen::Matrix2d>& whitening = {}) const;

  const Eigen::Vector3d kOrigin_m{12, -7, 2};
  AdjustmentInput input;
  std::vector<Eigen::Vector3d> true_lamps_m;

 private:
  /// Values of the unknowns.
  struct State {
    Eigen::Vector3d lens;
    Eigen::Vector2d zenith, arm_m;
    std::vector<Eigen::Vector3d> lamps_m;
    /// Position of the axis at a pivot, otherwise of the camera.
    std::vector<Pose> poses;
    std::vector<Eigen::Vector2d> velocities_m_per_s;
    std::vector<double> yaw_rates_rad_per_s;
  };
  State make_true_state() const;
  /// Returns the estimated unknowns of a state, or the state with these unknowns.
  Eigen::VectorXd pack(const State& state) const;
  State unpack(const Eigen::VectorXd& unknowns) const;
  template <typename Visit>
  void visit_unknowns(State& state, const Visit& visit) const;

  Eigen::VectorXd compute_intrinsics(const State& state) const;
  Lens make_lens(const State& state) const;
  Eigen::Vector2d predict_pixel(const State& state, const Lens& lens, std::size_t capture,
                                const Detection& detection) const;
  Eigen::Vector3d predict_position(const State& state, std::size_t capture) const;
  /// Returns the whitened residuals, those of the detections first.
  Eigen::VectorXd compute_residuals(const State& state, double noise_scale,
                                    const std::vector<Eigen::Matrix2d>& whitening) const;
  void add(const std::string& name, const std::string& pivot, const Pose& pose,
           const std::optional<KnownPosition>& place);

  std::vector<Pose> true_poses_;
  Eigen::MatrixXd lens_root_ = Eigen::MatrixXd::Zero(12, 3);
};

}  // namespace vlp
