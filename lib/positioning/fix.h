// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string_view>

#include "../geometry/frames.h"
#include "../geometry/types.h"

namespace vlp {

/// Status of a fix. fix_status_name() returns the word in fixes.csv.
enum class FixStatus {
  ok,
  too_few_lamps,      // fewer than two lamps of the map
  too_many_lamps,     // more than Positioner::max_lamps
  duplicate_lamp,     // one id twice in a frame
  not_finite,         // a value is not finite or out of range, or an earlier frame is not earlier
  outside_lens,       // a pixel that no ray through the lens reaches
  lamp_below_camera,  // a lamp would have to be at or below the camera's height
  degenerate,         // the lamps are too close together in the image, or fit no pose
  ambiguous,          // two poses explain the lamps
  inconsistent,       // three lamps or more contradict each other, or two a known height
  mirrored_map,       // the lamps fit a mirror image of the map
  undetermined,       // lamps and priors do not determine motion or tilt, and so the position
  row_time_unknown    // motion compensation requires the row time
};

/// Returns the name of a status as in fixes.csv: that of the enumerator, for example
/// "too_few_lamps".
std::string_view fix_status_name(FixStatus status);

/// Returns an explanation of a status with the remedy, human-readable, in one line.
std::string_view describe_fix_status(FixStatus status);

/// Motion, roll and pitch of a body: the robot, or, without a mount, the camera.
struct BodyMotion {
  /// Horizontal velocity u along the axes of the body's level frame.
  Eigen::Vector2d velocity_m_per_s{0, 0};
  double yaw_rate_rad_per_s = 0;
  Inclination inclination{0, 0};
};

/// Pose of the level frame of a body, and its motion, at the middle of the exposure of the image's
/// middle row.
struct BodyState {
  Pose pose{{0, 0, 0}, 0};
  BodyMotion motion = {};
};

/// Indices of the states of a body in covariances and derivatives, in meters, radians and seconds:
/// X, Y, Z, yaw, velocity (2), yaw rate, roll, pitch.
enum BodyIndex {
  kBodyZ = 2,
  kBodyYaw = 3,
  kBodyVelocity = 4,
  kBodyYawRate = 6,
  kBodyRoll = 7,
  kBodyPitch = 8
};
inline constexpr int kBodyStates = 9;
using BodyCovariance = Eigen::Matrix<double, kBodyStates, kBodyStates, Eigen::DontAlign>;

/// A state that explains a frame, and its likelihood relative to the sum over all candidates.
struct FixCandidate {
  BodyState state;
  double likelihood = 0;
};

/// Result for one frame. The members below `candidates` are valid only if `status` is `ok`.
struct Fix {
  FixStatus status = FixStatus::too_few_lamps;
  /// Number of detections whose id is not in the lamp map; these are ignored. Valid for every
  /// status.
  int unknown_lamps = 0;
  /// States that explain the frame if the status is `ambiguous`, the most likely one first:
  /// `num_candidates` of them at the beginning.
  int num_candidates = 0;
  std::array<FixCandidate, 6> candidates = {};
  /// State of the robot's center if there is a CameraMount, otherwise of the camera. States that
  /// are not estimated are as given.
  BodyState state;
  /// Covariance of the state (BodyIndex) from all known errors: noise_covariance, and the errors of
  /// calibration and lamp map as far as they are reported (correlated_errors.h). Zero for states
  /// given as exact. If the residuals contradict the noise (probability below 1e-4), it includes an
  /// unknown tilt or motion that explains them.
  BodyCovariance covariance = BodyCovariance::Zero();
  /// Part of the covariance due to this frame: pixels and priors. It averages out over frames as
  /// far as these errors are independent between frames. The reported noise is scaled if neither it
  /// nor a tilt or motion explains the residuals.
  BodyCovariance noise_covariance = BodyCovariance::Zero();
  /// RMS distance in the image between the observed and the predicted lamps, over both axes
  /// together. Zero, to rounding, with one or two lamps.
  double residual_px = 0;
  /// Number of lamps of this frame used for the fix.
  int lamps = 0;
  /// Number of observations in residual_px: those of `lamps` and those of earlier frames.
  int sightings = 0;
  /// Number of lamps rejected because the others contradict them, and the ids of the first 32 of
  /// them.
  int rejected_lamps = 0;
  std::array<int, 32> rejected_ids = {};
  /// Degrees of freedom of the pixel residuals. A body at rest with known roll and pitch has 2n - 4
  /// for three lamps or more; each other estimated quantity reduces them. If sigma_px is not
  /// reported, the expectation of chi_squared for unit noise in the image.
  double redundancy = 0;
  /// Sum of the squared residuals of the pixels over their variances. Its expectation is
  /// `redundancy` plus common_chi_squared.
  double chi_squared = 0;
  /// Expected contribution of the errors of calibration and lamp map to chi_squared, as far as they
  /// are reported. 0 if chi_squared is not above `redundancy`.
  double common_chi_squared = 0;
  /// Sensors::time_s: the middle of the exposure of the image's middle row, to which the fix
  /// refers.
  std::optional<double> time_s;

  bool has_succeeded() const { return status == FixStatus::ok; }
  /// Returns the covariance of (X, Y, Z, yaw).
  Matrix4 pose_covariance() const { return covariance.topLeftCorner<4, 4>(); }
};

}  // namespace vlp
