// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <limits>
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
/// For a level camera at rest this is the positioning equation (closed_form.h).
///
/// One image determines the motion: velocity along the readout direction stretches the pattern of
/// lamps, velocity across it shears the pattern. A level camera at rest produces neither effect.
/// Three lamps that are not collinear determine two of velocity, yaw rate and roll and pitch. More
/// lamps determine all three.
namespace vlp {

/// Prior of the state of a body; its height is that of a given point of the body. By default, the
/// pose is unknown, and the body is level and at rest. A variance of 0 fixes motion, roll and pitch
/// at their mean. Other states with variance 0 get a standard deviation of 1e-9.
struct BodyPrior : StatePrior {
  /// Position in the body frame, m.
  Eigen::Vector3d height_point_m{0, 0, 0};

  BodyPrior() {
    covariance.diagonal().head<4>().setConstant(std::numeric_limits<double>::infinity());
  }

  /// Sets the standard deviation of a state without correlations; kBodyVelocity: of both
  /// components; kBodyRoll: of roll and pitch.
  void set_state_sd(BodyIndex state, double sd) {
    const int count = state == kBodyVelocity || state == kBodyRoll ? 2 : 1;
    covariance.middleRows(state, count).setZero();
    covariance.middleCols(state, count).setZero();
    covariance.diagonal().segment(state, count).setConstant(sd * sd);
  }
  bool is_velocity_estimated() const { return max_variance(kBodyVelocity, 2) > 0; }
  bool is_yaw_rate_estimated() const { return max_variance(kBodyYawRate, 1) > 0; }
  bool is_tilt_estimated() const { return max_variance(kBodyRoll, 2) > 0; }
  /// Returns true if velocity or yaw rate are estimated together with the pose.
  bool is_motion_estimated() const { return is_velocity_estimated() || is_yaw_rate_estimated(); }
  /// Returns true if velocity, yaw rate or roll and pitch are estimated together with the pose.
  bool is_motion_or_tilt_free() const { return is_motion_estimated() || is_tilt_estimated(); }
  /// Returns the largest variance of `count` states from `state` on.
  double max_variance(int state, int count) const {
    return covariance.diagonal().segment(state, count).maxCoeff();
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

/// Position q of a lamp relative to the camera along the axes of the body, m, with its derivatives
/// with respect to all states, and its velocity dq/dt.
struct LinearizedLampPosition {
  Eigen::Vector3d q, velocity_m_per_s;
  Eigen::Matrix<double, 3, kBodyStates> jacobian;
};
LinearizedLampPosition linearize_lamp_position(const Eigen::Vector3d& lamp_m, double time_s,
                                               const EvaluatedState& body,
                                               const Eigen::Vector3d& arm_m);

/// Residual of an observation, in standard deviations, and derivative of its prediction with
/// respect to all states.
struct LinearizedObservation {
  Eigen::Vector2d residual;
  Eigen::Matrix<double, 2, kBodyStates> jacobian;
};
LinearizedObservation linearize_observation(const LampObservation& sighting,
                                            const EvaluatedState& body,
                                            const Eigen::Vector3d& arm_m);

/// Residual of the prior, whitened: mean minus state, given the residuals of the states before
/// `state`, in standard deviations; and its derivatives. `is_diagonal` if only that by `state` is
/// not zero.
struct PriorTerm {
  int state;
  bool is_diagonal;
  double residual;
  Eigen::Matrix<double, kBodyStates, 1> row;
};

/// Terms of the states with a prior that are not fixed: `size` terms at the beginning. The
/// residuals are L^-1 (mean - state), with the Cholesky factor L of the covariance of these states.
struct PriorTerms {
  std::array<PriorTerm, kBodyStates> terms;
  std::size_t size = 0;

  std::span<const PriorTerm> list() const { return {terms.data(), size}; }
};
PriorTerms compute_prior_terms(const BodyPrior& prior, const EvaluatedState& body);

/// Returns the difference of two states (BodyIndex).
Eigen::Matrix<double, kBodyStates, 1> subtract_states(const BodyState& to, const BodyState& from);

/// Computes the sum of the squared residuals of pixels and priors over their variances at `state`.
/// Returns std::nullopt if a lamp is behind its ray.
std::optional<double> compute_chi_squared(std::span<const LampObservation> sightings,
                                          const BodyProblem& problem, const BodyState& state);

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
void convert_to_image_noise(const FrameObservations& frame, const BodyProblem& problem,
                            BodyFix& fix);

}  // namespace vlp
