// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
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
  /// (estimate_body_state_robust). Noise, lens and an uncorrected tilt of 5 degrees cause residuals
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
  /// True if Fix::common_chi_squared is computed.
  bool computes_common_chi_squared = false;
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
  /// Time of the capture in any time scale, copied to Fix::time_s.
  std::optional<double> time_s = {};
};

/// Detections of an earlier frame of the same body, whose velocity, yaw rate, roll and pitch are
/// assumed to be the same.
struct EarlierFrame {
  std::span<const Detection> detections;
  /// Time from the earlier frame to the frame of the fix. Positive, and different for each frame.
  double before_s;
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
  /// Least squares over the pixels and the known states (estimate_body_state_robust()), from
  /// initial values in closed form. One lamp requires height and yaw. Lamps that contradict the
  /// others are rejected (find_outlier_lamps()).
  Fix compute_position_fix(std::span<const Detection> detections,
                           const Sensors& sensors = {}) const noexcept;
  /// Computes the fix of one frame together with frames from shortly before. Velocity, yaw rate,
  /// roll and pitch are assumed constant over the frames. If the current frame has fewer than two
  /// lamps of the map, the earlier frames are not used. Without sensor readings the camera is
  /// assumed at rest.
  Fix compute_position_fix(std::span<const Detection> detections, const Sensors& sensors,
                           std::span<const EarlierFrame> earlier) const noexcept;

  /// Returns the number of lamps of the adjustment that the map has at another position. The
  /// reported covariances do not include their errors (CommonErrors).
  int num_lamps_moved_since_calibration() const noexcept;

 private:
  class Impl;
  std::shared_ptr<const Impl> impl_;
};

}  // namespace vlp
