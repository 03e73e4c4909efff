// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/fix_summary.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace vlp {
namespace {

/// The lower median. Precondition: not empty.
double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

FixSummary summarize(std::span<const FixRow> rows) {
  FixSummary summary;
  summary.frames = rows.size();
  std::vector<double> residual_px, horizontal_m, height_m, yaw_rad;
  std::vector<int> lamps;
  for (const FixRow& row : rows) {
    if (!row.fix) {
      ++summary.refused[row.status];
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
  const auto [fewest, most] = std::minmax_element(lamps.begin(), lamps.end());
  double sum = 0;
  for (const int count : lamps) sum += count;
  summary.typical = {*fewest, *most, sum / static_cast<double>(lamps.size()), {}};
  if (!residual_px.empty()) summary.typical->median_residual_px = median(residual_px);
  if (!yaw_rad.empty()) {
    summary.median_sd = {median(horizontal_m), median(height_m), median(yaw_rad)};
  }
  return summary;
}

}  // namespace vlp
