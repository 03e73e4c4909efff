// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "geometry/frames.h"

namespace vlp {

/// A fix of a camera that turns on the spot.
struct TurningFix {
  Pose pose;
  /// Of the lamps over the camera.
  double height_m;
  /// Index of the spot.
  std::size_t spot;
};

/// What the fixes tell of the turning: fix_k = A_spot + e^{jg_k} (e + H_k delta).
struct Turning {
  std::vector<Eigen::Vector2d> axes_m;
  Eigen::Vector2d lever_arm_m;
  /// What the normalized points lack: the true zenith is seen at -delta.
  Eigen::Vector2d delta;
  /// Distance of each fix from where the turning puts it.
  std::vector<double> residuals_m;
};

/// Least squares with Cauchy weights, so that single wrong fixes do not matter. With `lever_arm`
/// false it is zero, and all goes into delta. Where the fixes do not determine the answer, it is
/// the one of least length.
Turning fit_turning(std::span<const TurningFix> fixes, std::size_t spots, bool lever_arm);

/// The full turn less the widest gap between neighbouring angles; zero for fewer than two.
double arc_of(std::vector<double> angles_rad);

}  // namespace vlp
