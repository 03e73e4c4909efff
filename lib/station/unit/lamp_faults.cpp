// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/lamp_faults.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "calibration/map/map_errors.h"
#include "positioning/positioner.h"

namespace vlp {
namespace {

/// Fewer captures determine no fault.
constexpr std::size_t kMinFrames = 3;

}  // namespace

std::vector<std::string> lamp_faults(std::span<const Frame> frames, const LampMap& map,
                                     const Calibration& calibration, double min_offset_px) {
  std::vector<std::string> faults;
  if (frames.size() < kMinFrames) return faults;
  MapErrorOptions options;
  options.min_offset_px = min_offset_px;
  for (const MapError& error : find_map_errors(frames, map, calibration, options).errors) {
    if (!error.lamps.empty() || error.kind == MapErrorKind::mirrored) {
      faults.push_back(describe(error));
    }
  }
  return faults;
}

std::vector<std::string> unseen_lamps(std::span<const Frame> frames, const LampMap& map) {
  std::vector<std::string> faults;
  if (frames.size() < kMinFrames) return faults;
  for (const MapError& error : find_unseen_lamps(frames, map)) faults.push_back(describe(error));
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

}  // namespace vlp
