// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "geometry/frames.h"

namespace vlp {

/// A row of `fixes.csv`.
struct FixRow {
  std::string image;
  /// Status of the fix in the file: "ok", or the reason of failure as a word, for example
  /// "too_few_lamps" (fix_status_name()).
  std::string status;
  struct Fix {
    Pose pose;
    /// Standard deviations of x, y, z in meters and of yaw in radians; std::nullopt if the pixel
    /// noise is unknown.
    std::optional<Eigen::Vector4d> sd;
    double residual_px;
    /// Part of `sd` that is independent between images; std::nullopt if the common errors are
    /// unknown.
    std::optional<Eigen::Vector4d> noise_sd = {};
    /// Velocity in the world, and roll and pitch, if they were estimated.
    std::optional<Eigen::Vector2d> velocity_m_per_s = {};
    std::optional<Inclination> inclination = {};
  };
  /// The fix; std::nullopt unless the status is "ok".
  std::optional<Fix> fix;
  /// Number of lamps used for the fix.
  int lamps;
  /// Line of the row in the file from which it was read.
  std::size_t line = 0;
  /// Ids of lamps rejected because the others contradict them.
  std::vector<int> rejected_lamps = {};
  /// Ids of used lamps that are outside the calibrated region, IntrinsicsReport::region_px.
  std::vector<int> lamps_outside_region = {};
  /// Time of the capture, if known.
  std::optional<double> time_s = {};
};

/// Writes `fixes.csv` atomically. Missing values are empty fields. Throws InputError if it cannot
/// be written.
///
/// Columns: image, status, x_m, y_m, z_m, yaw_rad, x_sd_m, y_sd_m, z_sd_m, yaw_sd_rad, lamps,
/// residual_px. Further columns, if any row has a value: time_s, x_noise_sd_m, y_noise_sd_m,
/// z_noise_sd_m, yaw_noise_sd_rad, vx_m_per_s, vy_m_per_s, roll_rad, pitch_rad, rejected and
/// outside_region (ids, separated by blanks).
void write_fixes(const std::filesystem::path& file, const std::vector<FixRow>& rows);

/// Reads the files of write_fixes(). Only image, status, x_m, y_m, z_m and yaw_rad are required.
/// Standard deviations are ignored unless all four are given. Values of a fix are ignored unless
/// the status is "ok".
/// @throws InputError as CsvTable; if an image or a status is empty, or a status is not UTF-8; if
/// an image occurs twice; if a value of a fix is not finite or exceeds kMaxCoordinate_m; if a
/// standard deviation is negative; if lamps are not ids; if there are no rows
std::vector<FixRow> read_fixes(const std::filesystem::path& file);

}  // namespace vlp
