// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/dispersion/dispersion.h"

#include <algorithm>

#include "calibration/dispersion/offset_separation.h"
#include "calibration/dispersion/reference_point_fixes.h"
#include "rig/calibration_error.h"

namespace vlp {

namespace {

/// Sets the fixes and circles before and after the correction.
void set_before_and_after(DispersionFit& fit, const ReferencePointFixes& reference_fixes,
                          const std::vector<bool>& used, DispersionCircle kind) {
  const OptionalFixes before = reference_fixes.locate_with_offset({0, 0}),
                      after = reference_fixes.locate_with_offset(fit.dispersion.offset_px);
  std::vector<Eigen::Vector2d> before_m, after_m;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (!before[i] || !after[i]) continue;
    fit.fixes.push_back({i, before[i]->error_m, after[i]->error_m, used[i]});
    if (!used[i]) continue;
    before_m.push_back(before[i]->error_m);
    after_m.push_back(after[i]->error_m);
  }
  fit.before = fit_dispersion_circle(before_m, kind);
  fit.after = fit_dispersion_circle(after_m, kind);
  fit.dispersion.radius_m = fit.before.radius;
  fit.dispersion.center_m = fit.before.center;
  fit.dispersion.captures = static_cast<int>(before_m.size());
}

/// Sets the derivatives of the offset, the first two rows of `jacobian_wrt_fixes`. Returns the
/// changes of all its rows for errors of the lamps of one standard deviation.
MatrixX set_derivatives(DispersionFit& fit, const ReferencePointFixes& reference_fixes,
                        const Eigen::MatrixXd& jacobian_wrt_fixes) {
  fit.jacobian_wrt_fixes = jacobian_wrt_fixes.topRows<2>();
  LampDerivatives& by_lamps = fit.lamp_derivatives;
  by_lamps = reference_fixes.differentiate_by_lamps(fit.dispersion.offset_px);
  by_lamps.jacobian_wrt_positions = jacobian_wrt_fixes * by_lamps.jacobian_wrt_positions;
  MatrixX changes = by_lamps.scale_by_lamp_sds();
  by_lamps.jacobian_wrt_positions.conservativeResize(2, Eigen::NoChange);
  return changes;
}

bool all_have_sigma(std::span<const ReferencePointCapture> captures) {
  return std::all_of(captures.begin(), captures.end(), [](const ReferencePointCapture& capture) {
    return std::all_of(capture.detections.begin(), capture.detections.end(),
                       [](const Detection& detection) { return detection.sigma_px.has_value(); });
  });
}

void fit_chen_guan_offset(DispersionFit& fit, const ReferencePointFixes& reference_fixes,
                          const Eigen::Vector2d& focal_px, DispersionCircle kind) {
  const ChenGuanOffset found =
      estimate_chen_guan_offset(reference_fixes, focal_px, kind, fit.noise_is_stated);
  fit.status = found.status;
  if (found.status != DispersionStatus::ok) return;
  fit.dispersion.offset_px = found.offset_px;
  fit.covariance = found.covariance;
  if (found.covariance) set_derivatives(fit, reference_fixes, found.jacobian_wrt_fixes);
  set_before_and_after(fit, reference_fixes, found.used, kind);
}

void fit_camera_offset(DispersionFit& fit, const ReferencePointFixes& reference_fixes,
                       DispersionCircle kind) {
  const auto separation = separate_offsets(reference_fixes);
  if (!separation) {
    fit.status = DispersionStatus::diverged;
    return;
  }
  const OptionalFixes fixes = reference_fixes.locate_with_offset({0, 0});
  if (compute_mean_fix(fixes, separation->used).count < 3) {
    fit.status = DispersionStatus::too_few_captures;
    return;
  }
  if (is_yaw_range_from_one_fix(fixes, separation->used)) {
    fit.status = DispersionStatus::single_yaw;
    return;
  }
  if (separation->degrees_of_freedom <= 0) {
    fit.status = DispersionStatus::too_few_captures;
    return;
  }
  const double factor = compute_variance_factor(
      separation->variance_factor, separation->degrees_of_freedom, fit.noise_is_stated);
  fit.dispersion.offset_px = separation->offset_px;
  Matrix2 covariance = factor * separation->covariance.topLeftCorner<2, 2>();
  covariance(1, 0) = covariance(0, 1);
  fit.covariance = covariance;
  const MatrixX world_changes_m =
      set_derivatives(fit, reference_fixes, separation->jacobian_wrt_fixes).bottomRows<2>();
  fit.world_offset_m = separation->world_m;
  fit.world_covariance = factor * separation->covariance.bottomRightCorner<2, 2>() +
                         world_changes_m * world_changes_m.transpose();
  set_before_and_after(fit, reference_fixes, separation->used, kind);
}

}  // namespace

JointCovariance append_offset(JointCovariance joint, const DispersionFit& fit,
                              const MatrixX& jacobian_wrt_steps, const Eigen::Vector2d& focal_px) {
  const auto& [lamps, by_positions] = fit.lamp_derivatives;
  for (const Lamp& lamp : lamps) {
    if (joint.find_lamp_row(lamp.id, lamp.position_m)) continue;
    joint.lamps.push_back({lamp.id, lamp.position_m});
    append_parameters(joint, list_lamp_parameters(lamp.id), MatrixX::Zero(3, joint.matrix.rows()),
                      *lamp.sd_m * *lamp.sd_m * MatrixX::Identity(3, 3));
  }
  const Eigen::Matrix2d per_px = focal_px.cwiseInverse().asDiagonal();
  MatrixX jacobian = MatrixX::Zero(2, joint.matrix.rows());
  jacobian.leftCols(jacobian_wrt_steps.cols()) = jacobian_wrt_steps;
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    jacobian.middleCols<3>(*joint.find_lamp_row(lamps[i].id, lamps[i].position_m)) =
        per_px * by_positions.middleCols<3>(3 * static_cast<Eigen::Index>(i));
  }
  append_parameters(joint, list_pair_names(kOffsetParameter), jacobian,
                    per_px * *fit.covariance * per_px);
  return joint;
}

namespace {

/// Estimates the offset from the captures of the fit.
void estimate_offset(DispersionFit& fit, const LampMap& map, const Calibration& calibration,
                     DispersionMethod method, DispersionCircle circle) {
  const ReferencePointFixes reference_fixes(fit.captures, map, calibration);
  const OptionalFixes fixes = reference_fixes.locate_with_offset({0, 0});
  const auto count =
      std::count_if(fixes.begin(), fixes.end(), [](const auto& fix) { return fix.has_value(); });
  fit.captures_without_fix = static_cast<int>(std::ssize(fixes) - count);
  fit.fixes.clear();
  fit.status = DispersionStatus::no_fix;
  if (count == 0) return;
  const bool paper = method == DispersionMethod::chen_guan;
  const std::vector<bool> all(fixes.size(), true);
  if (are_all_fixes_far(fixes)) {
    fit.status = DispersionStatus::all_far_from_reference;
  } else if (count < (paper ? 2 : 3)) {
    fit.status = DispersionStatus::too_few_captures;
  } else if (!paper && compute_mean_fix(fixes, all).are_yaws_similar()) {
    fit.status = DispersionStatus::single_yaw;
  } else {
    fit.status = DispersionStatus::ok;
    if (paper) {
      fit_chen_guan_offset(fit, reference_fixes, calibration.camera.focal_px(), circle);
    } else {
      fit_camera_offset(fit, reference_fixes, circle);
    }
  }
}

}  // namespace

DispersionFit estimate_dispersion(std::span<const ReferencePointCapture> captures,
                                  const LampMap& map, const Calibration& calibration,
                                  DispersionMethod method, DispersionCircle circle) {
  DispersionFit fit;
  fit.captures.assign(captures.begin(), captures.end());
  fit.no_fix_status = remove_outlier_lamps(fit.captures, map, calibration);
  fit.noise_is_stated = all_have_sigma(captures);
  estimate_offset(fit, map, calibration, method, circle);
  if (fit.status == DispersionStatus::ok &&
      scale_contradicted_noise(fit.captures, map, calibration, fit.dispersion.offset_px))
    estimate_offset(fit, map, calibration, method, circle);
  return fit;
}

std::optional<Eigen::Vector2d> predict_offset(const DispersionFit& fit,
                                              const Eigen::Vector2d& focal_px,
                                              std::span<const ReferencePointCapture> captures,
                                              const LampMap& map, const Calibration& calibration) {
  const Eigen::Vector2d offset = fit.dispersion.offset_px.cwiseQuotient(focal_px);
  const OptionalFixes fixes =
      ReferencePointFixes(captures, map, calibration)
          .locate_with_offset(offset.cwiseProduct(calibration.camera.focal_px()));
  Eigen::Vector2d change_px = Eigen::Vector2d::Zero();
  for (const DispersionFit::ReferencePointFix& fix : fit.fixes) {
    if (!fix.used) continue;
    if (!fixes[fix.capture]) return std::nullopt;
    change_px += fit.jacobian_wrt_fixes.middleCols<2>(2 * static_cast<Eigen::Index>(fix.capture)) *
                 (fixes[fix.capture]->error_m - fix.after_m);
  }
  return offset + change_px.cwiseQuotient(focal_px);
}

std::string_view describe_status(DispersionStatus status) {
  switch (status) {
    case DispersionStatus::ok:
      return "ok";
    case DispersionStatus::no_fix:
      return "no capture has a fix";
    case DispersionStatus::too_few_captures:
      return "too few captures have a fix that agrees with the others: three or more are needed "
             "(two for --method chen-guan); add captures";
    case DispersionStatus::all_far_from_reference:
      return "every fix is farther from its reference point than a fifth of the lamp height: is "
             "the reference point in meters, in the frame of the lamp map, and that of these "
             "captures?";
    case DispersionStatus::single_yaw:
      return "all captures, or all but one, have one yaw, which cannot separate errors of the "
             "camera from errors of the reference point or the lamp map; turn the camera at the "
             "reference point and add captures, or use --method chen-guan, which assumes an exact "
             "reference point and lamp map";
    case DispersionStatus::several_yaws:
      return "the captures have different yaws, over which the circle of Chen and Guan averages "
             "out the camera error; use one yaw, or use --method camera";
    case DispersionStatus::diverged:
      return "no offset explains the fixes: are the lamp positions, the reference points and the "
             "calibration correct? Add captures at other yaws";
  }
  return "";
}

}  // namespace vlp
