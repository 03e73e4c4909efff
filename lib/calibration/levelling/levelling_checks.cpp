// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/levelling/levelling_checks.h"

#include <algorithm>
#include <cmath>

#include "captures/number_text.h"
#include "geometry/angles.h"

namespace vlp {
namespace {

constexpr int kDigits = 3;
constexpr double kOneYaw_rad = rad_from_deg(10);
constexpr double kOnePlace = 0.1;  // of the lamps' height above the camera

struct Variety {
  /// Root of the mean squared sine, about, of the yaws from their mean.
  double yaw;
  /// Root of the mean squared distance from the mean place over the height of the lamps.
  double place;
};

Variety variety_of(const LampBundle& bundle) {
  Eigen::Vector3d mean_m = Eigen::Vector3d::Zero();
  Eigen::Vector2d mean_heading = Eigen::Vector2d::Zero();
  const double n = static_cast<double>(bundle.captures.size());
  for (const auto& capture : bundle.captures) {
    mean_m += capture.camera.position_m / n;
    mean_heading += capture.camera.heading / n;
  }
  double sum = 0, height_m = 0;
  for (const auto& capture : bundle.captures) {
    sum += (capture.camera.position_m - mean_m).squaredNorm() / n;
    height_m += height_above(capture.camera, bundle.lamps_m[capture.seen.front().lamp]) / n;
  }
  return {std::sqrt(std::max(0.0, 1 - mean_heading.squaredNorm())), std::sqrt(sum) / height_m};
}

const Lamp* seen_once(const LampBundle& bundle, const LampMap& map) {
  std::vector<int> times(map.lamps.size());
  for (const auto& capture : bundle.captures) {
    for (const auto& seen : capture.seen) ++times[seen.lamp];
  }
  const auto once = std::find(times.begin(), times.end(), 1);
  return once == times.end() ? nullptr : &map.lamps[static_cast<std::size_t>(once - times.begin())];
}

std::string degrees(double angle_rad) {
  return significant(deg_from_rad(angle_rad), kDigits) + " degrees";
}

}  // namespace

std::size_t detections_in(const LampBundle& bundle) {
  std::size_t count = 0;
  for (const auto& capture : bundle.captures) count += capture.seen.size();
  return count;
}

std::vector<bool> lamps_seen(const LampBundle& bundle) {
  std::vector<bool> seen(bundle.lamps_m.size());
  for (const auto& capture : bundle.captures) {
    for (const auto& one : capture.seen) seen[one.lamp] = true;
  }
  return seen;
}

std::string undetermined_by(const LampBundle& bundle, const LampMap& map, bool refine_map) {
  if (bundle.captures.size() < 2) {
    return "two captures or more are needed that see three lamps of the map or more which agree "
           "with it; there " +
           std::string(bundle.captures.empty() ? "is none" : "is one") +
           ": add captures that see more lamps, or see that lamp map and camera are the right ones";
  }
  const Variety variety = variety_of(bundle);
  const bool one_yaw = variety.yaw < std::sin(kOneYaw_rad), one_place = variety.place < kOnePlace;
  if (one_yaw && one_place) {
    return "all captures are alike: from one place and yaw a lamp map that is a little off looks "
           "like a tilt; turn the camera on the spot, or drive, and add those captures";
  }
  if (refine_map && one_yaw) {
    return "all captures are at one yaw: a tilt of all lamps cannot be told from the camera's; "
           "turn "
           "the camera and add those captures, or leave the lamp map as it is";
  }
  if (refine_map && one_place) {
    return "all captures are from one place: the distances of the lamps do not show; add captures "
           "from elsewhere, or leave the lamp map as it is";
  }
  if (const Lamp* lamp = refine_map ? seen_once(bundle, map) : nullptr) {
    return "lamp " + std::to_string(lamp->id) +
           " is in one capture only: add captures that see it, or leave the lamp map as it is";
  }
  return "";
}

std::string too_loose(const Levelling& result, const Matrix2& tilt_covariance,
                      const LevellingOptions& options) {
  const double sd_rad = std::sqrt(tilt_covariance.diagonal().maxCoeff());
  if (!(sd_rad <= options.max_sd_rad)) {
    return "the tilt would be known to " + degrees(sd_rad) +
           " only: add captures, of more lamps, at other places and yaws";
  }
  for (const auto& lamp : result.corrections) {
    const double sd_m = lamp.sd_m.maxCoeff();
    if (!(sd_m <= options.max_lamp_sd_m)) {
      return "lamp " + std::to_string(lamp.id) + " would be known to " +
             significant(1e3 * sd_m, kDigits) +
             " mm only: add captures that see it, at other places and yaws, or leave the lamp map "
             "as it is";
    }
  }
  return "";
}

}  // namespace vlp
