// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/rotation_step.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "calibration/error_propagation.h"
#include "calibration/rotation/rotation_fit.h"
#include "geometry/angles.h"
#include "positioning/known_motion.h"
#include "report/plots/calibration_plots.h"
#include "rig/calibration_builder.h"
#include "rig/calibration_error.h"
#include "session/check_outliers.h"
#include "session/lamp_captures.h"

namespace vlp {
namespace {

std::string_view rotation_method_name(RotationMethod method) {
  return std::ranges::find(kRotationMethods, method,
                           &std::pair<std::string_view, RotationMethod>::second)
      ->first;
}

/// Appends zenith and, if known, lever arm to the covariance of the lens. `own` is their covariance
/// with an exact lens, and `jacobian_wrt_lens` their derivative with respect to it.
JointCovariance append_center(JointCovariance lens, const MatrixX& jacobian_wrt_lens,
                              const MatrixX& own) {
  std::vector<std::string> names;
  for (const std::string_view first : {kZenithParameter, kLeverArmParameter})
    std::ranges::copy(list_pair_names(first), std::back_inserter(names));
  names.resize(static_cast<std::size_t>(own.rows()));
  append_parameters(lens, names, jacobian_wrt_lens, own);
  return lens;
}

/// Returns the joint covariance of lens, zenith and lever arm. `own` is that of zenith and lever
/// arm with an exact lens, and `joint` that of all, if the covariance of the lens is known.
JointCovariance make_joint_covariance(const Calibration& calibration, const MatrixX& own,
                                      const std::optional<MatrixX>& joint) {
  JointCovariance lens = make_lens_covariance(calibration);
  const MatrixX lens_covariance = lens.matrix;
  const MatrixX independent = MatrixX::Zero(own.rows(), lens.matrix.cols());
  JointCovariance result = append_center(std::move(lens), independent, own);
  if (joint) {
    result.matrix = *joint;
    result.matrix.topLeftCorner(lens_covariance.rows(), lens_covariance.cols()) = lens_covariance;
  }
  return result;
}

/// Returns true if two sets of captures have the same observations in the same order.
bool has_same_observations(const RotationCaptures& a, const RotationCaptures& b) {
  return a.heights.size() == b.heights.size() &&
         std::equal(a.captures.begin(), a.captures.end(), b.captures.begin(), b.captures.end(),
                    [](const auto& one, const auto& other) { return one.image == other.image; }) &&
         std::equal(a.observations.begin(), a.observations.end(), b.observations.begin(),
                    b.observations.end(), [](const auto& one, const auto& other) {
                      return one.capture == other.capture && one.lamp == other.lamp;
                    });
}

/// Differentiates the mean of the circle centers by fits of the same observations with other
/// lenses. A fit that rejects other observations changes by more than the lens causes.
std::optional<JointCovariance> compute_circle_covariance(RotationResult& result,
                                                         const LampCaptures& input) {
  const RotationFit& fit = result.fit;
  if (!fit.covariance) return std::nullopt;
  JointCovariance lens = make_lens_covariance(input.calibration);
  std::optional<MatrixX> jacobian(MatrixX(fit.covariance->rows(), 0));
  if (!lens.parameters.empty()) {
    const auto with_error = [&](const Eigen::VectorXd& error) -> std::optional<Eigen::VectorXd> {
      const Camera camera = add_intrinsics_error(extract_camera(input.calibration), error).camera;
      const RotationCaptures rotation = detect_pivots(input.frames, input.lamps, camera);
      if (rotation.status != RotationStatus::ok ||
          !has_same_observations(rotation, result.rotation))
        return {};
      const RotationFit other =
          fit_circle_centers(rotation, camera, fit_rotation_axis(rotation, camera)).mean;
      if (!other.converged || other.used_observations != fit.used_observations) return {};
      return Eigen::VectorXd(compute_zenith_point(other.center));
    };
    jacobian = differentiate_solution(with_error, compute_zenith_point(fit.center), lens.matrix);
  }
  if (!jacobian) {
    result.warnings.emplace_back(
        "the effect of lens errors on the zenith cannot be determined, and sd of fixes will lack "
        "it; use vlp-adjust");
    lens = {};
    jacobian = MatrixX(fit.covariance->rows(), 0);
  }
  return append_center(std::move(lens), *jacobian, *fit.covariance);
}

void add_warnings(RotationResult& result) {
  const auto& heights = result.rotation.heights;
  if (!result.fit.center.lever_arm_m && heights.size() == 1) {
    result.warnings.push_back(
        fmt::format("at one height, under lamps of similar heights, lever arm and tilt cannot be "
                    "separated; the lever arm is assumed to be zero, and fixes at z = {} m will be "
                    "those of the rotation axis: add captures at a second height",
                    format_height_m(heights.front().z_m)));
  } else if (!result.fit.center.lever_arm_m) {
    result.warnings.push_back(
        fmt::format("this method assumes a lever arm of zero, and the center is a mean over {} "
                    "heights: use --method axis, which estimates both",
                    heights.size()));
  }
  if (!result.fit.covariance) {
    result.warnings.emplace_back(
        "three captures of a height leave no residuals, and the "
        "center has no standard deviation: add captures, four or more at each height");
  }
  constexpr double max_noise_ratio = 3;
  const auto& median_sigma_px = result.rotation.median_sigma_px;
  if (median_sigma_px && result.fit.residual_px > max_noise_ratio * *median_sigma_px) {
    // [ROTATION-1] `the residuals ` | lens or map inaccurate, camera beside the axis, or `sigma_px`
    //   too small | check lens, map and `sigma_px`
    result.warnings.push_back(
        fmt::format("the residuals correspond to {:.2g} px of noise, {:.2g} px are stated: is the "
                    "lens calibrated, the camera off the axis, the method exact?",
                    result.fit.residual_px, *median_sigma_px));
  }
}

void add_metrics(RotationResult& result, const Eigen::Vector2d& focal_px) {
  const RotationCenter& center = result.fit.center;
  result.metrics = {{"rotation_px", result.fit.residual_px},
                    {"tilt_deg", deg_from_rad(compute_tilt(center).angle_rad)}};
  if (!result.circles.circles.empty()) {
    result.metrics.push_back({"rotation_spread_px", result.circles.spread_px});
  }
  if (const auto& covariance = result.fit.covariance) {
    const Eigen::Vector2d variances_px2 =
        focal_px.cwiseAbs2().cwiseProduct(covariance->diagonal().head<2>());
    result.metrics.push_back({"rotation_sd_px", std::sqrt(variances_px2.sum())});
  }
  if (const auto& arm_m = center.lever_arm_m) {
    result.metrics.push_back({"lever_arm_mm", 1e3 * arm_m->norm()});
  }
}

/// Finds errors of the map from the captures in which the camera stands. From captures of a moving
/// camera, which shear lamps by several millimeters, finds only errors of the map as a whole.
MapErrors detect_errors_in_map(const LampCaptures& input, const Calibration& calibration,
                               double min_offset_px) {
  std::vector<Frame> frames;
  for (std::size_t i = 0; i < input.frames.size(); ++i) {
    if (input.motions.empty() || !may_move(input.motions[i])) frames.push_back(input.frames[i]);
  }
  MapErrorOptions options;
  options.min_offset_px = min_offset_px;
  MapErrors found = detect_map_errors(frames, input.lamps, calibration, options);
  if (frames.size() == input.frames.size() || !found.errors.empty()) return found;
  MapErrors all = detect_map_errors(input.frames, input.lamps, calibration, options);
  std::erase_if(all.errors, [](const MapError& error) {
    return error.kind == MapErrorKind::moved || error.kind == MapErrorKind::inconsistent;
  });
  found.errors = std::move(all.errors);
  return found;
}

/// Describes the captures that do not fit the result, by the residuals of their fixes.
void set_inconsistent_captures(RotationResult& result, const LampCaptures& input) {
  const Positioner positioner(input.lamps, result.calibration);
  std::vector<CaptureResidual> residuals;
  for (std::size_t i = 0; i < input.frames.size(); ++i) {
    const Frame& frame = input.frames[i];
    add_residual(positioner.compute_position_fix(frame.detections), frame.image, i, residuals);
  }
  result.set_inconsistent_captures(describe_residual_outliers(residuals));
}

/// Smallest offset of a lamp that can make a step fail, as seen in the image.
constexpr double kMinBlame_px = 2.5;

}  // namespace

std::string format_height_m(double z_m) {
  const std::string text = fmt::format("{:.3f}", z_m);
  return text == "-0.000" ? "0.000" : text;
}

Calibration extract_camera(const Calibration& calibration) {
  Calibration alone;
  alone.camera = calibration.camera;
  return alone;
}

MapErrors check_lamp_map(const LampCaptures& input, const Calibration& calibration,
                         StepResult& result) {
  MapErrors found = detect_errors_in_map(input, calibration, MapErrorOptions().min_offset_px);
  if (found.is_map_unusable()) {
    result.set_step_failure(StepFailure::wrong_map, describe_map_errors(found.errors),
                            input.lamps_file);
    return found;
  }
  for (const MapError& error : found.errors) {
    if (!error.lamps.empty()) result.warnings.push_back(describe_map_error(error));
  }
  return found;
}

void explain_by_map_errors(const LampCaptures& input, const Calibration& calibration,
                           StepResult& result) {
  const MapErrors found = detect_errors_in_map(input, calibration, kMinBlame_px);
  const bool has_lamps = std::any_of(found.errors.begin(), found.errors.end(),
                                     [](const MapError& error) { return !error.lamps.empty(); });
  if (found.errors.empty() || (!has_lamps && result.failure == StepFailure::wrong_map)) return;
  // The advice of a fit that diverges because of a lamp is misleading.
  result.set_step_failure(StepFailure::wrong_map, describe_map_errors(found.errors),
                          input.lamps_file);
  for (const MapError& error : found.errors) std::erase(result.warnings, describe_map_error(error));
}

RotationResult run_rotation_step(const LampCaptures& input, RotationMethod method,
                                 HistoryEntry entry) {
  RotationResult result;
  check_lamp_map(input, extract_camera(input.calibration), result);
  if (!result.has_succeeded()) return result;
  const Camera& camera = input.calibration.camera;
  result.rotation = detect_pivots(input.frames, input.lamps, camera);
  for (const auto& [image, reason] : result.rotation.rejected_captures) {
    result.warnings.push_back(fmt::format("{}: rejected: {}", image, reason));
  }
  if (result.rotation.status != RotationStatus::ok) {
    const bool map = result.rotation.status == RotationStatus::other_map;
    result.set_step_failure(map ? StepFailure::wrong_map : StepFailure::undetermined,
                            std::string(describe_status(result.rotation.status)),
                            map ? input.lamps_file : std::filesystem::path());
    if (map || result.rotation.status == RotationStatus::axis_moved) {
      explain_by_map_errors(input, extract_camera(input.calibration), result);
    }
    return result;
  }
  const auto& report = input.calibration.intrinsics_report;
  const RotationFit axis =
      fit_rotation_axis(result.rotation, camera, report ? report->covariance : std::nullopt);
  result.circles = fit_circle_centers(result.rotation, camera, axis);
  result.fit = method == RotationMethod::axis ? axis : result.circles.mean;
  if (!result.fit.converged) {
    const bool is_noise = method == RotationMethod::circle && result.circles.undetermined > 0;
    result.set_step_failure(
        StepFailure::undetermined,
        is_noise ? "noise determines most circles, as with captures at two yaws: add captures at "
                   "other yaws, preferably twelve over a full turn, or use --method axis"
                 : "no rotation center fits the captures: take them at one position per height, "
                   "over more of the turn, with more visible lamps, and check lens and lamp map");
    explain_by_map_errors(input, extract_camera(input.calibration), result);
    return result;
  }
  auto covariance = method == RotationMethod::circle
                        ? compute_circle_covariance(result, input)
                        : make_joint_covariance(input.calibration, *result.fit.covariance,
                                                result.fit.joint_covariance);
  add_metrics(result, camera.focal_px());
  add_warnings(result);
  result.calibration = add_rotation_center(input.calibration, result.fit.center,
                                           std::move(covariance), std::move(entry));
  set_inconsistent_captures(result, input);
  const std::string title = fmt::format("{}, method {}", camera.id, rotation_method_name(method));
  result.drawing = [title, rotation = result.rotation, circles = result.circles, fit = result.fit,
                    camera] {
    return draw_rotation(make_rotation_plot(title, rotation, circles, fit, camera));
  };
  return result;
}

TiltResult run_tilt_step(const LampCaptures& input, bool refine_map, HistoryEntry entry) {
  TiltResult result;
  const Calibration alone = extract_camera(input.calibration);
  check_lamp_map(input, alone, result);
  if (!result.has_succeeded()) return result;
  TiltCalibrationOptions options;
  options.refine_map = refine_map;
  options.motions = input.motions;
  if (std::any_of(input.motions.begin(), input.motions.end(), may_move)) {
    check_timing_known(input.calibration.camera);
  }
  if (const auto& report = input.calibration.intrinsics_report)
    options.lens_covariance = report->covariance;
  TiltCalibration& leveling = result.tilt;
  leveling = estimate_tilt_from_lamps(input.frames, input.lamps, input.calibration.camera, options);
  if (!leveling.undetermined.empty()) {
    result.set_step_failure(StepFailure::undetermined, leveling.undetermined);
    explain_by_map_errors(input, alone, result);
    return result;
  }
  if (leveling.captures_rejected > leveling.captures) {
    result.set_step_failure(StepFailure::wrong_map,
                            describe_map_error(MapError{MapErrorKind::other_room}),
                            input.lamps_file);
    return result;
  }
  auto covariance =
      make_joint_covariance(input.calibration, leveling.covariance, leveling.joint_covariance);
  result.metrics = {{"tilt_deg", deg_from_rad(compute_tilt(leveling.center).angle_rad)}};
  constexpr double max_noise_scale = 3;
  if (leveling.noise_scale > max_noise_scale) {
    // [ROTATION-1] `--refine-map may help`
    result.warnings.push_back(
        fmt::format("the residuals are {:.1f} times those expected from sigma_px: lamp map or lens "
                    "is slightly wrong, and the error of the tilt may exceed its sd{}",
                    leveling.noise_scale, refine_map ? "" : "; --refine-map may help"));
  }
  result.calibration = add_rotation_center(input.calibration, leveling.center,
                                           std::move(covariance), std::move(entry));
  return result;
}

}  // namespace vlp
