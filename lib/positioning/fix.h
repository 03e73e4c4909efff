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

/// How a fix went. name_of() is what stands in fixes.csv.
enum class FixStatus {
  ok,
  too_few_lamps,      // fewer than two lamps of the map
  too_many_lamps,     // more than Positioner::max_lamps
  duplicate_lamp,     // one id twice in a frame
  not_finite,         // a pixel or a sensor reading is not, or a sigma or sd is out of range
  outside_lens,       // a pixel that no ray through the lens reaches
  lamp_below_camera,  // a lamp would have to hang at or below the camera's height
  degenerate,         // the lamps are seen too close together, or do not fit any pose
  ambiguous,          // two poses would explain the lamps
  inconsistent,       // three lamps or more that contradict each other
  mirrored_map,       // they fit a mirror image of the map
  undetermined,       // lamps and what is known do not tell lean or motion, and so not the place
  row_time_unknown    // motion wants to know when each row was read
};

/// The enumerator as a word, for example "too_few_lamps".
std::string_view name_of(FixStatus status);

/// What it means and what to do, for people.
std::string_view explanation_of(FixStatus status);

/// A pose and the covariance of its (X, Y, Z, yaw) in metres and radians.
struct PoseEstimate {
  Pose pose;
  Matrix4 covariance;
};

/// Where the states of a body stand in covariances: X, Y, Z, yaw, then velocity, yaw rate and lean.
enum BodyIndex { kBodyYaw = 3, kBodyVelocity = 4, kBodyYawRate = 6, kBodyRoll = 7, kBodyPitch = 8 };
inline constexpr int kBodyStates = 9;
using BodyCovariance = Eigen::Matrix<double, kBodyStates, kBodyStates, Eigen::DontAlign>;

/// How the body of a fix moved and leaned: the robot, or, without a mount, the camera.
struct BodyEstimate {
  /// In the world.
  Eigen::Vector2d velocity_m_per_s{0, 0};
  double yaw_rate_rad_per_s = 0;
  Inclination inclination{0, 0};
  /// Of (X, Y, Z, yaw, vx, vy, yaw rate, roll, pitch) in metres, radians and seconds: all that is
  /// known of their errors, as in Fix::estimate. Zero for what was given as exact.
  BodyCovariance covariance = BodyCovariance::Zero();
  /// The part that is of this frame alone: of pixels and of what was known before, weighed
  /// together.
  BodyCovariance noise_covariance = BodyCovariance::Zero();
};

/// The answer to one frame. Everything below `status` holds only when that is `ok`.
struct Fix {
  FixStatus status = FixStatus::too_few_lamps;
  /// Of the camera, or of the robot's centre when a CameraMount is given; the covariance of
  /// (X, Y, Z, yaw) is all that is known of its error: noise_covariance, and what calibration and
  /// lamp map got wrong, as far as they state it (common_errors.h).
  PoseEstimate estimate;
  /// The part of the pixel noise, of the inclination, and, for one lamp, of height, yaw and motion.
  /// It averages out over frames as far as these errors are independent between them.
  Matrix4 noise_covariance = Matrix4::Zero();
  /// Root of the mean squared distance between the lamps' pixels and where the fix sees them. Zero,
  /// to rounding, with one or two lamps.
  double residual_px = 0;
  /// Lamps that the fix rests on.
  int lamps = 0;
  /// Those that residual_px is of: the same, and those of earlier frames.
  int sightings = 0;
  /// Lamps that were left out because the others contradict them, and the ids of the first of them.
  int rejected_lamps = 0;
  std::array<int, 32> rejected_ids = {};
  /// Detections whose id is not in the lamp map; they are left out. Holds whatever the status.
  int unknown_lamps = 0;
  /// Degrees of freedom that the pixels' residuals have: 2n - 4 for three lamps and more that are
  /// seen from a body that stands and whose lean is known, less by what else they determine. If
  /// sigma_px is not stated, the expectation of chi_squared for unit noise in the image.
  double redundancy = 0;
  /// Sum of the squared residuals of the pixels over their variances. Its expectation is
  /// `redundancy` plus common_chi_squared.
  double chi_squared = 0;
  /// Expected contribution of the errors of calibration and lamp map to chi_squared, as far as they
  /// are stated. 0 without PositionerOptions::computes_common_chi_squared.
  double common_chi_squared = 0;
  /// Where Sensors let it move or lean.
  std::optional<BodyEstimate> body;
  /// That of the Sensors: the middle of the exposure of the image's middle row, of which the fix
  /// is.
  std::optional<double> time_s;

  bool ok() const { return status == FixStatus::ok; }
};

}  // namespace vlp
