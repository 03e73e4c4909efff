// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/spot_captures.h"

#include <algorithm>
#include <set>

#include "calibration/rotation/spot_search.h"
#include "camera/lens.h"
#include "geometry/median.h"
#include "rig/find_lamp.h"

namespace vlp {
namespace {

SpotStatus status_of(const std::vector<Frame>& frames, const LampMap& map) {
  std::set<int> known, seen;
  for (const Lamp& lamp : map.lamps) known.insert(lamp.id);
  std::size_t captures = 0;
  for (const Frame& frame : frames) {
    if (!frame.detections.empty()) ++captures;
    for (const Detection& detection : frame.detections) {
      if (known.contains(detection.lamp)) seen.insert(detection.lamp);
    }
  }
  if (seen.empty()) return SpotStatus::other_map;
  if (captures < kLeastCaptures) return SpotStatus::too_few_captures;
  return seen.size() < 2 ? SpotStatus::too_few_lamps : SpotStatus::ok;
}

void add_sightings(SpotCaptures& spot, const Frame& frame, std::size_t capture, const Lens& lens) {
  for (const Detection& detection : frame.detections) {
    const Lamp* lamp = find_lamp(spot.lamps, detection.lamp);
    const auto ray = lens.unproject(detection.pixel);
    if (lamp == nullptr || !ray) continue;
    const Eigen::Vector3d unit = ray->direction.normalized();
    const auto projection = lens.project_with_jacobians(unit);
    if (!projection) continue;
    spot.sightings.push_back({capture, static_cast<std::size_t>(lamp - spot.lamps.data()),
                              detection.pixel, detection.sigma_px.value_or(1), unit,
                              projection->d_pixel_d_point});
  }
}

std::optional<double> stated_px(const std::vector<Frame>& frames) {
  std::vector<double> stated;
  for (const Frame& frame : frames) {
    for (const Detection& detection : frame.detections) {
      if (!detection.sigma_px) return std::nullopt;
      stated.push_back(*detection.sigma_px);
    }
  }
  return upper_median(stated);
}

}  // namespace

SpotCaptures spot_captures(const std::vector<Frame>& frames, const LampMap& map,
                           const Camera& camera) {
  SpotCaptures spot;
  spot.status = status_of(frames, map);
  if (spot.status != SpotStatus::ok) return spot;
  // A long lever arm that is taken for a tilt can hide that there are two heights; looked for at
  // one height, it can hide the tilt.
  const auto stated = stated_px(frames);
  const double noise_px = stated.value_or(1);
  // A long lever arm that is mistaken for a tilt can hide a second height. Estimated at one height,
  // a lever arm can hide the tilt.
  SpotSearch plain(frames, map, camera, noise_px, false),
      with_arm(frames, map, camera, noise_px, true);
  spot.status = plain.run();
  const bool both = with_arm.run() == SpotStatus::ok;
  const bool better = both && (spot.status != SpotStatus::ok ||
                               with_arm.misfit_m() < 0.5 * plain.misfit_m() - 1e-9);
  if (better) spot.status = SpotStatus::ok;
  if (spot.status != SpotStatus::ok) return spot;
  const SpotSearch& search = better ? with_arm : plain;
  spot = search.result();
  spot.stated_px = stated;
  std::set<int> seen;
  for (const std::size_t i : search.frames()) {
    for (const Detection& detection : frames[i].detections) seen.insert(detection.lamp);
  }
  for (const Lamp& lamp : map.lamps) {
    if (seen.contains(lamp.id)) spot.lamps.push_back(lamp);
  }
  const Lens lens(camera.lens_model, camera.intrinsics);
  for (std::size_t i = 0; i < search.frames().size(); ++i) {
    add_sightings(spot, frames[search.frames()[i]], i, lens);
  }
  return spot;
}

std::string_view explanation_of(SpotStatus status) {
  switch (status) {
    case SpotStatus::ok:
      return "captures of a turn on the spot";
    case SpotStatus::other_map:
      return "the lamps that are seen are not those of the lamp map, or not where it says: is it "
             "the map of this room?";
    case SpotStatus::too_few_lamps:
      return "two lamps or more are needed in each capture: add lamps, or turn where more of them "
             "are in view";
    case SpotStatus::too_few_captures:
      return "three captures or more are needed at a height: add captures while turning on the "
             "spot, twelve over a full turn are good";
    case SpotStatus::alike:
      return "the captures are all alike: turn the camera on the spot from one to the next";
    case SpotStatus::short_arc:
      return "the captures span less than 90 degrees: add captures over more of the turn, a full "
             "one is best";
    case SpotStatus::moved:
      return "the captures are not of one spot: take them while turning about one vertical axis, "
             "without driving";
  }
  return "";
}

}  // namespace vlp
