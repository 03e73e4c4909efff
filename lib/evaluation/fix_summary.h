// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>

#include "captures/fixes_table.h"

namespace vlp {

/// What a run of fixes amounts to.
struct FixSummary {
  std::size_t frames = 0;
  std::size_t fixes = 0;
  /// Frames without a fix, by their status.
  std::map<std::string, std::size_t> refused;
  /// Of the frames with a fix; nothing when there is none.
  struct Typical {
    int fewest_lamps, most_lamps;
    double mean_lamps;
    /// Of the fixes of three lamps or more; fewer leave no residual.
    std::optional<double> median_residual_px;
  };
  std::optional<Typical> typical;
  /// Medians of the reported standard deviations: horizontal (root of the sum of the squares of x
  /// and y), height, yaw; nothing when there are none.
  struct Spread {
    double horizontal_m, height_m, yaw_rad;
  };
  std::optional<Spread> median_sd;
};

FixSummary summarize(std::span<const FixRow> rows);

}  // namespace vlp
