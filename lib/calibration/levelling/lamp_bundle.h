// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "geometry/types.h"
#include "positioning/positioner.h"
#include "positioning/sighting.h"

namespace vlp {

/// What many captures of the same lamps tell of the camera's tilt and of the lamp map: a bundle
/// adjustment. A capture k with the level pose (S_k, g_k) sees lamp P_i in the camera at
///   z_ik = (x/z, y/z)  of  level_from_camera^T Rz(-g_k) (P_i - S_k),
/// so that every capture has four unknowns of its own, and all share the tilt (the rotation of
/// the level frame about its x and y axes; about z it is the yaw) and the lamps. Of a camera that
/// drives with u and turns with w the lamp is read at t after the middle of the image, and is then
///   level_from_camera^T Rz(-w t) (Rz(-g_k) (P_i - S_k) - u t);
/// what is not known of u and w is the capture's own, too, with what is known for a prior.
struct LampBundle {
  struct Observation {
    /// Index into lamps_m.
    std::size_t lamp;
    /// Measured, in the camera's undistorted plane.
    Eigen::Vector2d z_in_camera;
    /// Takes residuals of z to standard deviations.
    Matrix2 whitening;
    /// When it is read.
    double time_s;
  };
  struct Capture {
    LevelPose camera;
    std::vector<Observation> seen;
    /// What is known of u and w, and what they are taken to be.
    KnownMotion known = {};
    Eigen::Vector2d velocity_m_per_s = known.velocity_m_per_s;
    double yaw_rate_rad_per_s = known.yaw_rate_rad_per_s;
  };

  Eigen::Matrix3d level_from_camera;
  std::vector<Eigen::Vector3d> lamps_m;
  std::vector<Capture> captures;
};

/// Measured less predicted z, whitened; not finite when the lamp is not in front of the camera.
Eigen::Vector2d whitened_residual(const LampBundle& bundle, const LampBundle::Capture& capture,
                                  const LampBundle::Observation& seen);

struct BundleFit {
  /// Sum of the squared whitened residuals, those of motions that are known in part among them.
  double chi_squared;
  /// Measurements, such motions among them, less unknowns.
  int degrees_of_freedom;
  /// Those of the sightings alone: less by what they tell of motions. The same where all is known.
  double redundancy;
  /// Of (tilt about x and y, then x, y, z of each lamp) when the whitened residuals have unit
  /// variance; zero along what `free` holds.
  Eigen::MatrixXd covariance;
  /// Effect of errors of a map that is held, with N the information of (tilt t, lamps l) without
  /// the poses: d tilt / d lamps = -N_tt^-1 N_tl, and what an error of a lamp along an axis adds to
  /// chi_squared over its square, the diagonal of N_ll - N_lt N_tt^-1 N_tl.
  Eigen::MatrixXd d_tilt_d_lamps;
  Eigen::VectorXd d_chi_squared_d_lamp_squares;
};

/// Moves `bundle` to the least sum of squared whitened residuals: Gauss-Newton, the captures' own
/// unknowns eliminated block by block (Schur complement), steps halved where they do not help.
/// `free` has a row for each of (tilt, lamps) as in the covariance, and its orthonormal columns
/// are the directions in which they may move. Nothing when those are not determined, to rounding,
/// or 50 steps do not converge.
std::optional<BundleFit> adjust(LampBundle& bundle, const Eigen::MatrixXd& free);

}  // namespace vlp
