// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "geometry/angles.h"
#include "simulation/scene_parts.h"

namespace vlp {

ArchiveSpreads read_archive_spreads(YamlMap map) {
  const auto share = [&](const char* key, double most) {
    return map.required(key).number_within(0, most, "");
  };
  ArchiveSpreads spreads;
  spreads.sessions_per_camera = map.required("sessions_per_camera").integer_within(1, 10'000);
  spreads.focal_share = share("focal_share", 0.5);
  spreads.center_px = map.required("center_px").number_within(0, 1e4, "px");
  spreads.distortion_share = share("distortion_share", 0.5);
  spreads.tilt_rad = rad_from_deg(map.required("tilt_deg").number_within(0, 20, "degrees"));
  spreads.lever_arm_m = map.required("lever_arm_m").number_within(0, 1, "m");
  spreads.map_error_m = map.required("map_error_m").number_within(0, 1, "m");
  spreads.fault_share = share("fault_share", 1);
  spreads.damage_share = share("damage_share", 1);
  map.finish();
  return spreads;
}

}  // namespace vlp
