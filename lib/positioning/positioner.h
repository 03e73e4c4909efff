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

struct PositionerOptions {
  Correction correction = Correction::all;
  /// With it, fixes are of the robot's centre; without, of the camera.
  std::optional<CameraMount> mount;
  /// Lamps are inconsistent when one is farther from where the fix sees it than this share of
  /// the spread (rms) of all lamps in the image (or too near to another lamp, see fix_robustly).
  /// Noise, lens and a tilt of 5 degrees that nothing corrects put it off by 0.05 or less.
  double max_residual_share = 0.1;
  /// Standard deviation per axis, in the image, of detections that do not state their sigma_px. It
  /// scales the covariance, and decides whether lamps close together are `degenerate`. Poses do not
  /// depend on it, unless motion, inclination or height is known with a standard deviation.
  /// If the camera stands, such lamps have equal weights in the undistorted image, as in the closed
  /// forms. Errors of lens, tilt and map disturb these weights less than weights by the image.
  double unstated_sigma_px = 1;
  /// Computes Fix::common_chi_squared.
  bool computes_common_chi_squared = false;
};

/// How a robot, or, without a mount, a camera, moves while an image is read: normal about these
/// figures, with these standard deviations per component. 0: just so.
struct KnownMotion {
  /// In its level frame.
  Eigen::Vector2d velocity_m_per_s{0, 0};
  double yaw_rate_rad_per_s = 0;
  double velocity_sd_m_per_s = 0;
  double yaw_rate_sd_rad_per_s = 0;

  /// Of one of which nothing is known but how fast it can be: none, give or take half of that.
  static KnownMotion up_to(double speed_m_per_s, double yaw_rate_rad_per_s) {
    return {{0, 0}, 0, speed_m_per_s / 2, yaw_rate_rad_per_s / 2};
  }
};

/// What the robot knows of a frame besides the image.
struct Sensors {
  /// From the inclination sensor (eq. 2), about the axes of the robot, or, without a mount, of the
  /// camera (its calibrated tilt taken off); level without.
  std::optional<Inclination> inclination;
  /// Standard deviation of each of its angles, or of a lean about level that no sensor reads: with
  /// two lamps or more, roll and pitch are then estimated along with the pose. 0: just so. 1 or
  /// more is nothing known.
  double inclination_sigma_rad = 0;
  /// Height and yaw of the camera. Makes a fix of a single lamp; not used when two or more are
  /// seen.
  std::optional<HeightAndYaw> height_and_yaw;
  /// None: it stands.
  std::optional<KnownMotion> motion = {};
  /// Of the robot's centre, or, without a mount, of the camera. Not used for a single lamp.
  std::optional<KnownHeight> height = {};
  /// When the capture was taken, for Fix::time_s.
  std::optional<double> time_s = {};
};

/// A frame that the same body saw before, on the same straight way.
struct EarlierFrame {
  std::span<const Detection> detections;
  double before_s;
};

/// From identified lamps in an image to a position: the way from pixels to a fix, put together
/// once from calibration and lamp map. Immutable: any number of threads may share it, and copies
/// are cheap.
class Positioner {
 public:
  static constexpr std::size_t max_lamps = 256;

  /// Throws std::invalid_argument when the map is empty, an id stands twice in it, two lamps are in
  /// one place or a place is not finite (likewise that of the mount), when the intrinsics are not
  /// the lens model's, or when `options` ask for a part that is not there or for a share or a sigma
  /// out of range.
  Positioner(const LampMap& map, const Calibration& calibration,
             const PositionerOptions& options = {});

  /// The fix of one frame. Neither allocates nor throws. One lamp: fix_one_lamp(); two: in closed
  /// form; more: fix_least_squares() from initial_pose(), without the lamps whose identity is wrong
  /// (fix_robustly) and, where the calibration's or the survey's covariance covers every lamp,
  /// those that all that is uncertain together does not explain (find_unexplained). Where the
  /// sensors let it move or lean, or know its height, with two lamps or more: fix_body_frame().
  Fix locate(std::span<const Detection> detections, const Sensors& sensors = {}) const noexcept;
  /// With frames from shortly before, of two lamps or more that are seen now and then: velocity,
  /// yaw rate and lean stay the same from one to the next. Where the sensors give none, all is at
  /// rest.
  Fix locate(std::span<const Detection> detections, const Sensors& sensors,
             std::span<const EarlierFrame> earlier) const noexcept;

  /// Lamps of the calibration's adjustment that the map has elsewhere: what fixes state is not of
  /// them (CommonErrors).
  int lamps_elsewhere() const noexcept;

 private:
  class Impl;
  std::shared_ptr<const Impl> impl_;
};

}  // namespace vlp
