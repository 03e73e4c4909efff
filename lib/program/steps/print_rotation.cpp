// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/steps/print_rotation.h"

#include <fmt/core.h>

#include <optional>
#include <string>

#include "captures/printable.h"
#include "geometry/angles.h"

namespace vlp {
namespace {

/// Returns ", sd X Y UNIT" for a covariance, with standard deviations multiplied by a factor.
std::string format_sd(const std::optional<Matrix2>& covariance, double factor, const char* unit) {
  if (!covariance) return ", sd not known";
  const Eigen::Vector2d sd = factor * covariance->diagonal().cwiseSqrt();
  return fmt::format(", sd {:.4f} {:.4f} {}", sd.x(), sd.y(), unit);
}

/// Formats a height in meters, without a sign if it rounds to zero.
std::string format_height_m(double z_m) {
  const std::string text = fmt::format("{:.3f}", z_m);
  return text == "-0.000" ? "0.000" : text;
}

void print_lever_arm(const RotationCenter& center) {
  if (const auto& arm_m = center.lever_arm_m) {
    fmt::print("lever arm   {:.3f} {:.3f} mm{}\n", 1e3 * arm_m->x(), 1e3 * arm_m->y(),
               format_sd(center.lever_arm_covariance, 1e3, "mm"));
  } else {
    fmt::print("lever arm   taken as zero\n");
  }
}

void print_residuals(const RotationFit& fit, const RotationCaptures& spot) {
  fmt::print("residual    {:.4f} px per axis, of {} detections\n", fit.residual_px,
             spot.observations.size() - fit.outliers.size());
  fmt::print("outliers    {}\n", fit.outliers.size());
  for (const auto& [index, distance_px] : fit.outliers) {
    const RotationObservation& observation = spot.observations[index];
    fmt::print("  outlier   {} lamp {}: {:.2f} px off\n",
               printable_line(spot.captures[observation.capture].image),
               spot.lamps[observation.lamp].id, distance_px);
  }
}

}  // namespace

void print_center(const RotationCenter& center, const Camera& camera) {
  fmt::print("center      {:.3f} {:.3f} px in the undistorted image{}\n", center.center_px.x(),
             center.center_px.y(), format_sd(center.covariance, 1, "px"));
  const Eigen::Vector3d& up = center.zenith_in_camera;
  fmt::print("zenith      {:.6f} {:.6f} {:.6f} in the camera\n", up.x(), up.y(), up.z());
  const auto [angle_rad, azimuth_rad] = compute_tilt(center);
  const auto sd_rad = axis_sd_rad(center, camera);
  fmt::print("tilt        {:.4f} deg towards {:.1f} deg in the image{}\n", deg_from_rad(angle_rad),
             deg_from_rad(azimuth_rad),
             sd_rad ? fmt::format(", sd {:.4f} deg", deg_from_rad(*sd_rad)) : "");
}

void print_summary(const RotationFit& fit, const RotationCaptures& spot,
                   const CircleCenters& circles, const Camera& camera) {
  fmt::print("captures    {} of {}\n", spot.captures.size(),
             spot.captures.size() + spot.rejected.size());
  for (const RotationHeight& height : spot.heights) {
    fmt::print("  height    {} m: {} captures over {:.0f} deg\n", format_height_m(height.z_m),
               height.captures, deg_from_rad(height.arc_rad));
  }
  fmt::print("lamps       {}\n", spot.lamps.size());
  print_center(fit.center, camera);
  print_lever_arm(fit.center);
  if (circles.circles.empty()) {
    fmt::print("circles     none determined\n");
  } else {
    fmt::print("circles     {}, their centers spread by {:.3f} px\n", circles.circles.size(),
               circles.spread_px);
  }
  print_residuals(fit, spot);
  fmt::print("\n{:>10} {:>10}  image\n", "z (m)", "yaw (deg)");
  for (std::size_t i = 0; i < spot.captures.size(); ++i) {
    const RotationCapture& capture = spot.captures[i];
    fmt::print("{:>10} {:10.3f}  {}\n", format_height_m(spot.heights[capture.height].z_m),
               deg_from_rad(wrap_rad(fit.yaws_rad[i])), printable_line(capture.image));
  }
}

}  // namespace vlp
