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

/// One lamp in one capture.
struct SpotObservation {
  /// Indices in SpotCaptures.
  std::size_t capture;
  std::size_t lamp;
  Eigen::Vector2d pixel;
  double sigma_px;
  /// Of the pixel, unit length, in the camera.
  Eigen::Vector3d ray;
  /// How the pixel moves with the ray; it takes the ray itself to zero.
  Eigen::Matrix<double, 2, 3> d_pixel_d_ray;
};

struct SpotCapture {
  std::string image;
  /// Index in SpotCaptures::heights.
  std::size_t height;
  double yaw_rad;
};

/// The captures at one height.
struct SpotHeight {
  /// Of the camera.
  double z_m;
  /// Where the axis of rotation stands.
  Eigen::Vector2d axis_m;
  /// The full turn less the widest gap between neighbouring yaws.
  double arc_rad;
  int captures;
};

/// Whether captures show a turn on the spot. name and explanation are for people.
enum class SpotStatus {
  ok,
  other_map,         // no lamp of the map is seen, or those that are do not fit it
  too_few_lamps,     // fewer than two lamps, or than two in each capture
  too_few_captures,  // fewer than three at any height
  alike,             // all captures with one yaw
  short_arc,         // less than 90 degrees at every height
  moved              // not on one spot
};

/// What it means and what to add, for people.
std::string_view explanation_of(SpotStatus status);

/// Captures while turning on the spot about a vertical axis. At A with yaw g, the camera at lever
/// arm e from the axis (level frame) sees lamp P, the axis at the height of the camera being its
/// origin, at
///   x_in_camera ~ camera_from_level(zenith) (Rz(-g) (P - A) - e).
/// The values here come from fixes with the lamp map and are good to start from: found in closed
/// form, without a guess, in a few rounds of
///   fix_k = A + e^{jg_k} (e + H_k delta),
/// which is linear in A, e and in delta, what is left of the tilt. Weighted against outliers.
/// Heights are told apart where there is a gap between the fixes' distances from the lamps, of
/// three of their standard deviations or more, and of kLeastGap of the distance or more.
struct SpotCaptures {
  SpotStatus status = SpotStatus::ok;
  /// Those of the map that are seen, in its order.
  std::vector<Lamp> lamps;
  std::vector<SpotCapture> captures;
  /// From low to high.
  std::vector<SpotHeight> heights;
  std::vector<SpotObservation> sightings;
  /// The middle one of the detections' sigma_px; nothing unless all state it.
  std::optional<double> stated_px = {};
  Eigen::Vector3d zenith_in_camera = Eigen::Vector3d::UnitZ();
  /// Zero at one height.
  Eigen::Vector2d lever_arm_m = Eigen::Vector2d::Zero();
  struct LeftOut {
    std::string image;
    std::string reason;
  };
  /// Captures that are not used.
  std::vector<LeftOut> left_out;
};

/// Noise apart, captures at one height differ by less than this share of their distance from the
/// lamps: floors are uneven, lamp maps a little wrong.
inline constexpr double kLeastGap = 0.01;
/// The least arc that determines a centre of rotation.
inline constexpr double kLeastArc_rad = 1.5707963267948966;

/// Precondition: the intrinsics are the lens model's. The other parts of `calibration` do not
/// matter.
SpotCaptures spot_captures(const std::vector<Frame>& frames, const LampMap& map,
                           const Camera& camera);

}  // namespace vlp
