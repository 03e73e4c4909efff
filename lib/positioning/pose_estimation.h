// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include "../geometry/frames.h"
#include "fix.h"
#include "pose_observations.h"
#include "robot.h"

/// Least-squares position fix of a body that may move and be tilted while a rolling shutter reads
/// the image. The body is the robot with the camera at `arm_m`, or the camera itself with no arm.
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

/// Yaw with its standard deviation; 0: exact.
struct KnownYaw {
  double yaw_rad, sd_rad;
};

/// Prior knowledge of the state: each quantity is normally distributed about its mean, with its
/// standard deviation per component. Motion and inclination with standard deviation 0 are fixed at
/// their mean.
struct BodyPrior {
  BodyMotion mean = {};
  double velocity_sd_m_per_s = 0;
  double yaw_rate_sd_rad_per_s = 0;
  double inclination_sd_rad = 0;
  /// Prior of the height of the point `height_point_m` of the body, or of its yaw; std::nullopt:
  /// unknown. A standard deviation of 0 counts as 1e-9.
  std::optional<KnownHeight> height = {};
  std::optional<KnownYaw> yaw = {};
  /// Position in the body frame, m.
  Eigen::Vector3d height_point_m{0, 0, 0};

  /// Returns true if velocity or yaw rate are estimated together with the pose.
  bool is_motion_estimated() const { return velocity_sd_m_per_s > 0 || yaw_rate_sd_rad_per_s > 0; }
  /// Returns true if velocity, yaw rate or roll and pitch are estimated together with the pose.
  bool is_motion_or_tilt_estimated() const {
    return is_motion_estimated() || inclination_sd_rad > 0;
  }
};

/// Arm of the camera, its position in the body frame, and prior of the state.
struct BodyProblem {
  const Eigen::Vector3d& arm_m;
  const BodyPrior& prior;
};

/// Least-squares state of a body with its covariance and residuals.
struct BodyFix {
  BodyState state;
  /// Covariance of the state (BodyIndex) from the pixel noise and the priors. Zero for fixed
  /// states.
  BodyCovariance covariance = BodyCovariance::Zero();
  /// Sum of the squared residuals of pixels and priors over their variances.
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
  BodyState state;
  /// Unit vector (cos g, sin g) of the yaw g.
  Eigen::Vector2d heading;
  /// Rotation L^T from the level frame of the body to its tilted frame.
  Eigen::Matrix<double, 3, 3, Eigen::DontAlign> body_from_level;
  /// Axis of the pitch rotation, along the axes of the body.
  Eigen::Vector3d pitch_axis;
};

/// Residual of an observation, in standard deviations, and derivative of its prediction with
/// respect to all states.
struct LinearizedObservation {
  Eigen::Vector2d residual;
  Eigen::Matrix<double, 2, kBodyStates> jacobian;
};
LinearizedObservation linearize_observation(const LampObservation& sighting,
                                            const EvaluatedState& body,
                                            const Eigen::Vector3d& arm_m);

/// Prior of one state: its index (BodyIndex), 1 / sd, and mean minus state, in standard deviations.
struct PriorTerm {
  int state;
  double weight, residual;
  /// Derivatives of the prior quantity with respect to roll and pitch, m; zero except for the
  /// height.
  Eigen::Vector2d d_inclination;
};

/// Priors of the states that are neither free nor fixed: `size` terms at the beginning.
struct PriorTerms {
  std::array<PriorTerm, 7> terms;
  std::size_t size = 0;

  std::span<const PriorTerm> list() const { return {terms.data(), size}; }
};
PriorTerms compute_prior_terms(const BodyPrior& prior, const EvaluatedState& body);

/// Computes the sum of the squared residuals of pixels and priors over their variances at `state`.
/// Returns std::nullopt if a lamp is behind its ray.
std::optional<double> compute_body_state_chi_squared(std::span<const LampObservation> sightings,
                                                     const BodyProblem& problem,
                                                     const BodyState& state);

/// Estimates the state by least squares over pixels and priors. Gauss-Newton from `start`; a step
/// that does not reduce the sum of squares is halved. Returns std::nullopt if a lamp is behind its
/// ray at `start` or if lamps and priors do not determine the state. Also returns it without
/// convergence in 50 steps.
/// @pre `start` has the values of the states that the prior fixes
std::optional<BodyFix> estimate_body_state(std::span<const LampObservation> sightings,
                                           const BodyProblem& problem, const BodyState& start);

/// Replaces covariance and redundancy for the weights of the observations by those for the noise V
/// of their pixels (FrameObservations::noise):
///   C + C D C,   tr(V) - 2 tr(C S) + tr(N (C + C D C)),   S = J' V J,   N = J' J,   D = S - N
void convert_covariance_to_image_noise(const FrameObservations& frame, const BodyProblem& problem,
                                       BodyFix& fix);

}  // namespace vlp
