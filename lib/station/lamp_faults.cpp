// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/lamp_faults.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "calibration/levelling/map_doubt.h"
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
  int lamp;
};

/// The lamp without which the map fits best. Precondition: four lamps or more; with fewer than
/// three no residual tells.
Mend best_without(std::span<const Frame> frames, const LampMap& map,
                  const Calibration& calibration) {
  Mend best{kWorst_px, 0};
  for (std::size_t i = 0; i < map.lamps.size(); ++i) {
    LampMap without = map;
    without.lamps.erase(without.lamps.begin() + static_cast<std::ptrdiff_t>(i));
    const double misfit = misfit_px(frames, without, calibration);
    if (misfit < best.misfit_px) best = {misfit, map.lamps[i].id};
  }
  return best;
}

std::vector<std::string> unseen(std::span<const Frame> frames, const LampMap& map) {
  std::set<int> seen;
  for (const Frame& frame : frames) {
    for (const Detection& detection : frame.detections) seen.insert(detection.lamp);
  }
  std::vector<std::string> faults;
  for (const Lamp& lamp : map.lamps) {
    if (seen.contains(lamp.id)) continue;
    faults.push_back(
        fmt::format("lamp {} is never seen: is it lit, and not overexposed?", lamp.id));
  }
  return faults;
}

}  // namespace

std::vector<std::string> lamp_faults(std::span<const Frame> frames, const LampMap& map,
                                     const Calibration& calibration) {
  constexpr std::size_t least_frames = 3, least_lamps = 4;
  constexpr double fits_px = 1, far_better = 0.3;
  if (frames.size() < least_frames) return {};
  std::vector<std::string> faults = unseen(frames, map);
  std::string doubt = doubt_of_map(frames, map, calibration);
  if (!doubt.empty()) {
    faults.insert(faults.begin(), std::move(doubt));
    return faults;
  }
  const double now_px = misfit_px(frames, map, calibration);
  if (now_px < fits_px || map.lamps.size() < least_lamps) return faults;
  const Mend mend = best_without(frames, map, calibration);
  if (mend.misfit_px < far_better * now_px) {
    faults.insert(faults.begin(),
                  fmt::format("lamp {} is loose: it does not hang where the map says", mend.lamp));
  }
  return faults;
}

}  // namespace vlp
