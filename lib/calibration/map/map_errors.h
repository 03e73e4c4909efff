// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "captures/detections_table.h"
#include "geometry/frames.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"

/// Errors of a lamp map that captures reveal: the lamps concerned, with size and direction of the
/// error.
namespace vlp {

/// Kind of error of a lamp map, found by comparing the map with captures.
enum class MapErrorKind {
  moved,         // the position of a lamp is wrong
  inconsistent,  // a lamp contradicts the others in some captures, in varying directions
  swapped,       // positions or ids of two lamps are exchanged
  mirrored,      // the map is the mirror image of the room
  other_room,    // the lamps are far from their map positions for none of the causes above
  undetected     // no capture contains the lamp
};

/// Error of the map, of one lamp or of several.
struct MapError {
  MapErrorKind kind;
  /// Lamp ids; empty if the error concerns the whole map.
  std::vector<int> lamps = {};
  /// Kind `moved`: true position of the lamp minus its position in the map, in the world. z is 0
  /// except in results of an adjustment (calibration/adjustment).
  Eigen::Vector3d offset_m{0, 0, 0}, sd_m{0, 0, 0};
  /// Kind `inconsistent`: number of captures that contradict, and of captures that contain it.
  int contradicting_captures = 0, captures = 0;
};

/// Describes the error in one line: ids, offset in millimeters, direction, remedy.
std::string describe_map_error(const MapError& error);

/// Describes the number of lamps whose map position differs from that in an adjusted calibration
/// (Positioner::num_lamps_moved_since_calibration()).
/// @pre lamps >= 1
std::string describe_moved_lamps(int lamps);

/// Describes all errors in one line.
std::string describe_map_errors(std::span<const MapError> errors);

/// Displacement of one lamp: its position according to the other lamps minus its position in the
/// map, horizontal, in the world. If a single lamp moved by d, its displacement is d.
struct LampOffset {
  int lamp;
  /// Number of captures that contribute to the displacement.
  int captures;
  Eigen::Vector2d map_m, offset_m, sd_m;
};

/// Result of detect_map_errors().
struct MapErrors {
  std::vector<MapError> errors;
  /// Horizontal offset of every lamp from its position in the map, including insignificant ones.
  std::vector<LampOffset> offsets;

  /// Returns true if the map cannot be used: two lamps are swapped, or it is mirrored.
  bool is_map_unusable() const;
};

/// Options of detect_map_errors().
struct MapErrorOptions {
  /// Inclination of the base in each frame; empty: level.
  std::vector<std::optional<Inclination>> inclinations = {};
  /// Yaw of the camera on the robot that has the inclinations.
  double yaw_in_robot_rad = 0;
  /// Smallest offset that is an error, projected to the image; a well calibrated lens may have
  /// errors of this size. Outliers of an unsteady lamp have to be five times as large.
  double min_offset_px = 0.25;
  /// If there are more captures, every n-th is used. More captures barely change the result.
  std::size_t max_captures = 500;
};

/// Finds the errors of a lamp map from captures of a stationary camera.
///
/// @param calibration  without a rotation center, the tilt of the camera is also estimated
/// @return             no errors if too few captures tie the lamps together
///
/// Tests the displacements x of the lamps in an adjustment with exact lens and heights
/// (adjust_bundle(), MapPrior::heights). Each of these lamps is in two captures with two others:
///   x = P (d + m) + e
///   P  projector onto the displacements that are no similarity of the map
///   d  offsets of k lamps
///   m  survey errors: variance sd_m^2 of the lamp plus tau^2, common to all lamps
///   e  noise of the captures
/// tau^2 >= 0 is the smallest value for which the weighted squares chi^2 of x - P d do not exceed
/// f. Their degrees of freedom are f = count_determined(P) - 2 k.
///
/// Lamps enter d one by one, by the largest drop of chi^2. The result is the largest set in which
/// no lamp can be replaced by another one with an increase of chi^2 below
///   f ((p / N)^(-2 / f) - 1)    F distribution with 2 and f degrees of freedom
///   -2 ln(p / N)                chi-squared instead, if every lamp has an sd_m
/// p = 0.01 is the probability of a false alarm. N = binomial(lamps, k) sets are tested together.
///
/// Few lamps: the bound is 800 for one of four lamps, 85 of five, 45 of six, 28 of eight; 12 to 13
/// with sd_m. For three lamps no displaced lamp can be identified. For n lamps fewer than n / 2 can
/// be, and at most eight.
///
/// Two lamps are reported as swapped, or the map as mirrored, if such a map reduces chi^2 by the
/// bound. The bound is that with k = 0 and N = all pairs. For two lamps it also has to be smaller
/// than for any other pair.
///
/// If the captures contradict the map, the adjustment of the swapped or mirrored map has to explain
/// them; swapped lamps are then found in maps of up to ten lamps.
///
/// Limits:
///   - Only horizontal errors are estimated.
///   - Captures cannot determine scale, position and rotation of the map. An error of the focal
///     length acts as one of the scale (session/lamp_causes.h).
///   - Several lamps that are displaced equally can mask each other.
///   - If sd_m is smaller than the true errors of the survey, false alarms are more frequent (3 to
///     5 % if the errors are twice as large).
MapErrors detect_map_errors(std::span<const Frame> frames, const LampMap& map,
                            const Calibration& calibration, const MapErrorOptions& options = {});

/// Finds the lamps of the map that no frame contains. In a large room this is no error.
std::vector<MapError> list_undetected_lamps(std::span<const Frame> frames, const LampMap& map);

}  // namespace vlp
