// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "positioning/floor_limits.h"
#include "rig/lamp_map.h"

namespace vlp {

/// A figure over the floor, to be drawn as a coloured map with the lamps on it.
struct FloorPlot {
  struct Place {
    Eigen::Vector2d xy_m;
    /// Nothing where there is no figure: left blank.
    std::optional<double> value;
  };
  std::string title;
  /// Of the values, with their unit.
  std::string label;
  /// Distance between neighbouring places.
  double step_m;
  std::vector<Place> places;
};

/// The horizontal standard deviation of all sources together, in mm; blank where there is no fix.
FloorPlot plot_of(const FloorLimits& limits, const std::string& title, double step_m);

/// Draws it, .png or .svg by the ending. Throws InputError, see draw().
void draw_floor_plot(const std::filesystem::path& picture, const FloorPlot& plot,
                     const LampMap& lamps);

}  // namespace vlp
