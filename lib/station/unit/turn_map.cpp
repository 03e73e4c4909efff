// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/turn_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "calibration/rotation/rotation_model.h"
#include "positioning/positioner.h"

namespace vlp {
namespace {

constexpr double kTurn_rad = 2 * std::numbers::pi;

struct LocatedFrame {
  double z_m, lamps_above_m, yaw_rad;
  std::size_t number;
};

std::vector<LocatedFrame> locate_camera_in_frames(const std::vector<Frame>& frames,
                                                  const StationConfig& config,
                                                  const Calibration& calibration) {
  PositionerOptions options;
  options.correction = Correction::none;
  const Positioner positioner(config.lamps, calibration, options);
  double ceiling_m = 0;
  for (const Lamp& lamp : config.lamps.lamps) ceiling_m = std::max(ceiling_m, lamp.position_m.z());
  std::vector<LocatedFrame> located;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Fix fix = positioner.locate(frames[i].detections);
    if (!fix.ok()) continue;
    const auto& pose = fix.estimate.pose;
    located.push_back({pose.position_m.z(), ceiling_m - pose.position_m.z(), pose.yaw_rad, i});
  }
  std::ranges::sort(located, {}, &LocatedFrame::z_m);
  return located;
}

}  // namespace

YawCoverage compute_yaw_coverage(const std::vector<Frame>& frames, const StationConfig& config,
                                 const Calibration& calibration) {
  constexpr double same_height = 0.06;  // find_in_place_rotation_captures() decides
  const auto parts = static_cast<std::size_t>(config.sufficient.turn_captures);
  const auto located = locate_camera_in_frames(frames, config, calibration);
  YawCoverage map;
  for (std::size_t begin = 0, end = 0; begin < located.size(); begin = end) {
    YawCoverage::Height height{located[begin].z_m, 0, 0, std::vector<bool>(parts)};
    while (end < located.size() &&
           located[end].z_m - located[begin].z_m < same_height * located[begin].lamps_above_m) {
      ++end;
    }
    const std::span<const LocatedFrame> at_height(located.data() + begin, end - begin);
    const LocatedFrame& first = *std::ranges::min_element(at_height, {}, &LocatedFrame::number);
    std::vector<double> yaws_rad;
    for (const LocatedFrame& located_frame : at_height) {
      yaws_rad.push_back(located_frame.yaw_rad);
      const double turned = (located_frame.yaw_rad - first.yaw_rad) / kTurn_rad;
      const double fraction = turned - std::floor(turned);
      const auto part = static_cast<std::size_t>(std::lround(fraction * double(parts)));
      height.parts[part % parts] = true;
    }
    height.captures = static_cast<int>(yaws_rad.size());
    height.arc_rad = compute_angular_range(yaws_rad);
    height.is_complete = height.captures >= config.sufficient.turn_captures &&
                         height.arc_rad >= config.sufficient.turn_arc_rad;
    map.heights.push_back(std::move(height));
  }
  map.sufficient = std::ranges::count_if(map.heights, &YawCoverage::Height::is_complete) >=
                   config.sufficient.turn_heights;
  return map;
}

}  // namespace vlp
