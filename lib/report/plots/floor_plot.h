// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "evaluation/errors/floor_limits.h"
#include "rig/lamp_map.h"

namespace vlp {

/// Quantity over the floor, for a color map with the lamps on it.
struct FloorPlot {
  struct Position {
    Eigen::Vector2d xy_m;
    /// Value of the plotted quantity at the floor position xy_m, in the unit that FloorPlot::label
    /// names. std::nullopt leaves the position blank.
    std::optional<double> value;
  };
  std::string title;
  /// Label of the values, with their unit.
  std::string label;
  /// Distance between neighboring positions.
  double step_m;
  std::vector<Position> positions;
};

/// Collects the horizontal standard deviation from all sources, in mm; blank where no fix is
/// possible.
FloorPlot make_floor_plot(const FloorLimits& limits, const std::string& title, double step_m);

/// Writes the plot as .png or .svg, by the extension of `file`.
/// @throws InputError as write_plot()
void write_floor_plot(const std::filesystem::path& file, const FloorPlot& plot,
                      const LampMap& lamps);

}  // namespace vlp
