// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/fixes_table.h"

#include "captures/csv_writer.h"

namespace vlp {

void write_fixes(const std::filesystem::path& file, const std::vector<FixRow>& rows) {
  constexpr int digits = 9;     // nanometres
  constexpr int sd_digits = 6;  // significant
  CsvWriter csv(file, {"image", "status", "x_m", "y_m", "z_m", "yaw_rad", "sd_x_m", "sd_y_m",
                       "sd_z_m", "sd_yaw_rad", "lamps", "residual_px"});
  for (const FixRow& row : rows) {
    const std::string lamps = std::to_string(row.lamps);
    if (!row.fix) {
      csv.row({row.image, row.status, "", "", "", "", "", "", "", "", lamps, ""});
      continue;
    }
    const auto& [pose, sd, residual_px] = *row.fix;
    const auto sd_field = [&sd = sd](int i) {
      return sd ? significant((*sd)[i], sd_digits) : std::string();
    };
    csv.row({row.image, row.status, fixed(pose.position_m.x(), digits),
             fixed(pose.position_m.y(), digits), fixed(pose.position_m.z(), digits),
             fixed(pose.yaw_rad, digits), sd_field(0), sd_field(1), sd_field(2), sd_field(3), lamps,
             significant(residual_px, sd_digits)});
  }
  csv.save();
}

}  // namespace vlp
