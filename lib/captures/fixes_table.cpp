// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/fixes_table.h"

#include <array>

#include "captures/csv_reader.h"
#include "captures/csv_writer.h"
#include "captures/name_index.h"
#include "rig/yaml_text.h"

namespace vlp {
namespace {

struct FixColumns {
  explicit FixColumns(const CsvTable& csv)
      : pose{csv.required("x_m"), csv.required("y_m"), csv.required("z_m"),
             csv.required("yaw_rad")},
        sd{csv.optional("sd_x_m"), csv.optional("sd_y_m"), csv.optional("sd_z_m"),
           csv.optional("sd_yaw_rad")},
        residual_px(csv.optional("residual_px")) {}

  std::array<CsvTable::Column, 4> pose;
  std::array<std::optional<CsvTable::Column>, 4> sd;
  std::optional<CsvTable::Column> residual_px;
};

std::optional<Eigen::Vector4d> sd_in(const CsvTable& csv, std::size_t row,
                                     const FixColumns& columns) {
  Eigen::Vector4d sd;
  for (int i = 0; i < 4; ++i) {
    const auto column = columns.sd[static_cast<std::size_t>(i)];
    const auto value = column ? csv.optional_number(row, *column) : std::nullopt;
    if (!value) return std::nullopt;
    if (*value < 0) throw csv.error(row, *column, "should not be negative");
    sd[i] = *value;
  }
  return sd;
}

FixRow::Fix fix_in(const CsvTable& csv, std::size_t row, const FixColumns& columns) {
  const auto [x_m, y_m, z_m, yaw_rad] = columns.pose;
  FixRow::Fix fix{
      {{csv.coordinate_m(row, x_m), csv.coordinate_m(row, y_m), csv.coordinate_m(row, z_m)},
       csv.number(row, yaw_rad)},
      sd_in(csv, row, columns),
      0};
  if (columns.residual_px) {
    fix.residual_px = csv.optional_number(row, *columns.residual_px).value_or(0);
  }
  return fix;
}

}  // namespace

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

std::vector<FixRow> read_fixes(const std::filesystem::path& file) {
  const CsvTable csv(file);
  const auto image = csv.required("image"), status = csv.required("status");
  const auto lamps = csv.optional("lamps");
  const FixColumns columns(csv);
  NameIndex images(csv.rows());
  std::vector<FixRow> rows;
  rows.reserve(csv.rows());
  for (std::size_t row = 0; row < csv.rows(); ++row) {
    const auto name = unique_name(csv, row, image, images);
    FixRow& read = rows.emplace_back(FixRow{std::string(name),
                                            std::string(csv.text(row, status)),
                                            {},
                                            lamps ? csv.integer(row, *lamps) : 0,
                                            csv.line(row)});
    if (read.status.empty()) throw csv.error(row, status, "is empty");
    if (utf8_length(read.status) != read.status.size()) {
      throw csv.error(row, status, "should be UTF-8");
    }
    if (read.status == "ok") read.fix = fix_in(csv, row, columns);
  }
  if (rows.empty()) throw InputError(file, "holds no fix");
  return rows;
}

}  // namespace vlp
