// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "../camera/lens_model.h"
#include "../geometry/types.h"

namespace vlp {

/// Readout direction of a rolling shutter: exposes and reads rows or columns one after another.
/// Stripes of a modulated lamp are along these rows or columns.
enum class Readout { rows, columns };

/// Camera with its intrinsic calibration: size of the imager, lens, and timing of the rolling
/// shutter.
struct Camera {
  std::string id;
  /// Width and height of the image, px.
  std::array<int, 2> imager_px;
  LensModel lens_model;
  /// Parameters of the lens model in mrcal's order: fx fy cx cy, px, then the distortions
  /// (LensModel).
  std::vector<double> intrinsics;
  /// Distance between the centers of neighboring pixels on the imager.
  std::optional<double> pixel_pitch_m;
  /// Time from the readout of a row (or column) to that of the next; also called line delay.
  std::optional<double> row_time_s;
  /// Readout direction of the rolling shutter; std::nullopt if unknown.
  std::optional<Readout> readout;

  /// fx, fy and cx, cy: the first four intrinsics of every lens model.
  Eigen::Vector2d focal_px() const { return {intrinsics[0], intrinsics[1]}; }
  Eigen::Vector2d principal_point_px() const { return {intrinsics[2], intrinsics[3]}; }
};

/// Quality of the intrinsic calibration: numbers of views, used corners and outliers, residual,
/// covariance. A lens from another program has no views, and only the region is known.
struct IntrinsicsReport {
  int views;
  int corners;
  int outliers;
  /// RMS residual per axis of the corners without outliers, each multiplied by its weight. The
  /// solver normalizes its weights (CornerWeights) so that the result is the residual in px. The
  /// weights of a table of corners are used unchanged and determine the scale of the result.
  double rms_px;
  /// Deflection of the board's center from flat along x and y of the board, m (mrcal's
  /// calobject_warp); std::nullopt if it was not estimated.
  std::optional<std::array<double, 2>> board_warp_m;
  /// Expected maximum error of a projection over the region (CalibrationReport). Infinite if the
  /// lens has no ray there; infinity is not written to files.
  std::optional<double> expected_max_error_px;
  /// Covariance of the intrinsics, in their order. Splined lenses: none, or only fx, fy, cx, cy.
  /// The same applies to all derivatives with respect to the intrinsics below.
  std::optional<MatrixX> covariance = {};
  /// Polygon of the calibrated region, as its consecutive corners; empty: the entire image.
  std::vector<Eigen::Vector2d> region_px = {};
};

/// Model that applies the rotation center (Chen and Guan, section 3.1; lib/THEORY.md, "Rotation
/// center"). `shift` subtracts it in the undistorted plane (eq. 9). `tilt` rotates every ray so
/// that the zenith becomes +Z, which is valid at other positions and heights, too.
enum class RotationModel { shift, tilt };

/// Result of the calibration of tilt and axis of rotation.
struct RotationCenter {
  /// Model by which fixes apply the rotation center.
  RotationModel model;
  /// Intersection of the axis of rotation with the undistorted image, px: f * (x/z, y/z) + c for
  /// the zenith (x, y, z).
  Eigen::Vector2d center_px;
  /// Up direction in the camera frame, unit length.
  Eigen::Vector3d zenith_in_camera;
  /// Covariance of center_px in px^2, from the captures alone; std::nullopt if unknown.
  std::optional<Matrix2> covariance = {};
  /// Vector from the axis of rotation to the camera, x and y in the level frame, and its covariance
  /// in m^2. Fixes are of the camera with or without it. If the robot's center is on the axis and
  /// the camera's yaw on the robot is zero, it equals x and y of CameraMount::position_in_robot_m.
  std::optional<Eigen::Vector2d> lever_arm_m = {};
  std::optional<Matrix2> lever_arm_covariance = {};
  /// Derivative of the zenith's normalized point (x/z, y/z) with respect to the intrinsics, one
  /// column each. `covariance` is from the captures alone, with the lens taken as exact.
  std::optional<MatrixX> jacobian_wrt_intrinsics = {};
  /// Regression of the lever arm, in m, on the error of the zenith's normalized point, if the same
  /// captures determine both. lever_arm_jacobian_wrt_intrinsics: derivative of the lever arm, m,
  /// with respect to the intrinsics, one column each. The remainder of lever_arm_covariance is
  /// independent of both.
  std::optional<Matrix2> lever_arm_jacobian_wrt_zenith = {};
  std::optional<MatrixX> lever_arm_jacobian_wrt_intrinsics = {};
};

/// Result of the dispersion calibration (Chen and Guan, section 3.2): remaining error of fixes that
/// rotates with the camera.
struct Dispersion {
  /// Residual error of the principal point after the rotation center is applied. f * (x/z, y/z) in
  /// the undistorted image of the level camera is too large by this offset.
  Eigen::Vector2d offset_px;
  /// Radius and center of the dispersion circle: position errors (fix minus ground truth) in the
  /// world, before the offset is subtracted.
  double radius_m;
  Eigen::Vector2d center_m;
  int captures;
  /// Covariance of offset_px in px^2 from captures and lever arm, with lens, zenith and lamp map
  /// taken as exact. The contribution of the lever arm may depend on the lamp map.
  std::optional<Matrix2> covariance = {};
  /// Derivatives of offset_px / f with respect to the intrinsics and to the zenith's normalized
  /// point.
  std::optional<MatrixX> jacobian_wrt_intrinsics = {};
  std::optional<Matrix2> jacobian_wrt_zenith = {};
  /// Lamp whose surveyed position affects the offset, with the derivative.
  struct UncertainLamp {
    int id;
    /// Position and standard deviation per axis in the map of the calibration.
    Eigen::Vector3d position_m;
    double sd_m;
    /// Derivative of offset_px / f with respect to the position, per meter.
    Eigen::Matrix<double, 2, 3, Eigen::DontAlign> jacobian_wrt_position;
  };
  /// Lamps of the map with a positive sd_m that appear in the captures.
  std::vector<UncertainLamp> uncertain_lamps = {};
};

/// Result of one joint adjustment of many captures (vlp-adjust).
struct Adjustment {
  /// Position of a lamp in the map that belongs to the covariance.
  struct AdjustedLamp {
    int id;
    Eigen::Vector3d position_m;
  };
  std::vector<AdjustedLamp> lamps;
  /// Joint covariance of: intrinsics; the zenith's normalized point (x/z, y/z); the lever arm, x
  /// and y in meters; x, y and z of each lamp. Zero for quantities taken as exact.
  MatrixX covariance;
  /// Names of the folders or tables of the input data, without the path.
  std::vector<std::string> sets;
  int captures;
  int detections;
  /// RMS residual of the detections per image axis.
  double residual_px;
};

/// Returns a name for each row of Adjustment::covariance: fx, fy, cx, cy, k1 ..., zenith_x,
/// zenith_y, lever_arm_x_m, lever_arm_y_m, lamp_ID_x_m ...
std::vector<std::string> list_adjustment_parameter_names(const Camera& camera,
                                                         const Adjustment& adjustment);

/// Provenance of a part of a calibration: program, options and digests of the input files.
struct HistoryEntry {
  /// Key of the part: "camera", "rotation_center", "dispersion", "adjustment".
  std::string part;
  std::string program;
  std::string version;
  std::string options;
  struct Input {
    std::string file;
    std::string sha256;
  };
  std::vector<Input> inputs;
};

/// Calibration of a camera: content of calibration.yaml. Each calibration step adds or replaces a
/// part; missing parts are std::nullopt.
struct Calibration {
  Camera camera;
  std::optional<IntrinsicsReport> intrinsics_report;
  std::optional<RotationCenter> rotation_center;
  std::optional<Dispersion> dispersion;
  std::vector<HistoryEntry> history;
  std::optional<Adjustment> adjustment = {};
};

/// Reads `vlp-calibration/1`; keys are the names of the fields above.
/// @throws InputError if a key is unknown or missing; if the parameters do not match the lens
///     model; if the zenith is no unit vector or is not in front of the camera; if a part in the
///     history is missing (truncated file)
Calibration read_calibration(const std::filesystem::path& file);

/// Writes a file for read_calibration(), atomically. The order of the keys ensures that
/// read_calibration() rejects a truncated file. Throws InputError if it cannot be written.
void write_calibration(const std::filesystem::path& file, const Calibration& calibration);

}  // namespace vlp
