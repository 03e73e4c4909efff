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
  /// "ok", or the reason why there is no fix.
  std::string status;
  struct Fix {
    Pose pose;
    /// Standard deviations of x, y, z in metres and of the yaw in radians; nothing when the noise
    /// of the pixels is not known.
    std::optional<Eigen::Vector4d> sd;
    double residual_px;
    /// The part of sd that is of this image alone; nothing when nothing else is known.
    std::optional<Eigen::Vector4d> noise_sd = {};
    /// In the world, where it moves, and the lean, where it was estimated.
    std::optional<Eigen::Vector2d> velocity_m_per_s = {};
    std::optional<Inclination> inclination = {};
  };
  /// Nothing unless the status is "ok".
  std::optional<Fix> fix;
  /// Lamps that the fix rests on.
  int lamps;
  /// Where the row stands in the file that it was read from.
  std::size_t line = 0;
  /// Ids of lamps that were left out because the others contradict them.
  std::vector<int> rejected = {};
  /// Ids of lamps that it rests on where the lens is not known, IntrinsicsReport::region_px.
  std::vector<int> outside_region = {};
  /// When the capture was taken, where it is known.
  std::optional<double> time_s = {};
};

/// Writes image, status, x_m, y_m, z_m, yaw_rad, sd_x_m, sd_y_m, sd_z_m, sd_yaw_rad, lamps,
/// residual_px, and then, where a row has them, time_s, noise_sd_x_m, noise_sd_y_m, noise_sd_z_m,
/// noise_sd_yaw_rad, vx_m_per_s, vy_m_per_s, roll_rad, pitch_rad, rejected and outside_region (ids,
/// separated by blanks), whole or not at all; what there is not is left empty. Throws InputError.
void write_fixes(const std::filesystem::path& file, const std::vector<FixRow>& rows);

/// Reads what write_fixes() writes. Only image, status, x_m, y_m, z_m and yaw_rad are needed; an sd
/// that is not there for all four is none; where the status is not "ok", the figures are not
/// looked at. Throws InputError: see CsvTable; an image or a status that is empty; an image twice;
/// a fix whose figures are not finite or further off than kFarthest_m, or an sd that is negative;
/// lamps that are no ids; no rows.
std::vector<FixRow> read_fixes(const std::filesystem::path& file);

}  // namespace vlp
