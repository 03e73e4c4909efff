// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "captures/detections_table.h"
#include "geometry/frames.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"

namespace vlp {

/// Observation of one lamp in one capture.
struct RotationObservation {
  /// Index in RotationCaptures::captures of the capture with this observation.
  std::size_t capture;
  /// Index in RotationCaptures::lamps of the observed lamp.
  std::size_t lamp;
  Eigen::Vector2d pixel;
  std::optional<double> sigma_px;
  /// Direction of the pixel's ray in the camera, of unit length.
  Eigen::Vector3d ray;
};

/// Capture of a rotation in place.
struct RotationCapture {
  std::string image;
  /// Index in RotationCaptures::heights of the camera height of this capture.
  std::size_t height;
  /// Yaw of the camera in the world from its position fix, rad.
  double yaw_rad;
};

/// Captures of a rotation in place that were taken at one height of the camera.
struct RotationHeight {
  /// Height of the camera in the world.
  double z_m;
  /// Horizontal position of the rotation axis in the world.
  Eigen::Vector2d axis_m;
  /// Angular range of the yaws: 2 pi minus the largest gap between neighboring yaws.
  double arc_rad;
  /// Number of captures.
  int captures;
};

/// Result of the check that captures are a rotation in place.
enum class RotationStatus {
  ok,
  other_map,         // no lamp of the map is detected, or the detected lamps contradict it
  too_few_lamps,     // fewer than two lamps, or than two in each capture
  too_few_captures,  // fewer than three at any height
  single_yaw,        // all captures at one yaw
  short_arc,         // less than 90 degrees at every height
  axis_moved         // the axis moves between captures
};

/// Describes the status and the remedy, human-readable.
std::string_view describe_status(RotationStatus status);

/// Captures of a rotation in place about a vertical axis, with approximate values of the unknowns.
///
/// A camera with yaw g on an axis at A, with lever arm e from the axis (level frame), sees lamp P
/// at
///   x_in_camera ~ camera_from_level(zenith) (Rz(-g) (P - A) - e).
/// The origin is on the axis at the height of the camera.
///
/// The values here follow from position fixes with the lamp map and are initial values for the
/// fits. They need no initial guess: each of a few iterations solves
///   fix_k = A + e^{jg_k} (e + H_k delta)
/// which is linear in A, e and delta, the remaining tilt. The weights are robust against outliers.
///
/// Heights are separate if there is a gap between the distances of the fixes from the lamps. The
/// gap has to be at least three of their standard deviations, and at least kMinHeightGapFraction of
/// the distance.
struct RotationCaptures {
  RotationStatus status = RotationStatus::ok;
  /// Lamps of the map that are detected, in the order of the map.
  std::vector<Lamp> lamps;
  std::vector<RotationCapture> captures;
  /// Heights of the captures, in ascending order.
  std::vector<RotationHeight> heights;
  std::vector<RotationObservation> observations;
  /// Upper median of the detections' sigma_px; std::nullopt if any detection has none.
  std::optional<double> median_sigma_px = {};
  Eigen::Vector3d zenith_in_camera = Eigen::Vector3d::UnitZ();
  /// Lever arm in the level frame; zero if there is only one height.
  Eigen::Vector2d lever_arm_m = Eigen::Vector2d::Zero();
  /// Rejected capture and the reason, human-readable.
  struct RejectedCapture {
    std::string image;
    std::string reason;
  };
  /// Captures that are not used.
  std::vector<RejectedCapture> rejected_captures;
};

/// Smallest gap between two heights, as a fraction of the distance from the lamps. Distances of
/// captures at one height differ by less than this, because floors are uneven and lamp maps have
/// errors.
inline constexpr double kMinHeightGapFraction = 0.01;
/// Smallest angular range of the yaws that determines a rotation center: 90 degrees, in rad.
inline constexpr double kMinArc_rad = 1.5707963267948966;

/// Finds the rotation in place in the captures: yaws, heights, axes, and approximate tilt and lever
/// arm. Members other than `status` are valid only if the status is `ok`.
/// @pre the number of intrinsics matches the lens model
RotationCaptures detect_pivots(const std::vector<Frame>& frames, const LampMap& map,
                               const Camera& camera);

}  // namespace vlp
