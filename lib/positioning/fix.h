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

/// A pose and the covariance of its (X, Y, Z, yaw) in meters and radians.
struct PoseEstimate {
  Pose pose;
  Matrix4 covariance;
};

/// Indices of the states of a body in covariances: X, Y, Z, yaw, velocity, yaw rate, roll, pitch.
enum BodyIndex { kBodyYaw = 3, kBodyVelocity = 4, kBodyYawRate = 6, kBodyRoll = 7, kBodyPitch = 8 };
inline constexpr int kBodyStates = 9;
using BodyCovariance = Eigen::Matrix<double, kBodyStates, kBodyStates, Eigen::DontAlign>;

/// Estimated motion, roll and pitch of the robot, or, without a mount, of the camera.
struct BodyEstimate {
  /// Velocity (x, y) in the world frame.
  Eigen::Vector2d velocity_m_per_s{0, 0};
  double yaw_rate_rad_per_s = 0;
  Inclination inclination{0, 0};
  /// Covariance of (X, Y, Z, yaw, vx, vy, yaw rate, roll, pitch) in meters, radians and seconds.
  /// Includes all known errors, as in Fix::estimate. Zero for quantities given as exact.
  BodyCovariance covariance = BodyCovariance::Zero();
  /// Part of the covariance due to this frame: pixels and priors combined.
  BodyCovariance noise_covariance = BodyCovariance::Zero();
};

/// Result for one frame. The members below `status` are valid only if it is `ok`.
struct Fix {
  FixStatus status = FixStatus::too_few_lamps;
  /// Pose of the camera, or of the robot's center if there is a CameraMount. The covariance of (X,
  /// Y, Z, yaw) includes all known errors: noise_covariance, and the errors of calibration and lamp
  /// map as far as they are reported (correlated_errors.h). If the residuals contradict the noise
  /// (probability below 1e-4), it includes an unknown tilt or motion that explains them.
  PoseEstimate estimate;
  /// Part of the covariance due to pixel noise and inclination, and, for one lamp, height, yaw and
  /// motion. It averages out over frames as far as these errors are independent between frames. The
  /// reported noise is scaled if neither it nor a tilt or motion explains the residuals.
  Matrix4 noise_covariance = Matrix4::Zero();
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
  /// Number of detections whose id is not in the lamp map; these are ignored. Valid for every
  /// status.
  int unknown_lamps = 0;
  /// Degrees of freedom of the pixel residuals. A body at rest with known roll and pitch has 2n - 4
  /// for three lamps or more; each other estimated quantity reduces them. If sigma_px is not
  /// reported, the expectation of chi_squared for unit noise in the image.
  double redundancy = 0;
  /// Sum of the squared residuals of the pixels over their variances. Its expectation is
  /// `redundancy` plus common_chi_squared.
  double chi_squared = 0;
  /// Expected contribution of the errors of calibration and lamp map to chi_squared, as far as they
  /// are reported. 0 without PositionerOptions::computes_common_chi_squared.
  double common_chi_squared = 0;
  /// Motion, roll and pitch if Sensors leave them free.
  std::optional<BodyEstimate> body;
  /// Sensors::time_s: the middle of the exposure of the image's middle row, to which the fix
  /// refers.
  std::optional<double> time_s;

  bool has_succeeded() const { return status == FixStatus::ok; }
};

}  // namespace vlp
