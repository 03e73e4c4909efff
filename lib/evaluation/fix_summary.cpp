// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/fix_summary.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "geometry/median.h"

namespace vlp {

FixSummary summarize_fixes(std::span<const FixRow> rows) {
  FixSummary summary;
  summary.frames = rows.size();
  std::vector<double> residual_px, horizontal_m, height_m, yaw_rad;
  std::vector<int> lamps;
  for (const FixRow& row : rows) {
    if (!row.fix) {
      ++summary.failures_by_status[row.status];
      continue;
    }
    lamps.push_back(row.lamps);
    if (row.lamps > 2) residual_px.push_back(row.fix->residual_px);
    if (!row.fix->sd) continue;
    const Eigen::Vector4d& sd = *row.fix->sd;
    horizontal_m.push_back(std::hypot(sd[0], sd[1]));
    height_m.push_back(sd[2]);
    yaw_rad.push_back(sd[3]);
  }
  summary.fixes = lamps.size();
  if (lamps.empty()) return summary;
  const auto [min_lamps, max_lamps] = std::minmax_element(lamps.begin(), lamps.end());
  double sum = 0;
  for (const int count : lamps) sum += count;
  summary.statistics = {*min_lamps, *max_lamps, sum / static_cast<double>(lamps.size()), {}};
  if (!residual_px.empty()) summary.statistics->median_residual_px = lower_median(residual_px);
  if (!yaw_rad.empty()) {
    summary.median_sd = {lower_median(horizontal_m), lower_median(height_m), lower_median(yaw_rad)};
  }
  return summary;
}

}  // namespace vlp
