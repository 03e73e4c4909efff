// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>

#include "../rig/calibration.h"
#include "../rig/detection.h"
#include "../rig/lamp_map.h"
#include "correction.h"
#include "fix.h"
#include "robot.h"

namespace vlp {

#if defined(__x86_64__) || defined(__aarch64__)
static_assert(
    alignof(Detection) == 16,
    "the library has vectors with Eigen's own alignment of 16 bytes: take EIGEN_DONT_ALIGN "
    "and EIGEN_MAX_STATIC_ALIGN_BYTES away");
#endif

/// Options of a Positioner: applied corrections, mount of the camera, limits.
struct PositionerOptions {
  Correction correction = Correction::all;
  /// Pose of the camera on the robot. With a mount, fixes are of the robot's center and yaw;
  /// without one (std::nullopt), of the camera.
  std::optional<CameraMount> mount;
  /// Residual limit as a fraction of the RMS radius of all lamps. Lamps are
  /// inconsistent if the residual of one exceeds it, or if it is too close to another lamp
  /// (estimate_pose_robustly()). Noise, lens and an uncorrected tilt of 5 degrees cause residuals
  /// of 0.05 or less.
  double max_residual_fraction = 0.1;
  /// Standard deviation per axis, in the image, of detections without sigma_px. It scales the
  /// covariance and decides if lamps close together are `degenerate`. Poses do not depend on it,
  /// unless motion, inclination or height is known with a standard deviation.
  ///
  /// If roll and pitch are known, such lamps have equal weights in the undistorted image, as in the
  /// closed forms. Errors of lens, tilt and map affect these weights less than weights in the
  /// distorted image.
  double unstated_sigma_px = 1;
  /// Rejects lamps that contradict the others by more than noise and common errors explain, and
  /// widens the covariance if the residuals contradict the noise. Without it fixes are smooth
  /// functions of calibration and map.
  bool checks_residuals = true;
};

/// Motion of a robot, or, without a mount, of a camera, while an image is read. Normally
/// distributed about these values, with these standard deviations per component. 0: exact.
struct KnownMotion {
  /// Velocity (x, y) along the axes of the level frame of the robot, or, without a mount, of the
  /// camera.
  Eigen::Vector2d velocity_m_per_s{0, 0};
  double yaw_rate_rad_per_s = 0;
  double velocity_sd_m_per_s = 0;
  double yaw_rate_sd_rad_per_s = 0;

  /// Returns a motion of which only the maximum speed and yaw rate are known: mean zero, standard
  /// deviation half the maximum.
  static KnownMotion make_motion_prior_from_limits(double speed_m_per_s,
                                                   double yaw_rate_rad_per_s) {
    return {{0, 0}, 0, speed_m_per_s / 2, yaw_rate_rad_per_s / 2};
  }
};

/// Sensor readings of the robot for a frame.
struct Sensors {
  /// Reading of the inclination sensor (eq. 2) about the axes of the robot, or, without a mount, of
  /// the camera corrected for its calibrated tilt. Level if std::nullopt.
  std::optional<Inclination> inclination;
  /// Standard deviation of each angle of the inclination, or, without a sensor, of roll and pitch
  /// about level. If positive, roll and pitch are estimated with the pose.
  /// 0: exact. 1 or more: unknown.
  double inclination_sigma_rad = 0;
  /// Height and yaw of the camera. Allows a fix of a single lamp; not used with two lamps or more.
  std::optional<HeightAndYaw> height_and_yaw;
  /// Motion during the readout of the image; std::nullopt: at rest.
  std::optional<KnownMotion> motion = {};
  /// Height of the robot's center, or, without a mount, of the camera. Not used for a single lamp.
  std::optional<KnownHeight> height = {};
  /// Prior of the state with correlations, as of a filter's prediction, for any number of lamps;
  /// one lamp requires its height and yaw. In place of the readings above.
  std::optional<StatePrior> prior = {};
  /// Time of the capture in any time scale, copied to Fix::time_s.
  std::optional<double> time_s = {};

  /// Returns the reading of the inclination, or the mean of the prior.
  std::optional<Inclination> known_inclination() const {
    return prior ? std::optional(prior->mean.motion.inclination) : inclination;
  }
  /// Returns the standard deviation of roll and pitch; 0: exact.
  double tilt_sd_rad() const {
    return prior ? std::sqrt(prior->covariance.diagonal().tail<2>().maxCoeff())
                 : inclination_sigma_rad;
  }
};

/// Detections of an earlier frame of the same body, whose velocity, yaw rate, roll and pitch are
/// assumed to be the same.
struct EarlierFrame {
  std::span<const Detection> detections;
  /// Time from the earlier frame to the frame of the fix. Positive, and different for each frame.
  double before_s;
};

/// Pixel of a lamp's center and its derivatives with respect to the states (BodyIndex).
struct LampProjection {
  using Jacobian = Eigen::Matrix<double, 2, kBodyStates, Eigen::DontAlign>;

  Eigen::Vector2d pixel;
  Jacobian jacobian;
};

/// Use of a detection in a fix: `rejected` because the others contradict it, `not_in_map` because
/// the map lacks the lamp.
enum class DetectionUse { used, rejected, not_in_map };

/// Comparison of a detection with a fix.
struct DetectionResidual {
  DetectionUse use;
  /// Projection of the lamp. NaN if the map lacks the lamp or the lens does not image it.
  LampProjection predicted;
  /// Detected minus predicted pixel.
  Eigen::Vector2d residual_px;
};

/// Estimates positions from identified lamps in images. Combines calibration and lamp map once,
/// when it is constructed. Immutable: several threads may share one, and copies are cheap.
class Positioner {
 public:
  static constexpr std::size_t max_lamps = 256;

  /// @throws std::invalid_argument if the map is empty, has an id twice, or has two lamps at one
  /// position; if a position, including that of the mount, is not finite; if the intrinsics do not
  /// match the lens model; or if `options` require a missing part, or have a fraction or sigma out
  /// of range
  Positioner(const LampMap& map, const Calibration& calibration,
             const PositionerOptions& options = {});

  /// Computes the fix of one frame. Neither allocates memory nor throws.
  ///
  /// Least squares over the pixels and the known states (estimate_pose_robustly()), from
  /// initial values in closed form. One lamp requires height and yaw. Lamps that contradict the
  /// others are rejected (flag_outlier_lamps()).
  Fix compute_position_fix(std::span<const Detection> detections,
                           const Sensors& sensors = {}) const noexcept;
  /// Computes the fix of one frame together with frames from shortly before. Velocity, yaw rate,
  /// roll and pitch are assumed constant over the frames. If the current frame has fewer than two
  /// lamps of the map, the earlier frames are not used. Without sensor readings the camera is
  /// assumed at rest.
  Fix compute_position_fix(std::span<const Detection> detections, const Sensors& sensors,
                           std::span<const EarlierFrame> earlier) const noexcept;

  /// Computes the rotation level_from_camera for a detector from roll and pitch, with an arbitrary
  /// yaw.
  Eigen::Matrix3d compute_level_from_camera(const Inclination& inclination) const;
  /// Computes the pixel of a lamp of the map at a state, and its derivatives. If the body moves,
  /// the pixel is where the readout reaches the lamp. NaN if the map lacks the lamp, or if the lens
  /// does not image it. Does not allocate memory.
  LampProjection project_lamp(int lamp, const BodyState& state) const noexcept;
  /// Compares a detection of the frame of a fix with the state of the fix. `use` is exact for the
  /// rejected lamps that the fix lists.
  DetectionResidual compute_detection_residual(const Detection& detection,
                                               const Fix& fix) const noexcept;

  /// Returns the number of lamps of the adjustment that the map has at another position. The
  /// reported covariances do not include their errors (CommonErrors).
  int num_lamps_moved_since_calibration() const noexcept;

 private:
  class Impl;
  std::shared_ptr<const Impl> impl_;
};

}  // namespace vlp
