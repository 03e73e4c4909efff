// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/lamp_faults.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "positioning/positioner.h"

namespace vlp {
namespace {

/// A residual is counted up to this; so is a capture without a fix, or with a lamp that the others
/// contradict.
constexpr double kWorst_px = 20;

/// How badly a map fits: the mean over the captures of three lamps or more.
double misfit_px(std::span<const Frame> frames, const LampMap& map,
                 const Calibration& calibration) {
  const Positioner positioner(map, calibration);
  double sum_px = 0;
  int count = 0;
  for (const Frame& frame : frames) {
    const Fix fix = positioner.locate(frame.detections);
    const auto known = static_cast<int>(frame.detections.size()) - fix.unknown_lamps;
    if (known < 3) continue;
    const bool bad = !fix.ok() || fix.rejected_lamps > 0;
    sum_px += bad ? kWorst_px : std::min(kWorst_px, fix.residual_px);
    ++count;
  }
  return count > 0 ? sum_px / count : kWorst_px;
}

struct Mend {
  double misfit_px;
  std::string fault;
};

std::vector<Mend> mends(std::span<const Frame> frames, const LampMap& map,
                        const Calibration& calibration) {
  const auto& lamps = map.lamps;
  std::vector<Mend> found;
  for (std::size_t a = 0; a < lamps.size(); ++a) {
    for (std::size_t b = a + 1; b < lamps.size(); ++b) {
      LampMap swapped = map;
      std::swap(swapped.lamps[a].position_m, swapped.lamps[b].position_m);
      found.push_back({misfit_px(frames, swapped, calibration),
                       fmt::format("lamps {} and {} are swapped", lamps[a].id, lamps[b].id)});
    }
    if (lamps.size() < 4) continue;  // with fewer than three no residual tells
    LampMap without = map;
    without.lamps.erase(without.lamps.begin() + static_cast<std::ptrdiff_t>(a));
    found.push_back(
        {misfit_px(frames, without, calibration),
         fmt::format("lamp {} is loose: it does not hang where the map says", lamps[a].id)});
  }
  return found;
}

std::vector<std::string> unseen(std::span<const Frame> frames, const LampMap& map) {
  std::set<int> seen;
  for (const Frame& frame : frames) {
    for (const Detection& detection : frame.detections) seen.insert(detection.lamp);
  }
  std::vector<std::string> faults;
  for (const Lamp& lamp : map.lamps) {
    if (seen.contains(lamp.id)) continue;
    faults.push_back(fmt::format("lamp {} is never seen: is it lit?", lamp.id));
  }
  return faults;
}

}  // namespace

std::vector<std::string> lamp_faults(std::span<const Frame> frames, const LampMap& map,
                                     const Calibration& calibration) {
  constexpr std::size_t least_frames = 3;
  constexpr double fits_px = 1, far_better = 0.3;
  if (frames.size() < least_frames) return {};
  std::vector<std::string> faults = unseen(frames, map);
  const double now_px = misfit_px(frames, map, calibration);
  if (now_px < fits_px) return faults;
  auto found = mends(frames, map, calibration);
  std::sort(found.begin(), found.end(),
            [](const Mend& a, const Mend& b) { return a.misfit_px < b.misfit_px; });
  if (!found.empty() && found.front().misfit_px < far_better * now_px) {
    faults.insert(faults.begin(), found.front().fault);
  }
  return faults;
}

}  // namespace vlp
