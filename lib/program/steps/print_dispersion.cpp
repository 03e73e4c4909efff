// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/steps/print_dispersion.h"

#include <fmt/core.h>

#include <cmath>

#include "rig/calibration_error.h"

namespace vlp {
namespace {

void print_circle(const char* name, const Circle& circle) {
  fmt::print("{:12}radius {:.3f} mm, center {:.3f} {:.3f} mm from the station\n", name,
             1e3 * circle.radius, 1e3 * circle.center.x(), 1e3 * circle.center.y());
}

}  // namespace

void print_dispersion(const DispersionFit& fit, const Eigen::Vector2d& focal_px,
                      std::size_t captures) {
  const Dispersion& found = fit.dispersion;
  fmt::print("captures    {}, {} used, {} left out as outliers, {} without a fix\n", captures,
             found.captures, static_cast<int>(fit.fixes.size()) - found.captures,
             fit.captures_without_fix);
  print_circle("before", fit.before);
  print_circle("after", fit.after);
  fmt::print("offset      {:.4f} {:.4f} px", found.offset_px.x(), found.offset_px.y());
  if (const auto covariance_px2 = offset_covariance_with_map(found, focal_px)) {
    fmt::print(", sd {:.4f} {:.4f} px", std::sqrt((*covariance_px2)(0, 0)),
               std::sqrt((*covariance_px2)(1, 1)));
  }
  fmt::print(", fixed in the camera\n");
  if (const auto& world_m = fit.world_offset_m) {
    fmt::print(
        "world       {:.3f} {:.3f} mm, sd {:.3f} {:.3f} mm, fixed in the world: lamp map or "
        "station; not corrected\n",
        1e3 * world_m->x(), 1e3 * world_m->y(), 1e3 * std::sqrt(fit.world_covariance(0, 0)),
        1e3 * std::sqrt(fit.world_covariance(1, 1)));
  } else {
    fmt::print("world       supposed right: an error of lamp map or station is in the offset\n");
  }
}

}  // namespace vlp
