// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibration/map/lamp_displacements.h"
#include "captures/detections_table.h"
#include "geometry/frames.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"

/// Errors of a lamp map that captures show: which lamp, by how much, in which direction.
namespace vlp {

enum class MapErrorKind {
  moved,       // a lamp hangs elsewhere
  unsteady,    // a lamp contradicts the others in some captures, in varying directions
  swapped,     // two lamps have each other's place or id
  mirrored,    // the map is the mirror image of the room
  other_room,  // the lamps are nowhere near their places, without one of the causes above
  unseen       // a lamp is in no capture
};

struct MapError {
  MapErrorKind kind;
  /// Ids; empty if the error concerns the whole map.
  std::vector<int> lamps = {};
  /// Kind `moved`: where the lamp hangs minus its place in the map, in the world. z is 0 except
  /// from an adjustment (calibration/adjustment).
  Eigen::Vector3d offset_m{0, 0, 0}, sd_m{0, 0, 0};
  /// Kind `unsteady`: captures that contradict, and captures that contain the lamp.
  int contradicting = 0, captures = 0;
};

/// Describes the error in one line: ids, millimetres, direction, what to check.
std::string describe(const MapError& error);

/// Describes the lamps that the map of an adjusted calibration has elsewhere, one or more
/// (Positioner::lamps_elsewhere()).
std::string describe_lamps_elsewhere(int lamps);

/// Describes all errors in one line.
std::string describe(std::span<const MapError> errors);

struct MapErrors {
  std::vector<MapError> errors;
  /// Offset of every lamp, significant or not.
  std::vector<LampOffset> offsets;

  /// Returns true if the map cannot be used: two lamps are swapped, or it is mirrored.
  bool is_unusable() const;
};

struct MapErrorOptions {
  /// Inclination of the base, in the order of the frames; empty: level.
  std::vector<std::optional<Inclination>> inclinations = {};
  /// Yaw of the camera on the robot whose inclinations are given.
  double yaw_in_robot_rad = 0;
  /// Smallest offset that is an error, as seen in the image: a good lens may have errors of this
  /// size. Outliers of an unsteady lamp have to be five times as large.
  double min_offset_px = 0.25;
  /// Every n-th capture is used if there are more. More captures hardly change the result.
  std::size_t max_captures = 500;
};

/// Finds the errors of a lamp map from captures of a camera that stands.
///
/// @param calibration  without a rotation centre the tilt of the camera is estimated, too
///
/// Tests the displacements x of estimate_lamp_displacements():
///   x = P (d + m) + e
///   P  projector onto the displacements that are no similarity of the map
///   d  offsets of k lamps
///   m  survey errors: variance sd_m^2 of the lamp plus tau^2 that all lamps share
///   e  noise of the captures
/// tau^2 >= 0 is chosen so that the weighted squares chi^2 of x - P d do not exceed their degrees
/// of freedom f = rank(P) - 2 k. Lamps enter d one by one, by the largest drop of chi^2. The
/// largest set counts in which no lamp can be replaced by another one with an increase of chi^2
/// below
///   f ((p / N)^(-2 / f) - 1)    F distribution with 2 and f degrees of freedom
///   -2 ln(p / N)                chi-squared instead, if every lamp states its sd_m
/// p = 0.01 is the probability of a false alarm. N = binomial(lamps, k) sets are tested together.
///
/// Small numbers: the bound is 800 for one of four lamps, 85 of five, 45 of six, 28 of eight; 12 to
/// 13 with sd_m. None of three lamps can be named, and of n lamps fewer than n / 2 and eight at
/// most.
///
/// Two lamps are swapped, or the map is mirrored, if with such a map chi^2 is smaller by the bound
/// with k = 0 and N = all pairs, and for two lamps also smaller than for any other two.
///
/// Limits: horizontal errors only. Captures cannot determine scale, position and rotation of the
/// map; an error of the focal length acts as one of the scale (station/lens_fault.h). Several lamps
/// that are displaced alike can hide each other. With sd_m smaller than the true errors of the
/// survey, false alarms are more frequent (3 to 5 % if the errors are twice as large).
/// Returns no errors if too few captures tie the lamps together.
MapErrors find_map_errors(std::span<const Frame> frames, const LampMap& map,
                          const Calibration& calibration, const MapErrorOptions& options = {});

/// Finds the lamps of the map that are in no frame. In a large room that is no error.
std::vector<MapError> find_unseen_lamps(std::span<const Frame> frames, const LampMap& map);

}  // namespace vlp
