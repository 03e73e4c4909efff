// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/steps/print_calibration.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "camera/spline_grid.h"
#include "captures/printable.h"
#include "geometry/angles.h"
#include "geometry/median.h"
#include "rig/calibration_error.h"
#include "session/rotation_step.h"

namespace vlp {

namespace {

/// Returns ", sd X Y UNIT" for a covariance, with standard deviations multiplied by a factor.
std::string format_sd(const std::optional<Matrix2>& covariance, double factor, const char* unit) {
  if (!covariance) return ", sd unknown";
  const Eigen::Vector2d sd = factor * covariance->diagonal().cwiseSqrt();
  return fmt::format(", sd {:.4f} {:.4f} {}", sd.x(), sd.y(), unit);
}

void print_lever_arm(const Calibration& calibration) {
  if (const auto& arm_m = calibration.rotation_center->lever_arm_m) {
    fmt::print("lever arm   {:.3f} {:.3f} mm{}\n", 1e3 * arm_m->x(), 1e3 * arm_m->y(),
               format_sd(find_parameter_covariance(calibration, kLeverArmParameter), 1e3, "mm"));
  } else {
    fmt::print("lever arm   assumed to be zero\n");
  }
}

void print_residuals(const RotationFit& fit, const RotationCaptures& rotation) {
  fmt::print("residual    {:.4f} px per axis, of {} detections\n", fit.residual_px,
             fit.used_observations.size());
  fmt::print("outliers    {}\n", fit.outliers.size());
  for (const auto& [index, distance_px] : fit.outliers) {
    const RotationObservation& observation = rotation.observations[index];
    fmt::print("  outlier   {} lamp {}: residual {:.2f} px\n",
               escape_for_line(rotation.captures[observation.capture].image),
               rotation.lamps[observation.lamp].id, distance_px);
  }
}

void print_circle(const char* name, const Circle& circle) {
  fmt::print("{:12}radius {:.3f} mm, center {:.3f} {:.3f} mm from the reference point\n", name,
             1e3 * circle.radius, 1e3 * circle.center.x(), 1e3 * circle.center.y());
}

}  // namespace

void print_lens(const IntrinsicsSolution& solution, const CalibrationReport& report,
                const ViewCoverage& coverage, const HeldOutFit& held_out) {
  const auto& parameters = solution.problem.intrinsics;
  fmt::print("views         {} used, {} rejected\n", solution.views.size(),
             solution.dropped_views.size());
  fmt::print("corners       {}, {} outliers\n", solution.corners, solution.outliers);
  fmt::print("rms           {:.3f} px per axis\n", solution.rms_px);
  if (std::any_of(solution.edge_displacements_px.begin(), solution.edge_displacements_px.end(),
                  [](double shift_px) { return shift_px != 0; })) {
    const double shift_px = upper_median(solution.edge_displacements_px);
    fmt::print("edges         displaced by {:.3f} px towards the {}, corrected\n",
               std::abs(shift_px), shift_px < 0 ? "light" : "dark");
  }
  fmt::print("focal length  {:.2f}, {:.2f} px", parameters[0], parameters[1]);
  if (is_splined_lens_model(solution.problem.lens_model)) {
    fmt::print(", compensated by {} control points\n",
               spline_grid_of(solution.problem.lens_model).num_control_points());
  } else {
    fmt::print(", sd {:.2f} by noise, {:.2f} by views\n", report.focal_sd_px,
               report.focal_sd_by_views_px);
  }
  fmt::print("center        {:.2f}, {:.2f} px\n", parameters[2], parameters[3]);
  fmt::print("uncertainty   {:.3f} px mean, {:.3f} px worst\n", report.uncertainty_mean_px,
             report.uncertainty_worst_px);
  if (report.region_fraction > 0.999) {
    fmt::print("valid region  whole image\n");
  } else {
    fmt::print(
        "valid region  {:.0f} % of the image, for which these values hold; uncertainty outside up "
        "to {:.3g} px\n",
        100 * report.region_fraction, report.uncertainty_beyond_px);
  }
  fmt::print(
      "true lens     expected difference {:.3f} px rms per axis from noise, {:.3f} from views\n",
      report.expected_rms_px, report.expected_by_views_rms_px);
  if (report.split_half_difference) {
    fmt::print("halves        difference {:.3f} px rms per axis, {:.3f} px maximum\n",
               report.split_half_difference->rms_px, report.split_half_difference->worst_px);
  }
  if (held_out.views > 0) {
    fmt::print("held out      {} views, {} corners, {:.3f} px rms per axis\n", held_out.views,
               held_out.corners, held_out.rms_px);
  }
  const auto& [left, right, upper, lower] = coverage.tilts_rad;
  fmt::print("coverage      {:.0f} % of the image\n", 100 * coverage.covered_fraction);
  fmt::print("tilts         left {:.0f}, right {:.0f}, upper {:.0f}, lower {:.0f} degrees\n",
             deg_from_rad(left), deg_from_rad(right), deg_from_rad(upper), deg_from_rad(lower));
  fmt::print("next view     {}\n", recommend_next_view(coverage));
}

void print_center(const Calibration& calibration) {
  const RotationCenter& center = *calibration.rotation_center;
  fmt::print("center      {:.3f} {:.3f} px in the undistorted image{}\n", center.center_px.x(),
             center.center_px.y(), format_sd(compute_center_covariance(calibration), 1, "px"));
  const Eigen::Vector3d& up = center.zenith_in_camera;
  fmt::print("zenith      {:.6f} {:.6f} {:.6f} in the camera\n", up.x(), up.y(), up.z());
  const auto [angle_rad, azimuth_rad] = compute_tilt(center);
  const auto covariance = find_parameter_covariance(calibration, kZenithParameter);
  fmt::print("tilt        {:.4f} deg towards {:.1f} deg in the image{}\n", deg_from_rad(angle_rad),
             deg_from_rad(azimuth_rad),
             covariance
                 ? fmt::format(", sd {:.4f} deg", deg_from_rad(std::sqrt(covariance->trace() / 2)))
                 : "");
}

void print_rotation(const RotationFit& fit, const RotationCaptures& rotation,
                    const CircleCenters& circles, const Calibration& calibration) {
  fmt::print("captures    {} of {}\n", rotation.captures.size(),
             rotation.captures.size() + rotation.rejected_captures.size());
  for (const RotationHeight& height : rotation.heights) {
    fmt::print("  height    {} m: {} captures over {:.0f} deg\n", format_height_m(height.z_m),
               height.captures, deg_from_rad(height.arc_rad));
  }
  fmt::print("lamps       {}\n", rotation.lamps.size());
  print_center(calibration);
  print_lever_arm(calibration);
  if (circles.circles.empty()) {
    fmt::print("circles     none determined\n");
  } else {
    fmt::print("circles     {}, their centers spread by {:.3f} px\n", circles.circles.size(),
               circles.spread_px);
  }
  print_residuals(fit, rotation);
  fmt::print("\n{:>10} {:>10}  image\n", "z (m)", "yaw (deg)");
  for (const RotationCapture& capture : rotation.captures) {
    fmt::print("{:>10} {:10.3f}  {}\n", format_height_m(rotation.heights[capture.height].z_m),
               deg_from_rad(wrap_angle_rad(capture.yaw_rad)), escape_for_line(capture.image));
  }
}

void print_dispersion(const DispersionFit& fit, const Calibration& calibration,
                      std::size_t captures) {
  const Dispersion& found = fit.dispersion;
  fmt::print("captures    {}, {} used, {} rejected as outliers, {} without a fix\n", captures,
             found.captures, static_cast<int>(fit.fixes.size()) - found.captures,
             fit.captures_without_fix);
  print_circle("before", fit.before);
  print_circle("after", fit.after);
  fmt::print("offset      {:.4f} {:.4f} px", found.offset_px.x(), found.offset_px.y());
  fmt::print("{}, fixed in the camera\n",
             format_sd(compute_offset_covariance(calibration), 1, "px"));
  if (const auto& world_m = fit.world_offset_m) {
    fmt::print(
        "world       {:.3f} {:.3f} mm, sd {:.3f} {:.3f} mm, fixed in the world: lamp map or "
        "reference point; not corrected\n",
        1e3 * world_m->x(), 1e3 * world_m->y(), 1e3 * std::sqrt(fit.world_covariance(0, 0)),
        1e3 * std::sqrt(fit.world_covariance(1, 1)));
  } else {
    fmt::print(
        "world       assumed correct: the offset includes errors of lamp map and reference "
        "point\n");
  }
}

void print_lamp_header() {
  fmt::print("\n{:>10} {:>28} {:>28}\n", "lamp", "correction x y z (mm)", "sd (mm)");
}

void print_lamp_row(int lamp, const Eigen::Vector3d& correction_m, const Eigen::Vector3d& sd_m,
                    const char* note) {
  fmt::print("{:10} {:10.3f}{:9.3f}{:9.3f} {:10.3f}{:9.3f}{:9.3f}{}\n", lamp,
             1e3 * correction_m.x(), 1e3 * correction_m.y(), 1e3 * correction_m.z(), 1e3 * sd_m.x(),
             1e3 * sd_m.y(), 1e3 * sd_m.z(), note);
}

void print_adjustment(const AdjustmentResult& found, const Calibration& before, bool lens_stated) {
  const RotationCenter& center = found.center;
  const MatrixX covariance = found.center_covariance;
  fmt::print("captures    {} used, {} rejected\n", found.captures, found.rejected_captures);
  fmt::print("detections  {} used, {} rejected\n", found.detections, found.rejected_detections);
  const Eigen::Vector3d& up = center.zenith_in_camera;
  fmt::print("tilt        {:.4f} deg, sd {:.4f} deg\n",
             deg_from_rad(std::acos(std::min(1.0, up.z()))),
             deg_from_rad(std::sqrt(covariance.topLeftCorner<2, 2>().trace() / 2)));
  if (before.rotation_center) {
    const double cosine = std::min(1.0, up.dot(before.rotation_center->zenith_in_camera));
    fmt::print("            {:.4f} deg from the previous calibration\n",
               deg_from_rad(std::acos(cosine)));
  }
  if (const auto& arm_m = center.lever_arm_m) {
    fmt::print("lever arm   {:.3f} {:.3f} mm, sd {:.3f} {:.3f} mm\n", 1e3 * arm_m->x(),
               1e3 * arm_m->y(), 1e3 * std::sqrt(covariance(2, 2)),
               1e3 * std::sqrt(covariance(3, 3)));
  } else {
    fmt::print("lever arm   not determined: add a rotation in place at a second height\n");
  }
  if (found.lens_degrees_of_freedom > 0) {
    fmt::print("lens        corrected: chi-squared {:.1f}, {} expected\n", found.lens_chi_squared,
               found.lens_degrees_of_freedom);
    const auto& lens = found.camera.intrinsics;
    const Eigen::VectorXd sd = found.surveyed_covariance.diagonal().head<4>().cwiseSqrt();
    fmt::print(
        "            fx fy {:.3f} {:.3f} px, sd {:.3f} {:.3f}; cx cy {:.3f} {:.3f} px, sd {:.3f} "
        "{:.3f}\n",
        lens[0], lens[1], sd[0], sd[1], lens[2], lens[3], sd[2], sd[3]);
  } else {
    fmt::print("lens        {}\n",
               lens_stated
                   ? "unchanged: the captures do not determine it"
                   : "treated as exact: the calibration has no lens covariance (see --lens-sd-px)");
  }
  fmt::print("residual    {:.4f} px per axis\n", found.residual_px);
  for (const auto& place : found.known_positions) {
    fmt::print("position    {}: error {:.3f} {:.3f} {:.3f} mm{}\n", place.name,
               1e3 * place.residual_m.x(), 1e3 * place.residual_m.y(), 1e3 * place.residual_m.z(),
               place.is_outlier ? ", rejected" : "");
  }
  print_lamp_header();
  for (const auto& [id, correction_m, sd_m, moved] : found.lamps) {
    print_lamp_row(id, correction_m, sd_m, moved ? "  differs from the map" : "");
  }
}

}  // namespace vlp
