// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "captures/captures_table.h"
#include "positioning/positioner.h"
#include "rig/calibration.h"
#include "rig/detection.h"
#include "rig/lamp_map.h"

/// Adjustment of everything that captures have in common: least squares over all captures at once.
///
/// A capture k with its camera at S with yaw g sees lamp P at
///   project(camera_from_level(zenith) (Rz(-g) (P - S)); intrinsics)
/// If the base rotates in place about the axis A, S = A + Rz(g) e. Let the camera move with
/// velocity u and yaw rate w. A lamp that is read out at time t after the middle of the image is
/// then at
///   Rz(-w t) (Rz(-g) (P - S) - u t)
/// in place of Rz(-g) (P - S). At a pivot, the yaw rate applies in the same way.
///
/// Unknowns:
///   - zenith, lever arm e, positions of the lamps
///   - intrinsics, within their covariance
///   - an axis A per pivot
///   - per capture a pose (at a pivot: a yaw), with u and w if they are not known exactly
///
/// Observations:
///   - lamp centers with their sigma_px
///   - survey of the lamps with its sd_m
///   - intrinsics with their covariance
///   - positions of the camera or of the axis with their standard deviation
namespace vlp {

/// Measured position in the world frame, m. `xy_m` is the horizontal position of the camera or of
/// the rotation axis (`measured_point`). `z_m` is the height of the camera in both cases;
/// std::nullopt if it was not measured.
struct KnownPosition {
  MeasuredPoint measured_point;
  Eigen::Vector2d xy_m;
  std::optional<double> z_m;
  /// Standard deviation of each coordinate; positive. A position that is measured once counts once:
  /// captures of one pivot, or with identical positions, have the same error.
  double sd_m;
};

/// Knowledge of the positions of the lamps. AdjustmentResult::surveyed_covariance is defined for
/// `survey` only.
enum class MapPrior {
  /// Each position with its sd_m.
  survey,
  /// Only translation, yaw and scale of the map, exactly, because captures do not determine them.
  /// The corrections d of the detected lamps, at p relative to their mean, satisfy
  ///   sum d = 0,   sum (p x d)_z = 0,   sum p . d = 0
  frame,
  /// Height of each lamp with its sd_m (exact without one), and horizontally only translation and
  /// yaw, exactly, and scale. sum p . d then has the standard deviation that follows from sd_m.
  heights
};

/// One capture with its detections and sensor data.
struct AdjustmentCapture {
  /// Name of the capture for messages.
  std::string name;
  std::vector<Detection> detections;
  std::optional<Inclination> inclination = {};
  /// Name of the pivot. Captures of one pivot rotate about one axis at one height; empty: the
  /// capture has a position of its own.
  std::string pivot = {};
  std::optional<KnownPosition> known_position = {};
  /// Motion of the camera; at a pivot only the yaw rate is used. Requires row time and readout
  /// direction of the camera.
  KnownMotion motion = {};
  /// Initial pose of the camera; std::nullopt: the pose of a level camera.
  std::optional<Pose> initial_pose = {};
};

/// Input of adjust_bundle().
struct AdjustmentInput {
  std::vector<AdjustmentCapture> captures;
  /// Surveyed lamps with their sd_m. A lamp with sd_m 0 is fixed.
  LampMap lamps;
  /// Lens with IntrinsicsReport::covariance (exact if absent), and initial zenith (level if
  /// absent).
  Calibration calibration;
  MapPrior map_prior = MapPrior::survey;
  /// Estimates the lever arm if captures of a pivot or positions of the axis depend on it.
  /// Otherwise it keeps its value in the calibration, or zero.
  bool estimates_lever_arm = true;
  /// Keeps the zenith of the calibration.
  bool zenith_is_exact = false;
  /// Keeps the lens of the calibration. Its errors are propagated to the result.
  bool lens_is_held = false;
  /// Set if the captures were checked separately and contain no gross outliers. Skips the robust
  /// start, which rejects all detections of a lamp whose exact position in the map is wrong.
  bool captures_are_checked = false;
  /// Gives detections without sigma_px equal weights in the undistorted image, as positioning does.
  /// Errors of map and lens then affect zenith and fixes equally. Covariances are those for equal
  /// noise in the image; they ignore the loss of efficiency by these weights.
  bool weighs_in_undistorted_image = false;
};

/// Largest standard deviations of a quantity that counts as determined.
struct AdjustmentLimits {
  /// Largest standard deviation of the zenith direction, in the direction in which it is largest.
  double zenith_rad = 0.005;
  /// Largest standard deviation of the lever arm, in the direction in which it is largest, as a
  /// fraction of the lamps' height above the camera.
  double lever_arm_fraction = 0.005;
};

/// Result of adjust_bundle().
struct AdjustmentResult {
  /// Reason why there is no result, and the captures that would determine it, human-readable. Empty
  /// if there is a result.
  std::string undetermined;

  /// Camera with the corrected intrinsics.
  Camera camera;
  /// Rotation center with model `tilt`. It has no lever arm if the captures do not determine one
  /// (AdjustmentLimits).
  RotationCenter center;
  /// Adjusted lamp map. Lamps that are not detected, or that are exact, keep their positions. sd_m
  /// is the RMS over the axes.
  LampMap refined_map;
  /// Correction of one lamp, adjusted minus surveyed position, in the world, and its standard
  /// deviation per axis.
  struct LampCorrection {
    int id;
    Eigen::Vector3d correction_m, sd_m;
    /// True if the difference between adjusted and surveyed position exceeds all uncertainties. The
    /// survey of this lamp is then ignored.
    bool is_moved;
  };
  /// Corrections of the detected lamps.
  std::vector<LampCorrection> lamps;
  /// Ids of the lamps in the joint covariance, in its order: those with a detection.
  std::vector<int> covariance_lamp_ids;
  /// Joint covariance of intrinsics, zenith, lever arm and these lamps of `refined_map`, in the
  /// units of JointCovariance, and of the surveyed map. The latter has the same estimates with the
  /// errors of the survey in the positions of the lamps. Zero for quantities taken as exact.
  Eigen::MatrixXd refined_covariance, surveyed_covariance;
  /// Covariance of the zenith's normalized point and, if there is one, the lever arm, with an exact
  /// lens if it is held.
  MatrixX center_covariance;
  /// Returns the joint covariance of intrinsics, zenith and, if there is one, the lever arm.
  MatrixX lens_and_center_covariance() const {
    const Eigen::Index size = refined_covariance.rows() - 3 * std::ssize(covariance_lamp_ids) -
                              (center.lever_arm_m ? 0 : 2);
    return refined_covariance.topLeftCorner(size, size);
  }

  /// Known position of the camera or of the axis, with its residual after the adjustment.
  struct PositionResidual {
    /// Name of the pivot, or of the first capture with this position.
    std::string name;
    MeasuredPoint measured_point;
    /// Number of captures with this position.
    int captures;
    /// Adjusted minus measured position: x, y, and z if it was measured.
    Eigen::Vector3d residual_m;
    /// True if the position contradicts the other data and is rejected.
    bool is_outlier;
  };
  std::vector<PositionResidual> known_positions;
  /// Squared correction of the lens, normalized by its covariance, over the directions that
  /// captures determine.
  double lens_chi_squared = 0;
  /// Number of directions of the lens in `lens_chi_squared`, which is its expectation.
  int lens_degrees_of_freedom = 0;
  /// True if `lens_chi_squared` exceeds its bound of one in ten thousand.
  bool lens_is_contradicted = false;

  /// Number of captures that are used, and of captures without a fix, with fewer than two lamps of
  /// the map, or without an inlier.
  int captures = 0, rejected_captures = 0;
  /// Number of detections that are used, and that are rejected.
  int detections = 0, rejected_detections = 0;
  /// Detection of a lamp of the map in a capture that has a pose.
  struct DetectionResidual {
    /// Index in AdjustmentInput::captures.
    std::size_t capture;
    int lamp;
    /// Distance from the predicted position, in px; infinite if the lens cannot project the lamp.
    double distance_px;
    /// False if the detection is an outlier.
    bool is_used;
  };
  std::vector<DetectionResidual> residuals;
  /// Mean height of the used lamps above the camera.
  double lamp_height_m = 0;
  /// RMS residual of the used detections per axis, in px: sqrt(sum of squares / degrees of
  /// freedom).
  double residual_px = 0;
  /// Degrees of freedom of the used detections: their coordinates minus the trace of the hat
  /// matrix.
  double degrees_of_freedom = 0;
  /// Factor by which sigma_px is multiplied because the residuals are larger; 1 if they are not. If
  /// no sigma_px is given, the estimated noise in px.
  double noise_scale = 1;
  /// True if residuals exceed the given noise significantly, at a probability of one in a thousand.
  bool noise_is_contradicted = false;
  /// Human-readable notes on quantities that only the survey determines: the datum, and lamps that
  /// no capture contains.
  std::vector<std::string> notes;

  bool has_succeeded() const { return undetermined.empty(); }
};

/// Returns a nominal covariance of the intrinsics, in their order, for a lens whose calibration has
/// none. An error of each intrinsic, taken alone, displaces the pixels of a grid over the image by
/// `sd_px` (RMS per axis). Errors of different intrinsics are independent.
/// @pre sd_px is positive
MatrixX make_intrinsics_covariance(const Camera& camera, double sd_px);

/// Estimates lens, zenith, lever arm and lamp map from all captures.
///
/// @pre with MapPrior::survey every lamp has its sd_m; the calibration has no adjustment
///
/// The first solutions use a Cauchy loss on detections, lamps and positions, and identify the
/// outliers. The final solution is plain least squares without outliers. A lamp counts as moved if
/// its survey contradicts all other data (test of Baarda, chi-squared with 3 degrees of freedom at
/// 1e-4). Lamps are tested one at a time, the worst first, so that the error of one lamp does not
/// spread over other lamps. The result is deterministic.
AdjustmentResult adjust_bundle(const AdjustmentInput& input, const AdjustmentLimits& limits = {});

}  // namespace vlp
