// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/poses_table.h"

#include <array>

#include "captures/csv_writer.h"
#include "captures/number_text.h"

namespace vlp {

void write_poses(const std::filesystem::path& file, const std::vector<PoseRow>& rows) {
  constexpr int digits = 9, sd_digits = 6;  // nanometers; significant
  constexpr std::array<const char*, 6> names{"x", "y", "z", "rx", "ry", "rz"};
  std::vector<std::string> header{"image", "x_m", "y_m", "z_m", "qx", "qy", "qz", "qw"};
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t k = i; k < 6; ++k) {
      const char* const unit = k < 3 ? "_m2" : i < 3 ? "_m_rad" : "_rad2";
      header.push_back(std::string("cov_") + names[i] + "_" + names[k] + unit);
    }
  }
  CsvWriter csv(file, header);
  for (const PoseRow& row : rows) {
    std::vector<std::string> fields{row.image};
    for (const double value : row.position_m)
      fields.push_back(format_fixed_decimals(value, digits));
    Eigen::Vector4d quaternion = row.world_from_camera.coeffs();
    if (quaternion.w() < 0) quaternion = -quaternion;
    for (const double value : quaternion) fields.push_back(format_fixed_decimals(value, digits));
    for (int i = 0; i < 6; ++i) {
      for (int k = i; k < 6; ++k) {
        fields.push_back(row.covariance ? format_digits((*row.covariance)(i, k), sd_digits) : "");
      }
    }
    csv.write_csv_row(fields);
  }
  csv.save_file();
}

}  // namespace vlp
