// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/steps/print_fixes.h"

#include <fmt/core.h>

#include "geometry/angles.h"

namespace vlp {

void print_fixes(const FixSummary& summary) {
  fmt::print("frames      {}\nfixes       {}\n", summary.frames, summary.fixes);
  for (const auto& [status, count] : summary.refused) {
    fmt::print("  no fix    {} {}\n", count, status);
  }
  if (const auto& typical = summary.typical) {
    fmt::print("lamps       {:.1f} a fix ({} to {})\n", typical->mean_lamps, typical->min_lamps,
               typical->max_lamps);
    if (const auto& residual_px = typical->median_residual_px) {
      fmt::print("residual    {:.3f} px (median)\n", *residual_px);
    }
  }
  if (const auto& sd = summary.median_sd) {
    fmt::print("sd          {:.2f} mm horizontal, {:.2f} mm height, {:.3f} deg yaw (median)\n",
               1e3 * sd->horizontal_m, 1e3 * sd->height_m, deg_from_rad(sd->yaw_rad));
  }
}

}  // namespace vlp
