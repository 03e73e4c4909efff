// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include "../geometry/frames.h"
#include "../rig/calibration.h"
#include "../rig/lamp_map.h"
#include "error_budget.h"
#include "unit_errors.h"

namespace vlp {

/// Places on the floor, row by row from (x_min, y_min), in metres of the world.
struct FloorGrid {
  double x_min_m;
  double x_max_m;
  double y_min_m;
  double y_max_m;
  double step_m;
};

/// The smallest grid around the lamps. Precondition: the map has lamps.
FloorGrid floor_under(const LampMap& map, double step_m);

/// The error budget over a floor.
struct FloorLimits {
  /// "lamp map", "lamp_map": for people, and for programs.
  struct Source {
    std::string_view name, key;
  };
  std::vector<Source> sources;

  /// What a camera at one place could reach.
  struct Place {
    Pose camera;
    /// Lamps that are seen whole.
    int lamps;
    /// Covariances of (X, Y, Z, yaw), one a source; empty where fewer than two lamps are seen, or
    /// they do not tell what else is to be estimated.
    std::vector<Matrix4> parts;

    Matrix4 total() const;
  };
  std::vector<Place> places;
};

/// The lamps of the map that a level camera at `pose` sees whole: the centre, and the rim when the
/// diameter is known, are in front of it and within the image.
std::vector<Eigen::Vector3d> visible_lamps(const LampMap& map, const Camera& camera,
                                           const Pose& pose);

/// The error budget at every place of the grid, for a level camera at height `z_m` and one yaw:
/// noise, centre, tilt, lamp map; after the noise motion and lean, where the prior, whose mean is
/// at rest and level, lets the camera move or lean. Throws std::invalid_argument when the grid has
/// a step that is not positive, no extent or more than ten million places, or the intrinsics are
/// not the lens model's. Precondition: the camera has row time and read-out where it may move.
FloorLimits floor_limits(const LampMap& map, const Camera& camera, const FloorGrid& grid,
                         double z_m, double yaw_rad, const ErrorSources& sources,
                         const BodyPrior& prior = {});

/// The same from what calibration and lamp map state of themselves, for this camera, which leans as
/// it does: noise, motion, lean, lens, zenith, offset where there is one, lamp map.
FloorLimits floor_limits(const UnitErrors& unit, const FloorGrid& grid, double z_m, double yaw_rad,
                         double noise_px, const BodyPrior& prior = {});

}  // namespace vlp
