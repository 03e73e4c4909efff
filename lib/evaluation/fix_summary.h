// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>

#include "captures/fixes_table.h"

namespace vlp {

/// Summary of the fixes of a set of frames: counts, lamps, residuals, reported standard deviations.
struct FixSummary {
  std::size_t frames = 0;
  std::size_t fixes = 0;
  /// Number of frames without a fix, by the word of their status, for example "too_few_lamps"
  /// (fix_status_name()). Statuses that do not occur are missing.
  std::map<std::string, std::size_t> failures_by_status;
  /// Statistics over the frames with a fix; std::nullopt if there are none.
  struct FixStatistics {
    int min_lamps, max_lamps;
    double mean_lamps;
    /// Median over the fixes from three lamps or more; fewer lamps yield no residual.
    std::optional<double> median_residual_px;
  };
  std::optional<FixStatistics> statistics;
  /// Medians of the reported standard deviations: horizontal (root of the sum of the squares of x
  /// and y), height, yaw. std::nullopt if no fix reports them.
  struct MedianSds {
    double horizontal_m, height_m, yaw_rad;
  };
  std::optional<MedianSds> median_sd;
};

/// Counts fixes and failures, and computes the medians over the fixes.
FixSummary summarize_fixes(std::span<const FixRow> rows);

}  // namespace vlp
