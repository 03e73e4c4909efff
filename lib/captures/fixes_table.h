// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
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
  };
  /// Nothing unless the status is "ok".
  std::optional<Fix> fix;
  /// Lamps that the fix rests on.
  int lamps;
};

/// Writes image, status, x_m, y_m, z_m, yaw_rad, sd_x_m, sd_y_m, sd_z_m, sd_yaw_rad, lamps,
/// residual_px, whole or not at all; what there is not is left empty. Throws InputError.
void write_fixes(const std::filesystem::path& file, const std::vector<FixRow>& rows);

}  // namespace vlp
