// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/steps/print_adjustment.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "geometry/angles.h"

namespace vlp {

void print_adjustment(const AdjustmentResult& found, const Calibration& before, bool lens_stated) {
  const RotationCenter& center = found.center;
  const double focal_px = std::sqrt(found.camera.focal_px().prod());
  fmt::print("captures    {} used, {} left out\n", found.captures, found.rejected_captures);
  fmt::print("detections  {} used, {} left out\n", found.detections, found.rejected_detections);
  const Eigen::Vector3d& up = center.zenith_in_camera;
  fmt::print("tilt        {:.4f} deg, sd {:.4f} deg\n",
             deg_from_rad(std::acos(std::min(1.0, up.z()))),
             deg_from_rad(std::sqrt(center.covariance->trace() / 2) / focal_px));
  if (before.rotation_center) {
    const double cosine = std::min(1.0, up.dot(before.rotation_center->zenith_in_camera));
    fmt::print("            {:.4f} deg from that of the calibration before\n",
               deg_from_rad(std::acos(cosine)));
  }
  if (const auto& arm_m = center.lever_arm_m) {
    fmt::print("lever arm   {:.3f} {:.3f} mm, sd {:.3f} {:.3f} mm\n", 1e3 * arm_m->x(),
               1e3 * arm_m->y(), 1e3 * std::sqrt((*center.lever_arm_covariance)(0, 0)),
               1e3 * std::sqrt((*center.lever_arm_covariance)(1, 1)));
  } else {
    fmt::print("lever arm   not determined: a turn on a spot at a second height tells it\n");
  }
  if (found.lens_freedom > 0) {
    fmt::print("lens        corrected: chi-squared {:.1f}, {} expected\n", found.lens_chi_squared,
               found.lens_freedom);
    const auto& lens = found.camera.intrinsics;
    const Eigen::VectorXd sd = found.surveyed_covariance.diagonal().head<4>().cwiseSqrt();
    fmt::print(
        "            fx fy {:.3f} {:.3f} px, sd {:.3f} {:.3f}; cx cy {:.3f} {:.3f} px, sd {:.3f} "
        "{:.3f}\n",
        lens[0], lens[1], sd[0], sd[1], lens[2], lens[3], sd[2], sd[3]);
  } else {
    fmt::print("lens        {}\n", lens_stated
                                       ? "as it was: the captures tell nothing of it"
                                       : "taken as exact: the calibration has no covariance of "
                                         "it (see --lens-sd-px)");
  }
  fmt::print("residual    {:.4f} px per axis\n", found.residual_px);
  for (const auto& place : found.places) {
    fmt::print("place       {}: {:.3f} {:.3f} {:.3f} mm from where it is said to be{}\n",
               place.name, 1e3 * place.residual_m.x(), 1e3 * place.residual_m.y(),
               1e3 * place.residual_m.z(), place.wrong ? ", left out" : "");
  }
  fmt::print("\n{:>10} {:>28} {:>28}\n", "lamp", "moved by x y z (mm)", "sd (mm)");
  for (const auto& [id, correction_m, sd_m, moved] : found.lamps) {
    fmt::print("{:10} {:10.3f}{:9.3f}{:9.3f} {:10.3f}{:9.3f}{:9.3f}{}\n", id,
               1e3 * correction_m.x(), 1e3 * correction_m.y(), 1e3 * correction_m.z(),
               1e3 * sd_m.x(), 1e3 * sd_m.y(), 1e3 * sd_m.z(),
               moved ? "  elsewhere than in the map" : "");
  }
}

}  // namespace vlp
