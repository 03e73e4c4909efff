// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "captures/captures_table.h"
#include "positioning/positioner.h"
#include "rig/calibration.h"
#include "rig/detection.h"
#include "rig/lamp_map.h"

/// One adjustment of all that captures share: least squares over every capture at once. A capture k
/// whose camera stands at S with yaw g sees lamp P at
///   project(camera_from_level(zenith) (Rz(-g) (P - S)); intrinsics),
/// and where it turns on a spot about the axis A, S = A + Rz(g) e. Of a camera that drives with u
/// and turns with w a lamp that is read at t after the middle of the image is where, in place of
/// Rz(-g) (P - S), there is Rz(-w t) (Rz(-g) (P - S) - u t); on a spot it turns, too.
///   unknown  zenith, lever arm e, the lamps' places, the lens as far as its covariance lets it,
///            an axis A a spot, and a pose (on a spot: a yaw) a capture, with u and w where they
///            are not known exactly;
///   known    the lamps' centres with their sigma_px, the survey of the lamps with its sd_m, the
///            lens with its covariance, places of the camera or of the axis with their sd.
namespace vlp {

/// A place as somebody measured it.
struct KnownPlace {
  PlaceOf of;
  Eigen::Vector2d xy_m;
  std::optional<double> z_m;
  /// Of each coordinate, positive. What was measured once counts once: the captures of one spot, or
  /// of one and the same place, have the error in common.
  double sd_m;
};

struct AdjustmentCapture {
  /// For messages.
  std::string name;
  std::vector<Detection> detections;
  std::optional<Inclination> inclination = {};
  /// Captures of one name turn about one axis at one height; empty: the capture stands by itself.
  std::string spot = {};
  std::optional<KnownPlace> place = {};
  /// Of the camera; on a spot the yaw rate alone. Wants the camera's row time and read-out.
  KnownMotion motion = {};
};

struct AdjustmentInput {
  std::vector<AdjustmentCapture> captures;
  /// Each with its sd_m; one with 0 stays where it is.
  LampMap lamps;
  /// Lens (IntrinsicsReport::covariance; without one it is exact) and where to start: the zenith,
  /// or a level camera.
  Calibration calibration;
  /// Estimates the shape of the map whatever its sd_m. Captures do not determine its translation,
  /// yaw and scale, which stay: the corrections d of the lamps seen, at p from their mean, have
  ///   sum d = 0,   sum (p x d)_z = 0,   sum p . d = 0.
  /// AdjustmentResult::surveyed_covariance is then not defined.
  bool frees_map_shape = false;
  /// Captures were checked one by one and have no gross outliers. Skips the robust start, which
  /// rejects all detections of a lamp whose exact place in the map is wrong.
  bool captures_are_checked = false;
  /// Weighs detections without sigma_px alike in the undistorted image, as positioning does, so
  /// that errors of map and lens move zenith and fixes alike. Covariances are for equal noise in
  /// the image, without the loss of efficiency by these weights.
  bool weighs_in_undistorted_image = false;
};

/// Standard deviations beyond which something counts as not determined.
struct AdjustmentLimits {
  double zenith_rad = 0.005;
  /// Of the lamps' height above the camera.
  double lever_arm_share = 0.005;
};

struct AdjustmentResult {
  /// Why there is no answer, and what capture would determine it; empty when there is one.
  std::string undetermined;

  /// With the corrected lens.
  Camera camera;
  /// Model `tilt`. Without a lever arm where no spot, or not enough, tells it.
  RotationCenter center;
  /// As adjusted; lamps that are not seen, or that are exact, stay. sd_m is the rms over the axes.
  LampMap refined;
  struct LampCorrection {
    int id;
    Eigen::Vector3d correction_m, sd_m;
    /// Stands elsewhere than the survey says, by more than all that is uncertain explains: its
    /// survey counts for nothing.
    bool moved;
  };
  /// Of the lamps that are seen.
  std::vector<LampCorrection> lamps;
  /// Joint covariance (Adjustment::covariance) that goes with `refined`, and that which goes with
  /// the map as it was surveyed: the same estimates, with the survey's errors in the lamps' places.
  Eigen::MatrixXd refined_covariance, surveyed_covariance;

  struct Place {
    /// Of a spot, or of a capture that stands for all with this place.
    std::string name;
    PlaceOf of;
    int captures;
    /// Found less stated, x, y, and z where it is stated.
    Eigen::Vector3d misfit_m;
    /// Contradicts the others, and is left out.
    bool wrong;
  };
  std::vector<Place> places;
  /// Of the lens' correction: squared length over its covariance, and what is to be expected of it.
  double lens_chi_squared = 0;
  int lens_freedom = 0;
  bool lens_contradicted = false;

  /// Captures that it rests on; those of fewer than two lamps of the map or without a fix.
  int captures = 0, captures_left_out = 0;
  int detections = 0, detections_left_out = 0;
  /// Of the detections that are used, per axis, the freedom of the unknowns taken off.
  double residual_px = 0;
  /// By how much the stated sigma_px were taken larger, because the residuals are; 1 where they are
  /// not. Where none is stated, sigma_px is this many pixels.
  double noise_scale = 1;
  /// True if residuals are larger than the stated noise by more than chance, at one in a thousand.
  bool noise_is_contradicted = false;
  /// What the captures leave to the survey alone, for people: the datum, lamps that nothing sees.
  std::vector<std::string> notes;

  bool ok() const { return undetermined.empty(); }
};

/// The covariance of a lens whose calibration states none, for AdjustmentInput: an error of any of
/// its intrinsics, taken alone, moves the pixels of a grid over the image by `sd_px` (rms per
/// axis); those of different intrinsics are independent. Precondition: sd_px is positive.
MatrixX stated_lens_covariance(const Camera& camera, double sd_px);

/// Robust twice over: a loss of Cauchy on detections, lamps and places finds what is wrong, and
/// the last solution is plain least squares without it. A lamp is said to have moved when its
/// survey contradicts everything else (the test of Baarda, chi-squared of three at 1e-4); the worst
/// first, and each time anew, so that it does not spread over the others. Deterministic.
/// Preconditions: every lamp has its sd_m; the calibration has no adjustment.
AdjustmentResult adjust_captures(const AdjustmentInput& input, const AdjustmentLimits& limits = {});

}  // namespace vlp
