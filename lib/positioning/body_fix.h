// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "../geometry/frames.h"
#include "fix.h"
#include "robot.h"

/// The fix of a body that drives, turns and leans while the shutter reads. The body is the robot,
/// with the camera at `arm_in_body_m`, or the camera itself, with no arm. At the time 0, the middle
/// of the exposure of the image's middle row, it stands at R with yaw g; u is its velocity in its
/// level frame, w its yaw rate, L = Ry(pitch) Rx(roll) its lean. A lamp P that is read at the time
/// t stands, seen from the camera and along the axes of the body, at
///   q = L^T Rz(-w t) (Rz(-g) (P - R) - u t) - arm,
/// which for a camera that stands level is the positioning equation (sighting.h). The velocity is
/// one in the plane: bodies do not climb. One image shows it: motion along the read-out stretches
/// the lamps' picture one way, motion across it shears it, and a camera that stands level can do
/// neither. Three lamps that are not in one line tell two of velocity, turn and lean, with more
/// lamps all.
namespace vlp {

/// What is unknown of a body besides R and g, which always are.
struct BodyMotion {
  /// u, in the body's level frame.
  Eigen::Vector2d velocity_m_per_s{0, 0};
  double yaw_rate_rad_per_s = 0;
  Inclination inclination{0, 0};
};

struct BodyState {
  Pose pose{{0, 0, 0}, 0};
  BodyMotion motion = {};
};

/// What is known before the lamps are seen: each state is normal about `mean`, with its standard
/// deviation per component. 0: it is as given, and not estimated.
struct BodyPrior {
  BodyMotion mean;
  double velocity_sd_m_per_s = 0;
  double yaw_rate_sd_rad_per_s = 0;
  double inclination_sd_rad = 0;
  /// Of R.
  std::optional<KnownHeight> height = {};
};

/// A lamp of the map as the camera saw it.
struct BodySighting {
  /// P, in the world.
  Eigen::Vector3d lamp_m;
  /// Towards it, along the axes of the body; unit length.
  Eigen::Vector3d ray;
  /// M: the pixel is off by M q / (ray . q), in standard deviations. M ray = 0.
  Eigen::Matrix<double, 2, 3, Eigen::DontAlign> whitened_pixel_from_ray;
  double sigma_px;
  /// When its centre is read.
  double time_s;
};

/// M of a pixel with that standard deviation and that derivative of its ray (any length). Nothing
/// where the lens has no inverse.
std::optional<Eigen::Matrix<double, 2, 3>> whitened_pixel_from_ray(
    const Eigen::Vector3d& ray, const Eigen::Matrix<double, 3, 2>& d_ray_d_pixel, double sigma_px);

struct BodyFix {
  BodyState state;
  /// In metres, radians and seconds; zero for states that are as given.
  BodyCovariance covariance = BodyCovariance::Zero();
  /// Of pixels and priors, over their variances: its mean is 2n - 4, with a known height 2n - 3.
  double chi_squared = 0;
  /// Part of chi_squared from the pixels.
  double pixels_chi_squared = 0;
  /// Expectation of pixels_chi_squared, which follows from the covariance.
  double redundancy = 0;
  /// Root of the mean squared distance, in the image, of the lamps from where the fix sees them.
  double residual_px = 0;
};

/// A state with its angles as the numbers that predictions need.
class PosedBody {
 public:
  explicit PosedBody(const BodyState& state);
  /// As `other`, whose lean it shares.
  PosedBody(const BodyState& state, const PosedBody& other);

  /// q + arm of a lamp.
  Eigen::Vector3d lamp_in_body(const Eigen::Vector3d& lamp_m, double time_s) const;
  /// The derivative of q by the states: X, Y, Z, yaw, u, w, roll, pitch.
  Eigen::Matrix<double, 3, kBodyStates> d_lamp_in_body(const Eigen::Vector3d& lamp_m,
                                                       double time_s) const;

  BodyState state;
  Eigen::Vector2d heading;
  /// L^T.
  Eigen::Matrix<double, 3, 3, Eigen::DontAlign> body_from_level;
  /// The axis about which it is pitched, along its own axes.
  Eigen::Vector3d pitch_axis;
};

/// The derivative of a lamp's pixel, in standard deviations, by q.
Eigen::Matrix<double, 2, 3> d_whitened_pixel_d_lamp(const BodySighting& sighting,
                                                    const Eigen::Vector3d& lamp_from_camera_m);

/// Squared residuals over their variances, of the pixels and of the priors, at `state`. Nothing
/// when a lamp is there behind its ray.
std::optional<double> chi_squared_of(std::span<const BodySighting> sightings,
                                     const Eigen::Vector3d& arm_in_body_m, const BodyPrior& prior,
                                     const BodyState& state);

/// The state of least squares, of pixels and priors, by Gauss-Newton steps, halved where they do
/// not help, from `start`; what the prior gives has to be in it. Nothing when a lamp is behind its
/// ray there, when neither lamps nor priors determine the state, or when 50 steps do not converge.
std::optional<BodyFix> fix_body(std::span<const BodySighting> sightings,
                                const Eigen::Vector3d& arm_in_body_m, const BodyPrior& prior,
                                const BodyState& start);

}  // namespace vlp
