// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/levelling/map_diagnosis.h"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "positioning/positioner.h"
#include "rig/find_lamp.h"

namespace vlp {
namespace {

/// As many captures, and as many lamps to be exchanged, as are looked at.
constexpr std::size_t kMostCaptures = 60, kMostLamps = 40;

/// The detections of captures that see three lamps of the map, without their noise: what
/// contradicts the others by it may be a tilt.
std::vector<std::vector<Detection>> captures_of(std::span<const Frame> frames, const LampMap& map) {
  std::vector<std::vector<Detection>> captures;
  for (const Frame& frame : frames) {
    std::vector<Detection> known;
    for (const Detection& detection : frame.detections) {
      if (find_lamp(map.lamps, detection.lamp) == nullptr) continue;
      known.push_back({detection.lamp, detection.pixel, {}});
    }
    if (known.size() > 2) captures.push_back(std::move(known));
  }
  const std::size_t stride = 1 + captures.size() / kMostCaptures;
  std::vector<std::vector<Detection>> some;
  for (std::size_t i = 0; i < captures.size(); i += stride) some.push_back(std::move(captures[i]));
  return some;
}

struct Tally {
  std::size_t agree = 0, mirrored = 0, refused = 0;
};

Tally tally(const std::vector<std::vector<Detection>>& captures, const LampMap& map,
            const Calibration& calibration) {
  const Positioner positioner(map, calibration);
  Tally result;
  for (const auto& detections : captures) {
    const Fix fix = positioner.locate(detections);
    if (fix.ok() && fix.rejected_lamps == 0) ++result.agree;
    if (fix.status == FixStatus::mirrored_map) ++result.mirrored;
    if (!fix.ok()) ++result.refused;
  }
  return result;
}

struct Exchange {
  int first = -1, second = -1;
  std::size_t agree = 0, next_best = 0;
};

/// The exchange of two lamps after which most captures agree with the map.
Exchange best_exchange(const std::vector<std::vector<Detection>>& captures, LampMap map,
                       const Calibration& calibration) {
  Exchange best;
  const std::size_t lamps = std::min(map.lamps.size(), kMostLamps);
  for (std::size_t i = 0; i < lamps; ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      std::swap(map.lamps[i].position_m, map.lamps[k].position_m);
      const std::size_t agree = tally(captures, map, calibration).agree;
      std::swap(map.lamps[i].position_m, map.lamps[k].position_m);
      if (agree > best.agree) {
        best = {map.lamps[k].id, map.lamps[i].id, agree, best.agree};
      } else {
        best.next_best = std::max(best.next_best, agree);
      }
    }
  }
  return best;
}

}  // namespace

std::string diagnose_map(std::span<const Frame> frames, const LampMap& map,
                         const Calibration& calibration) {
  const auto captures = captures_of(frames, map);
  const auto are_most = [&](std::size_t count) { return 2 * count > captures.size(); };
  if (captures.empty()) return "";
  const Tally now = tally(captures, map, calibration);
  if (are_most(now.agree)) return "";
  const Exchange exchange = best_exchange(captures, map, calibration);
  const bool clear = exchange.agree >= 2 * std::max(now.agree, exchange.next_best);
  if (are_most(exchange.agree) && clear && exchange.agree > now.mirrored) {
    const auto [first, second] = std::minmax(exchange.first, exchange.second);
    return "lamps " + std::to_string(first) + " and " + std::to_string(second) +
           " look swapped: the captures fit the map once these two change places or ids";
  }
  if (are_most(now.mirrored)) {
    return "the lamp map looks mirrored, as if drawn as seen from below: the captures fit its "
           "mirror image; turn the sign of x or of y of every lamp";
  }
  return "";
}

bool contradicts_map(std::span<const Frame> frames, const LampMap& map,
                     const Calibration& calibration) {
  const auto captures = captures_of(frames, map);
  return 2 * tally(captures, map, calibration).refused > captures.size();
}

}  // namespace vlp
