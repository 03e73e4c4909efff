// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "geometry/angles.h"
#include "simulation/scene_parts.h"

namespace vlp {

ArchiveVariation read_archive_variation(YamlMap map) {
  const auto fraction = [&](const char* key, double max_fraction) {
    return map.required(key).number_within(0, max_fraction, "");
  };
  ArchiveVariation variation;
  variation.sessions_per_camera = map.required("sessions_per_camera").integer_within(1, 10'000);
  variation.focal_share = fraction("focal_share", 0.5);
  variation.center_px = map.required("center_px").number_within(0, 1e4, "px");
  variation.distortion_share = fraction("distortion_share", 0.5);
  variation.tilt_rad = rad_from_deg(map.required("tilt_deg").number_within(0, 20, "degrees"));
  variation.lever_arm_m = map.required("lever_arm_m").number_within(0, 1, "m");
  variation.map_error_m = map.required("map_error_m").number_within(0, 1, "m");
  variation.fault_share = fraction("fault_share", 1);
  variation.damage_share = fraction("damage_share", 1);
  map.finish();
  return variation;
}

}  // namespace vlp
