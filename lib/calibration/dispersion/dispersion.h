// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "geometry/circle_fit.h"
#include "positioning/fix.h"
#include "rig/calibration.h"
#include "rig/detection.h"
#include "rig/lamp_map.h"

namespace vlp {

/// Capture at a reference point, that is, at a known position of the camera.
struct ReferencePointCapture {
  std::vector<Detection> detections;
  /// Known horizontal position (x, y) of the camera in the world frame, m: the reference point.
  Eigen::Vector2d reference_point_m;
  std::optional<Inclination> inclination = {};
  /// Name of the image, for messages.
  std::string image = {};
};

/// Method of estimate_dispersion().
enum class DispersionMethod {
  /// Separates errors that rotate with the camera from errors that are fixed in the world. Requires
  /// captures at various yaws.
  camera,
  /// Method of Chen and Guan: moves the center of the dispersion circle to the reference point.
  /// Requires captures at one yaw.
  chen_guan
};

/// Definition of the dispersion circle: `mean` is centered at the mean fix and contains the
/// farthest one; `enclosing` is the smallest enclosing circle.
enum class DispersionCircle { mean, enclosing };

/// Result of a dispersion calibration.
enum class DispersionStatus {
  ok,
  no_fix,                  // no capture has a position fix
  too_few_captures,        // fewer than three with a fix (`chen_guan`: two)
  all_far_from_reference,  // every fix is far from the reference point
  single_yaw,              // `camera`: one yaw cannot separate errors of camera and world
  several_yaws,            // `chen_guan`: the captures are at several yaws
  diverged                 // no offset explains the fixes
};

/// Describes the status and the remedy, human-readable.
std::string_view describe_status(DispersionStatus status);

/// Derivatives of a vector of quantities with respect to the positions of lamps. Unit: that of the
/// quantity, per m. `lamps` are the detected ones with an sd_m in the map.
struct LampDerivatives {
  std::vector<Lamp> lamps;
  /// Matrix of the derivatives: one row for each quantity, three columns (x, y, z) for each lamp.
  Eigen::MatrixXd jacobian_wrt_positions;

  /// Returns the changes of the quantities for errors of one standard deviation, one column per
  /// lamp coordinate.
  Eigen::MatrixXd scale_by_lamp_sds() const;
};

/// Result of estimate_dispersion(). Members after `noise_is_stated` are valid only if
/// the status is `ok`.
struct DispersionFit {
  DispersionStatus status = DispersionStatus::no_fix;
  /// Number of captures for which no position fix exists.
  int captures_without_fix = 0;
  /// Status of the first capture without a fix; `ok` if all have one.
  FixStatus no_fix_status = FixStatus::ok;
  /// True if all detections state their sigma_px.
  bool noise_is_stated = false;
  /// The captures without the detections of their outlier lamps, and with a larger sigma_px if
  /// their residuals contradict it.
  std::vector<ReferencePointCapture> captures = {};

  /// Offset; the circle is that of `before`.
  Dispersion dispersion = {{0, 0}, 0, {0, 0}, 0};
  /// Covariance of offset_px in px^2 with exact lens, zenith, lever arm and map, from the scatter
  /// of the fixes and their noise (compute_variance_factor()); derivatives of offset_px with
  /// respect to the lamps, and to the fixes of all captures (two columns each). Absent for the
  /// enclosing circle.
  std::optional<Matrix2> covariance = {};
  LampDerivatives lamp_derivatives = {};
  Eigen::Matrix2Xd jacobian_wrt_fixes = {};
  /// Mean error of the corrected fixes, fixed in the world: fix minus reference point. Caused by
  /// errors of the reference point or the lamp map. Absent for method `chen_guan`, which assumes
  /// that it is zero.
  std::optional<Eigen::Vector2d> world_offset_m = {};
  /// Covariance of `world_offset_m`, m^2, from noise and lamp map.
  Matrix2 world_covariance = Matrix2::Zero();

  /// Position fix of one capture.
  struct ReferencePointFix {
    /// Index of the capture in the input.
    std::size_t capture;
    /// Fix minus reference point, horizontally in the world, without any dispersion correction and
    /// with the estimated one.
    Eigen::Vector2d before_m, after_m;
    /// False if the fix contradicts the other fixes and is rejected.
    bool used;
  };
  std::vector<ReferencePointFix> fixes = {};
  /// Dispersion circles, m, of the used fixes' errors without and with the dispersion correction,
  /// in the world.
  Circle before = {{0, 0}, 0}, after = {{0, 0}, 0};
};

/// Returns the joint covariance with the errors of an offset and of the lamps that affect it.
///
/// @param joint     covariance of the steps before; lamps of an adjustment keep their errors
/// @param jacobian_wrt_steps  derivative of offset_px / f with respect to the parameters before the
/// lamps
/// @pre the fit has a covariance
JointCovariance append_offset(JointCovariance joint, const DispersionFit& fit,
                              const MatrixX& jacobian_wrt_steps, const Eigen::Vector2d& focal_px);

/// Estimates the dispersion: an offset in the undistorted image that makes fixes err with the yaw
/// of the camera (lib/THEORY.md, "Dispersion circle").
///
/// A level camera with yaw g_k has its lamps at height H_k above it. If its normalized points are
/// too large by delta, and reference point or map have an error m, then
///   fix_k - reference = -H_k e^{j g_k} delta + m
///
/// Method `chen_guan` assumes m = 0. The center D of the circle gives offset_px = -f e^{-jg} D / H.
/// The offset is corrected until the circle of the recomputed fixes is centered at the reference
/// point (estimate_chen_guan_offset()). These are eq. 10 to 13, with the scale f / H
/// and the rotation by the yaw, which the paper omits.
///
/// Method `camera` estimates offset_px = f delta and m. The fixes are recomputed with the offset as
/// in compute_level_from_camera_matrix(), so that the model is exact. Each fix is weighted by its
/// covariance.
///
/// Fixes beyond five standard deviations, from the median of the residuals, are rejected. An
/// existing dispersion of `calibration` is ignored.
///
/// Source: Chen and Guan, section 3.2.
DispersionFit estimate_dispersion(std::span<const ReferencePointCapture> captures,
                                  const LampMap& map, const Calibration& calibration,
                                  DispersionMethod method,
                                  DispersionCircle circle = DispersionCircle::mean);

/// Predicts offset_px / f for slightly different reference points or another calibration, to first
/// order: with the same fixes used, their changes times `jacobian_wrt_fixes`.
///
/// @param fit       has a covariance
/// @param focal_px  focal lengths of the calibration of `fit`
/// @param captures  those of `fit`; only their reference points may differ
/// @return std::nullopt if a used capture has no fix
std::optional<Eigen::Vector2d> predict_offset(const DispersionFit& fit,
                                              const Eigen::Vector2d& focal_px,
                                              std::span<const ReferencePointCapture> captures,
                                              const LampMap& map, const Calibration& calibration);

}  // namespace vlp
