// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "geometry/types.h"
#include "positioning/sighting.h"

namespace vlp {

/// What many captures of the same lamps tell of the camera's tilt and of the lamp map: a bundle
/// adjustment. A capture k with the level pose (S_k, g_k) sees lamp P_i in the camera at
///   z_ik = (x/z, y/z)  of  level_from_camera^T Rz(-g_k) (P_i - S_k),
/// so that every capture has four unknowns of its own, and all share the tilt (the rotation of
/// the level frame about its x and y axes; about z it is the yaw) and the lamps.
struct LampBundle {
  struct Seen {
    /// Index into lamps_m.
    std::size_t lamp;
    /// Measured, in the camera's undistorted plane.
    Eigen::Vector2d z_in_camera;
    /// Takes residuals of z to standard deviations.
    Matrix2 whitening;
  };
  struct Capture {
    LevelPose camera;
    std::vector<Seen> seen;
  };

  Eigen::Matrix3d level_from_camera;
  std::vector<Eigen::Vector3d> lamps_m;
  std::vector<Capture> captures;
};

/// Measured less predicted z, whitened; not finite when the lamp is not in front of the camera.
Eigen::Vector2d whitened_residual(const LampBundle& bundle, const LampBundle::Capture& capture,
                                  const LampBundle::Seen& seen);

struct BundleFit {
  /// Sum of the squared whitened residuals.
  double chi_squared;
  /// Measurements less unknowns.
  int degrees_of_freedom;
  /// Of (tilt about x and y, then x, y, z of each lamp) when the whitened residuals have unit
  /// variance; zero along what `free` holds.
  Eigen::MatrixXd covariance;
};

/// Moves `bundle` to the least sum of squared whitened residuals: Gauss-Newton, the captures' own
/// unknowns eliminated block by block (Schur complement), steps halved where they do not help.
/// `free` has a row for each of (tilt, lamps) as in the covariance, and its orthonormal columns
/// are the directions in which they may move. Nothing when those are not determined, to rounding,
/// or 50 steps do not converge.
std::optional<BundleFit> adjust(LampBundle& bundle, const Eigen::MatrixXd& free);

}  // namespace vlp
