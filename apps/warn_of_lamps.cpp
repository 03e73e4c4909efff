// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "warn_of_lamps.h"

#include <spdlog/spdlog.h>

#include <algorithm>

#include "detection/identity/lamp_map_check.h"

namespace vlp {
namespace {

constexpr std::size_t kMostLines = 5;

void warn_of_rest(std::size_t count, const char* what) {
  if (count > kMostLines) spdlog::warn("and {} more {}", count - kMostLines, what);
}

}  // namespace

void warn_of_lamps(const LampMap& lamps, const DetectorCamera& detector,
                   const std::optional<Calibration>& calibration,
                   const std::optional<double>& exposure_s) {
  std::optional<double> focal_px;
  if (calibration) {
    focal_px = calibration->camera.intrinsics[detector.readout == Readout::rows ? 1 : 0];
  }
  const StripeConditions conditions{*detector.row_time_s, focal_px, 0, exposure_s};
  const auto alike = lamps_alike(lamps, conditions);
  for (std::size_t i = 0; i < std::min(alike.size(), kMostLines); ++i) {
    const auto& [first, second, gap, needed] = alike[i];
    spdlog::warn(
        "lamps {} and {} may be left unknown, seen from z = 0: their frequencies differ by {:.1f} "
        "%, {:.1f} % would be enough; change one of the two frequencies, or a duty by 0.3",
        first, second, 100 * gap, 100 * needed);
  }
  warn_of_rest(alike.size(), "pairs of lamps with frequencies that are too near");
  const auto unreadable = lamps_unreadable(lamps, conditions);
  for (std::size_t i = 0; i < std::min(unreadable.size(), kMostLines); ++i) {
    const auto& [lamp, period_lines, periods, contrast] = unreadable[i];
    if (period_lines < kShortestPeriod_lines) {
      spdlog::warn(
          "lamp {} has stripes of {:.2g} lines, too fine to be seen: a lower frequency shows them",
          lamp, period_lines);
    } else if (periods < kLeastPeriods) {
      spdlog::warn(
          "lamp {} shows only {:.1f} stripes, seen from z = 0: a higher frequency, a larger lamp "
          "or "
          "a camera nearer to it shows more",
          lamp, periods);
    } else {
      spdlog::warn(
          "lamp {} has {:.0f} % of its stripes left after an exposure of {:.3g} us: expose shorter",
          lamp, 100 * contrast, 1e6 * *exposure_s);
    }
  }
  warn_of_rest(unreadable.size(), "lamps with stripes that can hardly be seen");
}

}  // namespace vlp
