// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/lamp_faults.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include "calibration/levelling/map_diagnosis.h"
#include "lamps/signal/lamp_rule.h"
#include "positioning/positioner.h"

namespace vlp {
namespace {

/// A residual is counted up to this; so is a capture without a fix, or with a lamp that the others
/// contradict.
constexpr double kWorst_px = 20;

/// Fewer captures tell nothing of lamps.
constexpr std::size_t kLeastFrames = 3;

/// How badly a map fits each capture; nothing for one of fewer than three lamps, of which no
/// residual tells.
using Misfits = std::vector<std::optional<double>>;

Misfits misfits_px(std::span<const Frame> frames, const LampMap& map,
                   const Calibration& calibration) {
  const Positioner positioner(map, calibration);
  Misfits misfits(frames.size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Fix fix = positioner.locate(frames[i].detections);
    const auto known = static_cast<int>(frames[i].detections.size()) - fix.unknown_lamps;
    if (known < 3) continue;
    const bool bad = !fix.ok() || fix.rejected_lamps > 0;
    misfits[i] = bad ? kWorst_px : std::min(kWorst_px, fix.residual_px);
  }
  return misfits;
}

double mean_misfit_px(const Misfits& misfits) {
  double sum_px = 0;
  int count = 0;
  for (const auto& misfit_px : misfits) {
    sum_px += misfit_px.value_or(0);
    count += misfit_px ? 1 : 0;
  }
  return count > 0 ? sum_px / count : kWorst_px;
}

bool sees(const Frame& frame, int lamp) {
  return std::any_of(frame.detections.begin(), frame.detections.end(),
                     [&](const Detection& detection) { return detection.lamp == lamp; });
}

/// How much smaller a misfit without a lamp is that is held against the lamp.
constexpr double kFarBetter = 0.3;

struct Mend {
  int lamp;
  Misfits misfits;
};

/// The lamp without which the map fits best. Precondition: four lamps or more.
Mend best_without(std::span<const Frame> frames, const LampMap& map,
                  const Calibration& calibration) {
  Mend best{0, Misfits(frames.size())};
  for (std::size_t i = 0; i < map.lamps.size(); ++i) {
    LampMap without = map;
    without.lamps.erase(without.lamps.begin() + static_cast<std::ptrdiff_t>(i));
    Misfits misfits = misfits_px(frames, without, calibration);
    if (mean_misfit_px(misfits) < mean_misfit_px(best.misfits)) {
      best = {map.lamps[i].id, std::move(misfits)};
    }
  }
  return best;
}

/// Whether more than a tenth of the captures that see the lamp, two or more, do not fit and do far
/// better without it.
bool many_contradict(std::span<const Frame> frames, const Misfits& now, const Mend& mend,
                     double fits_px) {
  constexpr int least = 2, few = 10;
  int told = 0, contradict = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (!now[i] || !mend.misfits[i] || !sees(frames[i], mend.lamp)) continue;
    ++told;
    const bool better = *mend.misfits[i] < kFarBetter * *now[i];
    contradict += better && *now[i] >= fits_px ? 1 : 0;
  }
  return contradict >= least && few * contradict > told;
}

}  // namespace

std::vector<std::string> lamp_faults(std::span<const Frame> frames, const LampMap& map,
                                     const Calibration& calibration, double fits_px) {
  constexpr std::size_t least_lamps = 4;
  if (frames.size() < kLeastFrames) return {};
  std::string doubt = diagnose_map(frames, map, calibration);
  if (!doubt.empty()) return {std::move(doubt)};
  const Misfits now = misfits_px(frames, map, calibration);
  if (mean_misfit_px(now) < fits_px || map.lamps.size() < least_lamps) return {};
  const Mend mend = best_without(frames, map, calibration);
  if (mean_misfit_px(mend.misfits) >= kFarBetter * mean_misfit_px(now)) return {};
  if (!many_contradict(frames, now, mend, fits_px)) return {};
  return {fmt::format("lamp {} is loose: it does not hang where the map says", mend.lamp)};
}

std::vector<std::string> unseen_lamps(std::span<const Frame> frames, const LampMap& map) {
  std::vector<std::string> faults;
  if (frames.size() < kLeastFrames) return faults;
  for (const Lamp& lamp : map.lamps) {
    const bool seen = std::any_of(frames.begin(), frames.end(),
                                  [&](const Frame& frame) { return sees(frame, lamp.id); });
    if (seen) continue;
    faults.push_back(
        fmt::format("lamp {} is never seen: is it lit, and not overexposed?", lamp.id));
  }
  return faults;
}

std::vector<std::string> place_faults(std::span<const Frame> frames, const LampMap& map,
                                      const Calibration& calibration, const CapturesTable& places) {
  struct Error {
    std::string image;
    double horizontal_m;
  };
  const Positioner positioner(map, calibration);
  std::vector<Error> errors;
  for (const Frame& frame : frames) {
    const auto place = places.find(frame.image);
    if (place == places.end() || place->second.place == PlaceOf::axis) continue;
    const auto& [x_m, y_m] = std::tie(place->second.x_m, place->second.y_m);
    const Fix fix = positioner.locate(frame.detections);
    if (!x_m || !y_m || !fix.ok() || fix.lamps < 3) continue;
    const auto& position_m = fix.estimate.pose.position_m;
    errors.push_back({frame.image, std::hypot(position_m.x() - *x_m, position_m.y() - *y_m)});
  }
  constexpr std::size_t least = 5, few = 10;
  constexpr double least_m = 0.005, times = 8, millimetres = 1e3;
  if (errors.size() < least) return {};
  std::vector<double> sizes_m;
  sizes_m.reserve(errors.size());
  for (const Error& error : errors) sizes_m.push_back(error.horizontal_m);
  const auto middle = sizes_m.begin() + static_cast<std::ptrdiff_t>(sizes_m.size() / 2);
  std::nth_element(sizes_m.begin(), middle, sizes_m.end());
  const double typical_m = *middle;
  std::vector<std::string> faults;
  for (const auto& [image, horizontal_m] : errors) {
    if (horizontal_m < std::max(least_m, times * typical_m)) continue;
    faults.push_back(
        fmt::format("{} was not taken where its table says: it is {:.1f} mm off, others {:.2g} mm",
                    image, millimetres * horizontal_m, millimetres * typical_m));
  }
  if (faults.size() > std::max<std::size_t>(1, errors.size() / few)) return {};
  return faults;
}

std::optional<double> row_time_that_fits(std::span<const double> frequencies_hz, const LampMap& map,
                                         double row_time_s) {
  constexpr double alike = 0.01, farthest = 1.4, most = 0.8;
  constexpr std::size_t least_lamps = 3;
  // Each light may be each lamp: what fits most of the others, too, is what is the matter.
  std::size_t best = 0;
  double best_misfit = 0;
  std::optional<double> found_s;
  for (const double hypothesis_hz : frequencies_hz) {
    for (const Lamp& as : map.lamps) {
      if (!as.frequency_hz) continue;
      const double ratio = *as.frequency_hz / hypothesis_hz;
      if (ratio > farthest || ratio < 1 / farthest) continue;
      std::set<double> lamps_hz;
      std::size_t fitting = 0;
      double misfit = 0;
      for (const double frequency_hz : frequencies_hz) {
        double nearest = alike, lamp_hz = 0;
        for (const Lamp& lamp : map.lamps) {
          const double off =
              lamp.frequency_hz ? std::abs(ratio * frequency_hz / *lamp.frequency_hz - 1) : 1;
          if (off < nearest) std::tie(nearest, lamp_hz) = std::pair(off, *lamp.frequency_hz);
        }
        if (nearest >= alike) continue;
        ++fitting;
        misfit += nearest;
        lamps_hz.insert(lamp_hz);
      }
      const bool better = fitting > best || (fitting == best && misfit < best_misfit);
      if (lamps_hz.size() < least_lamps || !better) continue;
      best = fitting;
      best_misfit = misfit;
      found_s = row_time_s / ratio;
    }
  }
  const bool most_fit =
      static_cast<double>(best) >= most * static_cast<double>(frequencies_hz.size());
  const bool another = found_s && std::abs(row_time_s / *found_s - 1) > kMaxUnclearDrift;
  return most_fit && another ? found_s : std::nullopt;
}

}  // namespace vlp
