// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace vlp {

/// A row of `poses.csv`: position and orientation of the camera of an image in the world, the frame
/// of the lamp map. If the mounting of the camera is given, they are those of the robot.
struct PoseRow {
  std::string image;
  Eigen::Vector3d position_m;
  Eigen::Quaterniond world_from_camera;
  /// Covariance of the position (x, y, z) and of the orientation, as a small rotation r about the
  /// axes of the world: world_from_camera = exp([r]) estimate. In m and rad. std::nullopt if the
  /// pixel noise is unknown.
  std::optional<Eigen::Matrix<double, 6, 6>> covariance;
};

/// Writes `poses.csv` atomically. Throws InputError if it cannot be written.
///
/// Columns: image, x_m, y_m, z_m, qx, qy, qz, qw (quaternion world_from_camera), and the upper
/// triangle of the covariance by rows, in the order x, y, z, rx, ry, rz: cov_x_x_m2, cov_x_y_m2,
/// ..., cov_x_rx_m_rad, ..., cov_rz_rz_rad2.
void write_poses(const std::filesystem::path& file, const std::vector<PoseRow>& rows);

}  // namespace vlp
