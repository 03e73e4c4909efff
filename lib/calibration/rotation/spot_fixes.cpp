// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/spot_fixes.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "geometry/median.h"

namespace vlp {
namespace {

bool determines(const SpotArc& spot) {
  return spot.captures >= kLeastCaptures && spot.arc_rad >= kLeastArc_rad;
}

}  // namespace

void tell_heights_apart(SpotFixes& fixes, double noise_m) {
  constexpr double clear_sigmas = 3;
  std::vector<std::size_t> order(fixes.fixes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return fixes.fixes[a].height_m > fixes.fixes[b].height_m;
  });
  fixes.spots = 0;
  double last_m = 0;
  for (const std::size_t i : order) {
    const double height_m = fixes.fixes[i].height_m;
    const double gap_m = std::max(clear_sigmas * noise_m, kLeastGap * last_m);
    if (fixes.spots == 0 || last_m - height_m > gap_m) ++fixes.spots;
    fixes.fixes[i].spot = fixes.spots - 1;
    last_m = height_m;
  }
}

std::vector<SpotArc> arcs_of(const SpotFixes& fixes) {
  std::vector<std::vector<double>> yaws_rad(fixes.spots);
  for (const TurningFix& fix : fixes.fixes) yaws_rad[fix.spot].push_back(fix.pose.yaw_rad);
  std::vector<SpotArc> arcs;
  arcs.reserve(fixes.spots);
  for (const auto& yaws : yaws_rad) arcs.push_back({yaws.size(), arc_of(yaws)});
  return arcs;
}

SpotStatus status_of(const std::vector<SpotArc>& arcs) {
  constexpr double alike_rad = 0.05;
  SpotStatus status = SpotStatus::too_few_captures;
  bool turned = false;
  for (const SpotArc& spot : arcs) {
    if (determines(spot)) return SpotStatus::ok;
    if (spot.captures < kLeastCaptures) continue;
    turned = turned || spot.arc_rad > alike_rad;
    status = turned ? SpotStatus::short_arc : SpotStatus::alike;
  }
  return status;
}

void drop_weak_spots(SpotFixes& fixes, const std::vector<SpotArc>& arcs) {
  std::vector<std::size_t> place(fixes.spots);
  SpotFixes kept;
  kept.spots = 0;
  for (std::size_t spot = 0; spot < fixes.spots; ++spot) {
    place[spot] = kept.spots;
    if (determines(arcs[spot])) ++kept.spots;
  }
  for (std::size_t i = 0; i < fixes.fixes.size(); ++i) {
    TurningFix fix = fixes.fixes[i];
    if (!determines(arcs[fix.spot])) continue;
    fix.spot = place[fix.spot];
    kept.frames.push_back(fixes.frames[i]);
    kept.fixes.push_back(fix);
  }
  fixes = std::move(kept);
}

double height_of(const SpotFixes& fixes, std::size_t spot) {
  std::vector<double> heights_m;
  for (const TurningFix& fix : fixes.fixes) {
    if (fix.spot == spot) heights_m.push_back(fix.height_m);
  }
  return upper_median(heights_m);
}

}  // namespace vlp
