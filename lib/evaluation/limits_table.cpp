// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/limits_table.h"

#include <string>
#include <vector>

#include "captures/csv_writer.h"
#include "captures/number_text.h"
#include "evaluation/errors/floor_limits.h"

namespace vlp {

void write_floor_limits(const std::filesystem::path& file, const FloorLimits& limits) {
  constexpr int digits = 6;
  std::vector<std::string> header{"x_m",    "y_m",    "z_m",    "yaw_rad",   "lamps",
                                  "x_sd_m", "y_sd_m", "z_sd_m", "yaw_sd_rad"};
  for (const auto& [name, key] : limits.sources) header.push_back(std::string(key) + "_m");
  header.emplace_back("horizontal_m");
  CsvWriter csv(file, header);
  const auto format = [](double value) { return format_digits(value, digits); };
  for (const FloorLimits::Position& place : limits.positions) {
    const auto& [position_m, yaw_rad] = place.camera;
    std::vector<std::string> row{format(position_m.x()), format(position_m.y()),
                                 format(position_m.z()), format(yaw_rad),
                                 std::to_string(place.lamps)};
    if (!place.covariances.empty()) {
      const Eigen::Vector4d sd = place.total_pose_covariance().diagonal().cwiseMax(0).cwiseSqrt();
      for (const double sd_component : sd) row.push_back(format(sd_component));
      for (const Matrix4& part : place.covariances)
        row.push_back(format(compute_fix_sds(part).horizontal_m));
      row.push_back(format(compute_fix_sds(place.total_pose_covariance()).horizontal_m));
    }
    row.resize(header.size());
    csv.write_csv_row(row);
  }
  csv.save_file();
}

}  // namespace vlp
