// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/levelling/measured_lamps.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <limits>

#include "positioning/robust_fix.h"
#include "rig/find_lamp.h"

namespace vlp {
namespace {

// As PositionerOptions has it: a tilt of 5 degrees puts lamps off by half of it.
constexpr double kMaxResidualShare = 0.1;

double distance_to_nearest(const std::vector<Eigen::Vector3d>& lamps_m, std::size_t lamp) {
  double nearest_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < lamps_m.size(); ++i) {
    if (i != lamp) {
      nearest_m = std::min(nearest_m, (lamps_m[i] - lamps_m[lamp]).head<2>().norm());
    }
  }
  return nearest_m;
}

}  // namespace

std::optional<std::vector<LampBundle::Observation>> measured_lamps(
    std::span<const Detection> detections, const LampMap& map, const Lens& lens,
    const std::optional<RowClock>& row_clock) {
  std::vector<LampBundle::Observation> measured;
  measured.reserve(detections.size());
  for (const Detection& detection : detections) {
    const Lamp* lamp = find_lamp(map.lamps, detection.lamp);
    if (lamp == nullptr) continue;
    const auto index = static_cast<std::size_t>(lamp - map.lamps.data());
    for (const auto& other : measured) {
      if (other.lamp == index) return std::nullopt;
    }
    const auto ray = lens.unproject(detection.pixel);
    if (!ray || !(ray->direction.z() > 0)) continue;
    const Eigen::Vector2d z = ray->direction.head<2>() / ray->direction.z();
    const Eigen::Matrix2d d_z_d_pixel =
        (ray->d_direction_d_pixel.topRows<2>() - z * ray->d_direction_d_pixel.row(2)) /
        ray->direction.z();
    Matrix2 whitening = lens.focal_px().asDiagonal();
    if (detection.sigma_px) whitening = d_z_d_pixel.inverse() / *detection.sigma_px;
    measured.push_back({index, z, whitening, row_clock ? row_clock->time_s(detection.pixel) : 0});
  }
  if (measured.size() > kMaxSightings) return std::nullopt;
  return measured;
}

std::optional<LampBundle::Capture> placed_capture(const MeasuredCapture& measured,
                                                  const std::vector<Eigen::Vector3d>& lamps_m,
                                                  const Eigen::Matrix3d& level_from_camera) {
  const std::vector<LampBundle::Observation>& seen = measured.seen;
  SightedFrame frame;
  // What the stated noise does not explain may be the tilt that is sought.
  frame.noise_is_stated = false;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const Eigen::Vector3d direction = level_from_camera * seen[i].z_in_camera.homogeneous();
    if (!(direction.z() > 0)) continue;
    frame.sightings[frame.size] = {lamps_m[seen[i].lamp], direction.hnormalized(),
                                   seen[i].whitening, 1};
    frame.nearest_m[frame.size] = distance_to_nearest(lamps_m, seen[i].lamp);
    frame.ids[frame.size++] = static_cast<int>(i);
  }
  if (frame.size < 3) return std::nullopt;
  const auto [status, fix] = fix_robustly(frame, kMaxResidualShare);
  if (status != FixStatus::ok || frame.size < 3) return std::nullopt;
  LampBundle::Capture capture{LevelPose(fix.pose), {}, measured.motion};
  capture.seen.reserve(frame.size);
  for (std::size_t i = 0; i < frame.size; ++i) {
    capture.seen.push_back(seen[static_cast<std::size_t>(frame.ids[i])]);
  }
  return capture;
}

}  // namespace vlp
