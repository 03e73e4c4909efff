// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <filesystem>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
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
  /// Vector from the axis of rotation to the camera, x and y in the level frame. Fixes are of the
  /// camera with or without it. If the robot's center is on the axis and the camera's yaw on the
  /// robot is zero, it equals x and y of CameraMount::position_in_robot_m.
  std::optional<Eigen::Vector2d> lever_arm_m = {};
};

/// Result of the dispersion calibration (Chen and Guan, section 3.2): remaining error of fixes that
/// rotates with the camera.
struct Dispersion {
  /// Residual error of the principal point after the rotation center is applied. f * (x/z, y/z) in
  /// the undistorted image of the level camera is too large by this offset at its center; how it
  /// is corrected: positioning/correction.h.
  Eigen::Vector2d offset_px;
  /// Radius and center of the dispersion circle: position errors (fix minus ground truth) in the
  /// world, before the offset is corrected.
  double radius_m;
  Eigen::Vector2d center_m;
  int captures;
};

/// Origin of the results of one joint adjustment of many captures (vlp-adjust).
struct Adjustment {
  /// Names of the folders or tables of the input data, without the path.
  std::vector<std::string> sets;
  int captures;
  int detections;
  /// RMS residual of the detections per image axis.
  double residual_px;
};

/// Names of the first of two parameters of JointCovariance: the zenith's normalized point (x/z,
/// y/z); the lever arm, m; Dispersion::offset_px divided by the focal lengths. The second name has
/// y in place of x.
inline constexpr std::string_view kZenithParameter = "zenith_x",
                                  kLeverArmParameter = "lever_arm_x_m",
                                  kOffsetParameter = "offset_x";

/// Joint covariance of the results of all calibration steps.
struct JointCovariance {
  /// Position of a lamp in the map that belongs to the covariance.
  struct LampPosition {
    int id;
    Eigen::Vector3d position_m;
  };
  /// Lamps whose positions are among the parameters, in their order.
  std::vector<LampPosition> lamps;
  /// Name of each row: fx, fy, cx, cy, k1 ... if the errors of the lens are known, then as far as
  /// they are known zenith_x, zenith_y, lever_arm_x_m, lever_arm_y_m, lamp_ID_x_m ..., offset_x,
  /// offset_y.
  std::vector<std::string> parameters;
  /// Covariance of the parameters in their order. That of the lens equals
  /// IntrinsicsReport::covariance. It is zero for quantities taken as exact.
  MatrixX matrix;

  /// Returns the row of a parameter; std::nullopt if its error is unknown.
  std::optional<Eigen::Index> find_row(std::string_view parameter) const {
    const auto found = std::find(parameters.begin(), parameters.end(), parameter);
    return found == parameters.end() ? std::nullopt : std::optional(found - parameters.begin());
  }
  /// Returns the row of the x of a lamp, by its id and its position to 1 um; std::nullopt if it is
  /// not among the parameters.
  std::optional<Eigen::Index> find_lamp_row(int id, const Eigen::Vector3d& position_m) const {
    constexpr double tolerance_m = 1e-6;
    const auto lamp = std::find_if(lamps.begin(), lamps.end(), [&](const LampPosition& one) {
      return one.id == id && (one.position_m - position_m).norm() < tolerance_m;
    });
    if (lamp == lamps.end()) return std::nullopt;
    return first_lamp_row() + 3 * (lamp - lamps.begin());
  }
  /// Returns the row of the first lamp's x; those of the other lamps follow.
  Eigen::Index first_lamp_row() const {
    return std::ssize(parameters) - 3 * std::ssize(lamps) - (find_row(kOffsetParameter) ? 2 : 0);
  }
};

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
  /// std::nullopt if no step states the errors of its results.
  std::optional<JointCovariance> covariance = {};
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
