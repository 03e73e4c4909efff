// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/dispersion_step.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "calibration/error_propagation.h"
#include "geometry/frames.h"
#include "positioning/positioner.h"
#include "report/plots/calibration_plots.h"
#include "rig/calibration_builder.h"
#include "rig/calibration_error.h"
#include "session/check_outliers.h"

namespace vlp {

namespace {

std::string describe_missing_positions(std::size_t missing, std::size_t captures) {
  return fmt::format(
      "{} of the {} captures have no position: add x_m and y_m to captures.csv or truth.csv",
      missing, captures);
}

}  // namespace

KnownPositions collect_known_captures(std::span<const Frame> frames, const CapturesTable& table,
                                      const std::optional<Eigen::Vector2d>& place_m,
                                      MeasuredPoint measured_point) {
  KnownPositions places;
  for (const Frame& frame : frames) {
    const auto entry = table.find(frame.image);
    const Capture capture_entry = entry == table.end() ? Capture{} : entry->second;
    if (capture_entry.x_m && capture_entry.y_m) {
      places.captures.push_back({frame.detections,
                                 {*capture_entry.x_m, *capture_entry.y_m},
                                 capture_entry.inclination,
                                 frame.image});
      places.measured_points.push_back(capture_entry.measured_point);
    } else if (place_m) {
      places.captures.push_back(
          {frame.detections, *place_m, capture_entry.inclination, frame.image});
      places.measured_points.push_back(measured_point);
    } else {
      ++places.captures_without_position;
    }
  }
  return places;
}

StepResult check_known_positions(std::size_t known, std::size_t captures, int required) {
  StepResult result;
  if (known > 0 && known >= std::min(captures, static_cast<std::size_t>(required))) return result;
  result.set_step_failure(StepFailure::wrong_place,
                          describe_missing_positions(captures - known, captures));
  return result;
}

namespace {

Fix locate_capture(const Positioner& positioner, const ReferencePointCapture& capture) {
  Sensors sensors;
  sensors.inclination = capture.inclination;
  return positioner.compute_position_fix(capture.detections, sensors);
}

/// Returns the captures with places of the camera. Captures without a fix have no yaw and keep
/// their places.
std::vector<ReferencePointCapture> move_to_camera(std::vector<ReferencePointCapture> captures,
                                                  std::span<const MeasuredPoint> measured_points,
                                                  const LampMap& lamps,
                                                  const Calibration& leveled) {
  const Positioner positioner(lamps, leveled);
  const Eigen::Vector2d& arm_m = *leveled.rotation_center->lever_arm_m;
  for (std::size_t i = 0; i < captures.size(); ++i) {
    if (measured_points[i] != MeasuredPoint::axis) continue;
    const Fix fix = locate_capture(positioner, captures[i]);
    if (!fix.has_succeeded()) continue;
    captures[i].reference_point_m +=
        rotation_about_z(fix.state.pose.yaw_rad).topLeftCorner<2, 2>() * arm_m;
  }
  return captures;
}

/// Returns the mean height of the first lamp of the map above the cameras, m; 0 without a fix.
double compute_mean_height_m(const KnownPositions& places, const LampMap& lamps,
                             const Calibration& leveled) {
  const Positioner positioner(lamps, leveled);
  double height_m = 0;
  int fixes = 0;
  for (const ReferencePointCapture& capture : places.captures) {
    const Fix fix = locate_capture(positioner, capture);
    if (!fix.has_succeeded()) continue;
    height_m += lamps.lamps.front().position_m.z() - fix.state.pose.position_m.z();
    ++fixes;
  }
  return fixes > 0 ? height_m / fixes : 0;
}

/// Warns of an offset that equals the lever arm. An offset d acts as a camera displaced by H d / f.
void warn_about_lever_arm(DispersionResult& result, const KnownPositions& places,
                          const LampMap& lamps, const Calibration& leveled) {
  const auto& center = leveled.rotation_center;
  if (!center || !center->lever_arm_m) return;
  const Eigen::Vector2d& arm_m = *center->lever_arm_m;
  const double height_m = compute_mean_height_m(places, lamps, leveled);
  if (!(height_m > 0)) return;
  const Eigen::Vector2d focal_px = leveled.camera.focal_px();
  const Eigen::Vector2d displacement_m =
      height_m * result.fit.dispersion.offset_px.cwiseQuotient(focal_px);
  constexpr double max_relative_difference = 0.2, min_m = 1e-3;
  if (arm_m.norm() < min_m ||
      (displacement_m + arm_m).norm() > max_relative_difference * arm_m.norm())
    return;
  result.warnings.push_back(
      fmt::format("the offset equals the lever arm, {:.1f} mm: the positions are those of the "
                  "axis, and fixes would have an error of {:.1f} mm; state reference_point: axis "
                  "in captures.csv, or --position-of axis",
                  1e3 * arm_m.norm(), 1e3 * displacement_m.norm()));
}

/// Function that returns the captures with their places; places of an axis depend on the
/// calibration.
using CapturesFor =
    std::function<std::vector<ReferencePointCapture>(const Calibration& calibration)>;

/// Adds errors of the lens, zenith and lever arm, as far as `joint` has them, to a calibration.
Calibration add_errors(const JointCovariance& joint, Calibration calibration,
                       const Eigen::VectorXd& errors) {
  const Eigen::Index lens = count_intrinsics(calibration.camera);
  if (joint.find_row("fx"))
    calibration = add_intrinsics_error(std::move(calibration), errors.head(lens));
  if (const auto row = joint.find_row(kZenithParameter))
    calibration = add_zenith_error(std::move(calibration), errors.segment<2>(*row));
  const auto arm = joint.find_row(kLeverArmParameter);
  if (arm && calibration.rotation_center->lever_arm_m)
    *calibration.rotation_center->lever_arm_m += errors.segment<2>(*arm);
  return calibration;
}

/// Adds the offset to the joint covariance; std::nullopt if its errors are unknown.
std::optional<JointCovariance> compute_joint_covariance(DispersionResult& result,
                                                        const CapturesFor& captures_for,
                                                        const LampCaptures& input,
                                                        const Calibration& leveled) {
  const DispersionFit& fit = result.fit;
  if (!fit.covariance) return leveled.covariance;
  const Eigen::Vector2d focal_px = leveled.camera.focal_px();
  JointCovariance joint;
  if (leveled.covariance) {
    joint = *leveled.covariance;
  } else if (!leveled.rotation_center) {
    joint = make_lens_covariance(leveled);
  }
  const Eigen::Index steps = joint.first_lamp_row();
  std::optional<MatrixX> jacobian_wrt_steps(MatrixX(2, 0));
  if (steps > 0) {
    MatrixX covariance = joint.matrix.topLeftCorner(steps, steps);
    for (const std::string_view parameter : {kZenithParameter, kLeverArmParameter}) {
      constexpr double min_step = 1e-5;  // smallest step: second-order error 1e-10
      if (const auto row = joint.find_row(parameter))
        covariance.diagonal().segment<2>(*row).array() += min_step * min_step;
    }
    jacobian_wrt_steps = differentiate_solution(
        [&](const Eigen::VectorXd& errors) -> std::optional<Eigen::VectorXd> {
          const Calibration perturbed = add_errors(joint, leveled, errors);
          const auto offset =
              predict_offset(fit, focal_px, captures_for(perturbed), input.lamps, perturbed);
          if (!offset) return std::nullopt;
          return Eigen::VectorXd(*offset);
        },
        fit.dispersion.offset_px.cwiseQuotient(focal_px), covariance);
  }
  if (jacobian_wrt_steps) {
    return append_offset(std::move(joint), fit, *jacobian_wrt_steps, focal_px);
  }
  result.warnings.push_back(fmt::format(
      "the effect of lens and zenith errors on the offset cannot be determined, and the "
      "sd of fixes will not contain the error of the offset: add captures at other yaws{}",
      leveled.adjustment ? "" : ", or use vlp-adjust"));
  return leveled.covariance;
}

/// Describes the captures that do not fit the result, by the residuals of their fixes.
void set_inconsistent_captures(DispersionResult& result, const KnownPositions& places,
                               const LampMap& lamps) {
  const Positioner positioner(lamps, result.calibration);
  std::vector<CaptureResidual> residuals;
  for (std::size_t i = 0; i < places.captures.size(); ++i) {
    const ReferencePointCapture& capture = places.captures[i];
    add_residual(locate_capture(positioner, capture), capture.image, i, residuals);
  }
  result.set_inconsistent_captures(describe_residual_outliers(residuals));
}

void warn_about_few_captures(DispersionResult& result, DispersionMethod method) {
  constexpr int min_captures = 4;  // three have only two degrees of freedom
  if (method != DispersionMethod::camera || result.fit.noise_is_stated ||
      result.fit.dispersion.captures >= min_captures) {
    return;
  }
  result.warnings.emplace_back(
      "three captures barely determine their noise, and the standard deviation of the offset may "
      "be wrong by a factor of several: add captures, or state sigma_px");
}

/// Fails the step with the reason why there is no offset, and explains it by errors of the lamp map
/// if the captures are sufficient.
void set_failure(DispersionResult& result, const LampCaptures& input, const Calibration& leveled) {
  const DispersionFit& fit = result.fit;
  std::string why(describe_status(fit.status));
  if (fit.status == DispersionStatus::no_fix) {
    why += fmt::format("; the first: {}", describe_fix_status(fit.no_fix_status));
  }
  const bool is_far = fit.status == DispersionStatus::all_far_from_reference;
  result.set_step_failure(is_far ? StepFailure::wrong_place : StepFailure::undetermined,
                          std::move(why));
  const bool is_of_captures = fit.status == DispersionStatus::too_few_captures ||
                              fit.status == DispersionStatus::single_yaw ||
                              fit.status == DispersionStatus::several_yaws;
  if (!is_far && !is_of_captures) explain_by_map_errors(input, leveled, result);
}

std::vector<Metric> make_metrics(const DispersionFit& fit) {
  constexpr double millimeters = 1e3;
  std::vector<Metric> metrics{{"dispersion_mm", millimeters * fit.dispersion.radius_m},
                              {"dispersion_offset_px", fit.dispersion.offset_px.norm()}};
  if (const auto& world_m = fit.world_offset_m) {
    metrics.push_back({"world_offset_mm", millimeters * world_m->norm()});
  }
  return metrics;
}

}  // namespace

DispersionResult run_dispersion_step(const LampCaptures& input, const KnownPositions& places,
                                     DispersionMethod method, DispersionCircle circle,
                                     HistoryEntry entry) {
  DispersionResult result;
  const Calibration leveled = remove_dispersion(input.calibration);
  check_lamp_map(input, leveled, result);
  if (!result.has_succeeded()) return result;
  if (const std::size_t missing = places.captures_without_position; missing > 0) {
    result.warnings.push_back(
        describe_missing_positions(missing, missing + places.captures.size()) + "; ignored");
  }
  const bool of_axis = std::find(places.measured_points.begin(), places.measured_points.end(),
                                 MeasuredPoint::axis) != places.measured_points.end();
  const auto& center = input.calibration.rotation_center;
  if (of_axis && !(center && center->lever_arm_m)) {
    result.set_step_failure(
        StepFailure::undetermined,
        "the positions are those of the axis, and the calibration has no lever arm; run "
        "vlp-rotation with captures at two heights");
    return result;
  }
  std::vector<ReferencePointCapture> captures = places.captures;
  const CapturesFor captures_for = [&](const Calibration& calibration) {
    if (!of_axis) return captures;
    return move_to_camera(captures, places.measured_points, input.lamps, calibration);
  };
  result.fit = estimate_dispersion(captures_for(leveled), input.lamps, leveled, method, circle);
  const DispersionFit& fit = result.fit;
  if (fit.status != DispersionStatus::ok) {
    set_failure(result, input, leveled);
    return result;
  }
  if (!input.calibration.rotation_center) {
    result.warnings.emplace_back("the calibration has no rotation_center: run vlp-rotation first");
  }
  for (std::size_t i = 0; i < captures.size(); ++i)
    captures[i].detections = fit.captures[i].detections;
  warn_about_few_captures(result, method);
  if (!of_axis) warn_about_lever_arm(result, places, input.lamps, leveled);
  result.metrics = make_metrics(fit);
  auto covariance = compute_joint_covariance(result, captures_for, input, leveled);
  result.calibration =
      add_dispersion(input.calibration, fit.dispersion, std::move(covariance), std::move(entry));
  set_inconsistent_captures(result, places, input.lamps);
  result.drawing = [fit] {
    return draw_dispersion(make_dispersion_plot("Fixes at a reference point", fit));
  };
  return result;
}

}  // namespace vlp
