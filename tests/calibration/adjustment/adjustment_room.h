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
#include "calibration/adjustment/adjustment_problem.h"

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
  /// `noise_px`, and known positions with errors below their standard deviations. Returns the
  /// problem of this input in the state of the ground truth.
  AdjustmentProblem make_problem(double sigma_px, double noise_px);

  /// Solves without outliers. The noise scale is at least `min_scale`; it is increased to the
  /// residuals until it changes by 1 % at most.
  static AdjustmentProblem::GlobalCovariance solve_with_noise(AdjustmentProblem& problem,
                                                              double min_scale);

  /// Returns the sum of the squared whitened residuals.
  static double sum_squares(const AdjustmentProblem& problem);

  /// Returns the matrix from the state to intrinsics, zenith, lever arm and lamps.
  static Eigen::MatrixXd parameters_from_state(const AdjustmentProblem& problem);

  const Eigen::Vector3d kOrigin_m{12, -7, 2};
  const Eigen::Vector2d kArm_m{0.03, -0.02};
  AdjustmentInput input;
  std::vector<Pose> true_poses;
  std::vector<Eigen::Vector3d> true_lamps_m;

 private:
  void add_at_pivot(const std::string& pivot, const Eigen::Vector3d& axis_m, double yaw_rad,
                    const std::optional<KnownPosition>& place);
  void add(const std::string& name, const Pose& camera, const std::optional<KnownPosition>& place);
  /// Adds the detections of the five lamps in view to problem and input. Capture 3 lacks a lamp.
  void add_sightings(AdjustmentProblem& problem, std::size_t capture, double sigma_px,
                     double noise_px);
};

}  // namespace vlp
