// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/rotation_captures.h"

#include <algorithm>
#include <set>

#include "calibration/rotation/pivot_search.h"
#include "camera/lens.h"
#include "geometry/median.h"
#include "rig/find_lamp.h"

namespace vlp {
namespace {

RotationStatus find_status(const std::vector<Frame>& frames, const LampMap& map) {
  std::set<int> known, seen;
  for (const Lamp& lamp : map.lamps) known.insert(lamp.id);
  std::size_t captures = 0;
  for (const Frame& frame : frames) {
    if (!frame.detections.empty()) ++captures;
    for (const Detection& detection : frame.detections) {
      if (known.contains(detection.lamp)) seen.insert(detection.lamp);
    }
  }
  if (seen.empty()) return RotationStatus::other_map;
  if (captures < kMinCaptures) return RotationStatus::too_few_captures;
  return seen.size() < 2 ? RotationStatus::too_few_lamps : RotationStatus::ok;
}

void add_observations(RotationCaptures& rotation, const Frame& frame, std::size_t capture,
                      const Lens& lens) {
  for (const Detection& detection : frame.detections) {
    const Lamp* lamp = find_lamp(rotation.lamps, detection.lamp);
    const auto ray = lens.unproject(detection.pixel);
    if (lamp == nullptr || !ray) continue;
    const Eigen::Vector3d unit = ray->direction.normalized();
    const auto projection = lens.project_with_jacobians(unit);
    if (!projection) continue;
    rotation.observations.push_back(
        {capture, static_cast<std::size_t>(lamp - rotation.lamps.data()), detection.pixel,
         detection.sigma_px.value_or(1), unit, projection->d_pixel_d_point});
  }
}

std::optional<double> median_sigma_px(const std::vector<Frame>& frames) {
  std::vector<double> given_px;
  for (const Frame& frame : frames) {
    for (const Detection& detection : frame.detections) {
      if (!detection.sigma_px) return std::nullopt;
      given_px.push_back(*detection.sigma_px);
    }
  }
  return upper_median(given_px);
}

}  // namespace

RotationCaptures find_rotation_captures(const std::vector<Frame>& frames, const LampMap& map,
                                        const Camera& camera) {
  RotationCaptures rotation;
  rotation.status = find_status(frames, map);
  if (rotation.status != RotationStatus::ok) return rotation;
  // A long lever arm that is taken for a tilt can hide that there are two heights; looked for at
  // one height, it can hide the tilt.
  const auto given_px = median_sigma_px(frames);
  const double noise_px = given_px.value_or(1);
  // A long lever arm that is mistaken for a tilt can hide a second height. Estimated at one height,
  // a lever arm can hide the tilt.
  RotationSearch without_arm(frames, map, camera, noise_px, false),
      with_arm(frames, map, camera, noise_px, true);
  rotation.status = without_arm.run();
  const bool both_succeeded = with_arm.run() == RotationStatus::ok;
  const bool arm_is_better = both_succeeded && (rotation.status != RotationStatus::ok ||
                                                with_arm.median_residual_m() <
                                                    0.5 * without_arm.median_residual_m() - 1e-9);
  if (arm_is_better) rotation.status = RotationStatus::ok;
  if (rotation.status != RotationStatus::ok) return rotation;
  const RotationSearch& search = arm_is_better ? with_arm : without_arm;
  rotation = search.result();
  rotation.median_sigma_px = given_px;
  std::set<int> seen;
  for (const std::size_t i : search.frames()) {
    for (const Detection& detection : frames[i].detections) seen.insert(detection.lamp);
  }
  for (const Lamp& lamp : map.lamps) {
    if (seen.contains(lamp.id)) rotation.lamps.push_back(lamp);
  }
  const Lens lens(camera.lens_model, camera.intrinsics);
  for (std::size_t i = 0; i < search.frames().size(); ++i) {
    add_observations(rotation, frames[search.frames()[i]], i, lens);
  }
  return rotation;
}

std::string_view describe(RotationStatus status) {
  switch (status) {
    case RotationStatus::ok:
      return "captures of a turn on the spot";
    case RotationStatus::other_map:
      return "the lamps that are seen are not those of the lamp map, or not where it says: is it "
             "the map of this room?";
    case RotationStatus::too_few_lamps:
      return "two lamps or more are needed in each capture: add lamps, or turn where more of them "
             "are in view";
    case RotationStatus::too_few_captures:
      return "three captures or more are needed at a height: add captures while turning on the "
             "spot, twelve over a full turn are good";
    case RotationStatus::alike:
      return "the captures are all alike: turn the camera on the spot from one to the next";
    case RotationStatus::short_arc:
      return "the captures span less than 90 degrees: add captures over more of the turn, a full "
             "one is best";
    case RotationStatus::moved:
      return "the captures are not of one spot: take them while turning about one vertical axis, "
             "without driving";
  }
  return "";
}

}  // namespace vlp
