// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "../geometry/frames.h"
#include "fix.h"
#include "robot.h"

/// Least-squares position fix of a body that moves and is tilted while a rolling shutter reads the
/// image. The body is the robot with the camera at `arm_in_body_m`, or the camera itself with no
/// arm.
///
/// Time 0 is the middle of the exposure of the image's middle row. At time 0 the body is at R with
/// yaw g. A lamp P read at time t has, relative to the camera and along the axes of the body, the
/// position
///   q = L^T Rz(-w t) (Rz(-g) (P - R) - u t) - arm
/// with
///   u    velocity in the body's level frame, horizontal: a body does not climb
///   w    yaw rate
///   L    Ry(pitch) Rx(roll), the roll and pitch of the body
/// For a level camera at rest this is the positioning equation (sighting.h).
///
/// One image determines the motion: velocity along the readout direction stretches the pattern of
/// lamps, velocity across it shears the pattern. A level camera at rest produces neither effect.
/// Three lamps that are not collinear determine two of velocity, yaw rate and roll and pitch. More
/// lamps determine all three.
namespace vlp {

/// Motion, roll and pitch of a body: the states that may be estimated in addition to its position R
/// and yaw g.
struct BodyMotion {
  /// Horizontal velocity u along the axes of the body's level frame.
  Eigen::Vector2d velocity_m_per_s{0, 0};
  double yaw_rate_rad_per_s = 0;
  Inclination inclination{0, 0};
};

/// Pose and motion of a body at time 0.
struct BodyState {
  Pose pose{{0, 0, 0}, 0};
  BodyMotion motion = {};
};

/// Prior knowledge of the motion: each state is normally distributed about `mean`, with its
/// standard deviation per component. A state with standard deviation 0 is fixed at its mean.
struct BodyPrior {
  BodyMotion mean;
  double velocity_sd_m_per_s = 0;
  double yaw_rate_sd_rad_per_s = 0;
  double inclination_sd_rad = 0;
  /// Prior of the height of the body; std::nullopt: unknown.
  std::optional<KnownHeight> height = {};
};

/// Observation of a lamp of the map by a body that may move and be tilted.
struct BodyObservation {
  /// Position P of the lamp in the world, m.
  Eigen::Vector3d lamp_m;
  /// Direction to the lamp along the axes of the body, unit length.
  Eigen::Vector3d ray;
  /// M: the pixel residual is M q / (ray . q), in standard deviations. M ray = 0.
  Eigen::Matrix<double, 2, 3, Eigen::DontAlign> whitened_pixel_from_ray;
  double sigma_px;
  /// Readout time of the lamp's center, s, relative to time 0 of the body.
  double time_s;
};

/// Computes M of a pixel from its standard deviation and the derivative of its ray, which may have
/// any length. Returns std::nullopt if the lens is not invertible there.
std::optional<Eigen::Matrix<double, 2, 3>> compute_whitened_pixel_jacobian_wrt_ray(
    const Eigen::Vector3d& ray, const Eigen::Matrix<double, 3, 2>& d_ray_d_pixel, double sigma_px);

/// Estimated state of a body with covariance and statistics of the residuals.
struct BodyFix {
  BodyState state;
  /// Covariance in meters, radians and seconds; zero for fixed states.
  BodyCovariance covariance = BodyCovariance::Zero();
  /// Sum of the squared residuals of pixels and priors over their variances. Its expectation is 2n
  /// - 4, or 2n - 3 with a known height.
  double chi_squared = 0;
  /// Contribution of the pixel residuals to chi_squared, without the priors.
  double pixels_chi_squared = 0;
  /// Expectation of pixels_chi_squared, computed from the covariance.
  double redundancy = 0;
  /// RMS distance in the image between the observed and the predicted lamps, over both axes
  /// together.
  double residual_px = 0;
};

/// State of a body with the trigonometric terms of its angles, which predictions use repeatedly.
class EvaluatedState {
 public:
  explicit EvaluatedState(const BodyState& state);

  /// Returns the position of a lamp relative to the body, q + arm, along the axes of the body, m.
  /// `time_s` is the readout time.
  Eigen::Vector3d lamp_position_in_body(const Eigen::Vector3d& lamp_m, double time_s) const;
  /// Returns the derivative of q, m, with respect to the states X, Y, Z, yaw, u, w, roll, pitch
  /// (BodyIndex), in m, rad and s.
  Eigen::Matrix<double, 3, kBodyStates> d_lamp_position_in_body_d_state(
      const Eigen::Vector3d& lamp_m, double time_s) const;

  BodyState state;
  /// Unit vector (cos g, sin g) of the yaw g.
  Eigen::Vector2d heading;
  /// Rotation L^T from the level frame of the body to its tilted frame.
  Eigen::Matrix<double, 3, 3, Eigen::DontAlign> body_from_level;
  /// Axis of the pitch rotation, along the axes of the body.
  Eigen::Vector3d pitch_axis;
};

/// Returns the derivative of a lamp's pixel, in standard deviations, with respect to q, m. q is its
/// position relative to the camera, along the axes of the body.
Eigen::Matrix<double, 2, 3> d_whitened_pixel_d_lamp_position(
    const BodyObservation& sighting, const Eigen::Vector3d& lamp_from_camera_m);

/// Computes the sum of the squared residuals of pixels and priors over their variances at `state`.
/// Returns std::nullopt if a lamp is behind its ray.
std::optional<double> compute_body_state_chi_squared(std::span<const BodyObservation> sightings,
                                                     const Eigen::Vector3d& arm_in_body_m,
                                                     const BodyPrior& prior,
                                                     const BodyState& state);

/// Estimates the state by least squares over pixels and priors. Gauss-Newton from `start`; a step
/// that does not reduce the sum of squares is halved. Returns std::nullopt if a lamp is behind its
/// ray at `start` or if lamps and priors do not determine the state. Also returns it without
/// convergence in 50 steps.
/// @pre `start` has the values of the states that the prior fixes
std::optional<BodyFix> estimate_body_state(std::span<const BodyObservation> sightings,
                                           const Eigen::Vector3d& arm_in_body_m,
                                           const BodyPrior& prior, const BodyState& start);

}  // namespace vlp
