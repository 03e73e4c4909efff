// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/coplanar_fix.h"

#include <cmath>

#include "geometry/similarity.h"

namespace vlp {

std::optional<Pose> fix_coplanar_lamps(std::span<const Sighting> sightings) {
  const auto similarity = fit_similarity(
      sightings.size(), [&](std::size_t i) { return sightings[i].z; },
      [&](std::size_t i) -> Eigen::Vector2d { return sightings[i].lamp_m.head<2>(); });
  if (!similarity) return std::nullopt;
  double ceiling_m = 0;
  for (const Sighting& sighting : sightings) ceiling_m += sighting.lamp_m.z();
  ceiling_m /= static_cast<double>(sightings.size());
  const Eigen::Vector2d& c = similarity->factor;
  return Pose{{similarity->offset.x(), similarity->offset.y(), ceiling_m - c.norm()},
              std::atan2(c.y(), c.x())};
}

}  // namespace vlp
