// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/dispersion/station_fixes.h"

#include "positioning/positioner.h"
#include "rig/find_lamp.h"

namespace vlp {
namespace {

/// Mean height of the lamps seen.
double lamps_height(const StationCapture& capture, const LampMap& map) {
  double sum_m = 0;
  int count = 0;
  for (const Detection& detection : capture.detections) {
    const Lamp* lamp = find_lamp(map.lamps, detection.lamp);
    if (lamp == nullptr) continue;
    sum_m += lamp->position_m.z();
    ++count;
  }
  return sum_m / count;
}

Fix fix_of(const Positioner& positioner, const StationCapture& capture) {
  Sensors sensors;
  sensors.inclination = capture.inclination;
  return positioner.locate(capture.detections, sensors);
}

}  // namespace

StationFixes::StationFixes(std::span<const StationCapture> captures, const LampMap& map,
                           const Calibration& calibration)
    : captures_(captures), map_(map), calibration_(calibration) {
  calibration_.dispersion.reset();
  const Positioner positioner(map_, calibration_);
  for (const StationCapture& capture : captures_) {
    const Fix fix = fix_of(positioner, capture);
    if (!fix.ok() && first_refusal_ == FixStatus::ok) first_refusal_ = fix.status;
  }
}

std::vector<std::optional<StationFixes::At>> StationFixes::at(
    const Eigen::Vector2d& offset_px) const {
  Calibration calibration = calibration_;
  calibration.dispersion = Dispersion{offset_px, 0, {0, 0}, 1, {}};
  const Positioner positioner(map_, calibration);
  std::vector<std::optional<At>> fixes(captures_.size());
  for (std::size_t i = 0; i < captures_.size(); ++i) {
    const Fix fix = fix_of(positioner, captures_[i]);
    if (!fix.ok()) continue;
    const Pose& pose = fix.estimate.pose;
    fixes[i] = At{pose.position_m.head<2>() - captures_[i].station_m,
                  fix.noise_covariance.topLeftCorner<2, 2>(),
                  pose.yaw_rad,
                  lamps_height(captures_[i], map_) - pose.position_m.z(),
                  fix.residual_px * fix.residual_px * fix.lamps,
                  2 * fix.lamps - 4};
  }
  return fixes;
}

}  // namespace vlp
