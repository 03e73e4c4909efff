// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/turn_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "calibration/rotation/turning.h"
#include "positioning/positioner.h"

namespace vlp {
namespace {

constexpr double kTurn_rad = 2 * std::numbers::pi;

struct Seen {
  double z_m, lamps_above_m, yaw_rad;
  std::size_t number;
};

std::vector<Seen> fixes_of(const std::vector<Frame>& frames, const StationConfig& config,
                           const Calibration& calibration) {
  PositionerOptions options;
  options.correction = Correction::none;
  const Positioner positioner(config.lamps, calibration, options);
  double ceiling_m = 0;
  for (const Lamp& lamp : config.lamps.lamps) ceiling_m = std::max(ceiling_m, lamp.position_m.z());
  std::vector<Seen> seen;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Fix fix = positioner.locate(frames[i].detections);
    if (!fix.ok()) continue;
    const auto& pose = fix.estimate.pose;
    seen.push_back({pose.position_m.z(), ceiling_m - pose.position_m.z(), pose.yaw_rad, i});
  }
  std::sort(seen.begin(), seen.end(), [](const Seen& a, const Seen& b) { return a.z_m < b.z_m; });
  return seen;
}

}  // namespace

TurnMap turn_map(const std::vector<Frame>& frames, const StationConfig& config,
                 const Calibration& calibration) {
  constexpr double same_height = 0.06;  // spot_captures() decides
  const auto parts = static_cast<std::size_t>(config.enough.turn_captures);
  const auto seen = fixes_of(frames, config, calibration);
  TurnMap map;
  for (std::size_t begin = 0, end = 0; begin < seen.size(); begin = end) {
    TurnMap::Height height{seen[begin].z_m, 0, 0, std::vector<bool>(parts)};
    while (end < seen.size() &&
           seen[end].z_m - seen[begin].z_m < same_height * seen[begin].lamps_above_m) {
      ++end;
    }
    const std::span<const Seen> at_height(seen.data() + begin, end - begin);
    const Seen& first =
        *std::min_element(at_height.begin(), at_height.end(),
                          [](const Seen& a, const Seen& b) { return a.number < b.number; });
    std::vector<double> yaws_rad;
    for (const Seen& one : at_height) {
      yaws_rad.push_back(one.yaw_rad);
      const double turned = (one.yaw_rad - first.yaw_rad) / kTurn_rad;
      const double share = turned - std::floor(turned);
      const auto part = static_cast<std::size_t>(std::lround(share * double(parts)));
      height.parts[part % parts] = true;
    }
    height.captures = static_cast<int>(yaws_rad.size());
    height.arc_rad = arc_of(yaws_rad);
    map.heights.push_back(std::move(height));
  }
  const auto whole = std::count_if(map.heights.begin(), map.heights.end(), [&](const auto& h) {
    return h.captures >= config.enough.turn_captures && h.arc_rad >= config.enough.turn_arc_rad;
  });
  map.enough = whole >= config.enough.turn_heights;
  return map;
}

}  // namespace vlp
