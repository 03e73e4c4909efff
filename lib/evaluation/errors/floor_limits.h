// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include "evaluation/errors/unit_errors.h"
#include "geometry/frames.h"
#include "positioning/error_budget.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"

namespace vlp {

/// Grid of positions on the floor, row by row from (x_min, y_min), in meters of the world.
struct FloorGrid {
  double x_min_m;
  double x_max_m;
  double y_min_m;
  double y_max_m;
  double step_m;
};

/// Returns a grid over the bounding rectangle of all lamp positions, parallel to the axes of the
/// world, with the step `step_m`.
/// @pre the map has lamps
FloorGrid make_floor_grid(const LampMap& map, double step_m);

/// Error budget of fixes at each position of a floor grid, by error source.
struct FloorLimits {
  /// Name of an error source, such as "lamp map", and its machine-readable key, such as "lamp_map".
  struct Source {
    std::string_view name, key;
  };
  std::vector<Source> sources;

  /// Predicted covariance of a fix at one position.
  struct Position {
    Pose camera;
    /// Number of lamps that are fully visible.
    int lamps;
    /// Covariances of (X, Y, Z, yaw), one for each source. Empty if fewer than two lamps are
    /// visible, or if these do not determine all estimated quantities.
    std::vector<Matrix4> covariances;

    Matrix4 total_pose_covariance() const;
  };
  std::vector<Position> positions;
};

/// Returns the positions of the lamps that are fully visible to a level camera at `pose`. Such a
/// lamp has its center, and its rim if the diameter is known, in front of the camera and within the
/// image.
std::vector<Eigen::Vector3d> list_visible_positions(const LampMap& map, const Camera& camera,
                                                    const Pose& pose);

/// Computes the error budget at every position of the grid, for a level camera at height `z_m` and
/// yaw `yaw_rad`. Sources: noise, center, tilt, lamp map. Motion, then roll and pitch follow the
/// noise if the prior leaves them free; its mean is at rest and level.
/// @throws std::invalid_argument if the step is not positive; if the grid has no extent or more
///     than ten million positions; if the intrinsics do not match the lens model
/// @pre the camera has row time and readout direction if it may move
FloorLimits compute_floor_limits(const LampMap& map, const Camera& camera, const FloorGrid& grid,
                                 double z_m, double yaw_rad, const ErrorSources& sources,
                                 const BodyPrior& prior = {});

/// Computes the same for a calibrated camera with its tilt, from the reported uncertainties of
/// calibration and lamp map. Sources: noise, motion, roll and pitch, lens, zenith, offset if there
/// is one, lamp map.
FloorLimits compute_floor_limits(const UnitErrors& unit, const FloorGrid& grid, double z_m,
                                 double yaw_rad, double noise_px, const BodyPrior& prior = {});

/// Standard deviations of a fix. `horizontal_m` is the root of the sum of the variances of x and y.
/// Negative variances, which result from rounding, count as zero.
struct FixSds {
  double horizontal_m;
  double height_m;
  double yaw_rad;
};

/// Returns the standard deviations of a covariance of (X, Y, Z, yaw).
FixSds compute_fix_sds(const Matrix4& covariance);

/// Summary of the error budget of a floor: median and maximum for each source alone and for all
/// sources together. Taken over the positions where at least two lamps are visible, for each
/// statistic separately.
struct FloorSummary {
  struct Row {
    /// Source of the row (FloorLimits::sources).
    FloorLimits::Source source;
    FixSds median;
    FixSds worst;
    /// Fraction of the sum of the horizontal variances that is due to this source.
    double fraction;
  };
  /// One row per source, in the order of FloorLimits::sources.
  std::vector<Row> sources;
  Row total;
  std::size_t positions_with_fix;

  /// Returns the source with the largest fraction, which has the greatest potential for
  /// improvement.
  const Row& largest_error_source() const;
};

/// Computes the summary. Returns std::nullopt if no position has a fix.
std::optional<FloorSummary> summarize_limits(const FloorLimits& limits);

}  // namespace vlp
