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

/// Along what the rolling shutter moves: the stripes of a lamp lie along it.
enum class Readout { rows, columns };

struct Camera {
  std::string id;
  /// Width and height.
  std::array<int, 2> imager_px;
  LensModel lens_model;
  /// In mrcal's order, see LensModel.
  std::vector<double> intrinsics;
  std::optional<double> pixel_pitch_m;
  /// Time from one row (or column) of the read-out to the next.
  std::optional<double> row_time_s;
  std::optional<Readout> readout;

  /// fx, fy and cx, cy, which are the first four intrinsics of every lens model.
  Eigen::Vector2d focal_px() const { return {intrinsics[0], intrinsics[1]}; }
  Eigen::Vector2d center_px() const { return {intrinsics[2], intrinsics[3]}; }
};

/// What the intrinsic calibration says of itself; without views, of a lens that another program
/// calibrated, the region alone.
struct IntrinsicsReport {
  int views;
  int corners;
  int outliers;
  /// Per axis, over the corners that are not outliers, each multiplied by its weight. By those of
  /// the solve's own it is what corners are off (CornerWeights); by those of a table of corners it
  /// is as large as they are.
  double rms_px;
  /// Deflection of the board's centre from flat, along x and y (mrcal's calobject_warp).
  std::optional<std::array<double, 2>> board_warp_m;
  /// What the largest error of a projection over the region is expected to be. Infinite where the
  /// lens has no ray; that is not written.
  std::optional<double> uncertainty_px;
  /// Of the intrinsics, in their order; of a splined lens, none or of fx, fy, cx, cy alone, as
  /// wherever errors of the intrinsics are told of below.
  std::optional<MatrixX> covariance = {};
  /// Where the lens is known, the corners of a polygon in turn; empty: all over the image.
  std::vector<Eigen::Vector2d> region_px = {};
};

/// How the rotation centre is applied (Chen and Guan, section 3.1; lib/THEORY.md, "Rotation
/// centre"): `shift` subtracts it in the undistorted plane (eq. 9), `tilt` turns every ray so that
/// the zenith becomes +Z, which is right at other places and heights, too.
enum class RotationModel { shift, tilt };

struct RotationCenter {
  RotationModel model;
  /// Where the axis of rotation meets the undistorted image: f * (x/z, y/z) + c.
  Eigen::Vector2d center_px;
  /// The direction of up, unit length.
  Eigen::Vector3d zenith_in_camera;
  /// Of center_px, in px^2.
  std::optional<Matrix2> covariance = {};
  /// From the axis of rotation to the camera, x and y in the level frame, and its covariance in
  /// m^2. Fixes are of the camera whether it is there or not. With a robot's centre on the axis and
  /// the camera's yaw on the robot zero, it is x and y of CameraMount::position_in_robot_m.
  std::optional<Eigen::Vector2d> lever_arm_m = {};
  std::optional<Matrix2> lever_arm_covariance = {};
  /// What an error of the intrinsics does to the zenith's normalized point (x/z, y/z), a column
  /// each: `covariance` is that of the captures alone, with the lens taken as exact.
  std::optional<MatrixX> by_intrinsics = {};
  /// What an error of the zenith's normalized point goes together with in the lever arm, in metres,
  /// where the same captures tell both; and what an error of the intrinsics does to it, a column
  /// each. The rest of lever_arm_covariance is its own.
  std::optional<Matrix2> lever_arm_by_zenith = {};
  std::optional<MatrixX> lever_arm_by_intrinsics = {};
};

/// The dispersion calibration (Chen and Guan, section 3.2).
struct Dispersion {
  /// What is left of the image centre's error after the rotation centre is applied, in the
  /// undistorted image of the level camera: f * (x/z, y/z) is too large by it.
  Eigen::Vector2d offset_px;
  /// Radius of the dispersion circle, and its centre: fixes minus truth, in the world, before the
  /// offset is taken off.
  double radius_m;
  Eigen::Vector2d center_m;
  int captures;
  /// Covariance of offset_px in px^2, from the captures and the lever arm, with lens, zenith and
  /// lamp map taken as exact. The lever arm's part may rest on the lamp map as well.
  std::optional<Matrix2> covariance = {};
  /// Derivatives of offset_px / f by the intrinsics and by the zenith's normalized point.
  std::optional<MatrixX> by_intrinsics = {};
  std::optional<Matrix2> by_zenith = {};
  /// A lamp whose surveyed place the offset depends on.
  struct UncertainLamp {
    int id;
    /// Place and standard deviation per axis in the map of the calibration.
    Eigen::Vector3d position_m;
    double sd_m;
    /// Derivative of offset_px / f by the place, per metre.
    Eigen::Matrix<double, 2, 3, Eigen::DontAlign> by_position;
  };
  /// Lamps of the map with an sd_m above zero that the captures show.
  std::vector<UncertainLamp> by_lamps = {};
};

/// What one adjustment of many captures (vlp-adjust) says of all that it estimated together.
struct Adjustment {
  /// The lamps, where the map that goes with the covariance has them.
  struct Place {
    int id;
    Eigen::Vector3d position_m;
  };
  std::vector<Place> lamps;
  /// Joint, of the errors of: the intrinsics; the zenith's normalized point (x/z, y/z); the lever
  /// arm, x and y in metres; x, y and z of each of the lamps. Zero where something was taken as
  /// exact.
  MatrixX covariance;
  /// The folders or tables that it rests on, without their own folders.
  std::vector<std::string> sets;
  int captures;
  int detections;
  /// Per axis, of those.
  double residual_px;
};

/// A name for each row of Adjustment::covariance: fx, fy, cx, cy, k1 ..., zenith_x, zenith_y,
/// lever_arm_x_m, lever_arm_y_m, lamp_ID_x_m ...
std::vector<std::string> parameter_names(const Camera& camera, const Adjustment& adjustment);

/// How a part came to be.
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

/// All that is known of a camera; each stage of the calibration adds a part.
struct Calibration {
  Camera camera;
  std::optional<IntrinsicsReport> intrinsics_report;
  std::optional<RotationCenter> rotation_center;
  std::optional<Dispersion> dispersion;
  std::vector<HistoryEntry> history;
  std::optional<Adjustment> adjustment = {};
};

/// Reads `vlp-calibration/1`; keys are the names of the fields above. Throws InputError: unknown
/// or missing keys, parameters that are not the lens model's, a zenith that is not a unit vector
/// or not in front of the camera, a part that the history names but the file lacks (cut short).
Calibration read_calibration(const std::filesystem::path& file);

/// Writes what read_calibration() reads, whole or not at all, and in an order in which a file cut
/// short anywhere lacks something that read_calibration() needs. Throws InputError.
void write_calibration(const std::filesystem::path& file, const Calibration& calibration);

}  // namespace vlp
