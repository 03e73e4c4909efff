// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/fixes_table.h"

#include <algorithm>
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
        noise_sd{csv.optional("noise_sd_x_m"), csv.optional("noise_sd_y_m"),
                 csv.optional("noise_sd_z_m"), csv.optional("noise_sd_yaw_rad")},
        residual_px(csv.optional("residual_px")) {}

  std::array<CsvTable::Column, 4> pose;
  std::array<std::optional<CsvTable::Column>, 4> sd, noise_sd;
  std::optional<CsvTable::Column> residual_px;
};

std::optional<Eigen::Vector4d> sd_in(
    const CsvTable& csv, std::size_t row,
    const std::array<std::optional<CsvTable::Column>, 4>& columns) {
  Eigen::Vector4d sd;
  for (int i = 0; i < 4; ++i) {
    const auto column = columns[static_cast<std::size_t>(i)];
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
      sd_in(csv, row, columns.sd),
      0,
      sd_in(csv, row, columns.noise_sd)};
  if (columns.residual_px) {
    fix.residual_px = csv.optional_number(row, *columns.residual_px).value_or(0);
  }
  return fix;
}

}  // namespace

void write_fixes(const std::filesystem::path& file, const std::vector<FixRow>& rows) {
  constexpr int digits = 9;     // nanometres
  constexpr int sd_digits = 6;  // significant
  std::vector<std::string> header{"image",  "status",     "x_m",    "y_m",
                                  "z_m",    "yaw_rad",    "sd_x_m", "sd_y_m",
                                  "sd_z_m", "sd_yaw_rad", "lamps",  "residual_px"};
  const bool noise = std::any_of(rows.begin(), rows.end(), [](const FixRow& row) {
    return row.fix && row.fix->noise_sd.has_value();
  });
  const bool rejected = std::any_of(rows.begin(), rows.end(),
                                    [](const FixRow& row) { return !row.rejected.empty(); });
  if (noise) {
    header.insert(header.end(),
                  {"noise_sd_x_m", "noise_sd_y_m", "noise_sd_z_m", "noise_sd_yaw_rad"});
  }
  if (rejected) header.emplace_back("rejected");
  CsvWriter csv(file, header);
  const auto add_sd = [](std::vector<std::string>& fields,
                         const std::optional<Eigen::Vector4d>& sd) {
    for (int i = 0; i < 4; ++i) {
      fields.push_back(sd ? significant((*sd)[i], sd_digits) : std::string());
    }
  };
  for (const FixRow& row : rows) {
    std::vector<std::string> fields{row.image, row.status};
    if (row.fix) {
      const Pose& pose = row.fix->pose;
      for (const double x_m : pose.position_m) fields.push_back(fixed(x_m, digits));
      fields.push_back(fixed(pose.yaw_rad, digits));
    } else {
      fields.resize(6);
    }
    add_sd(fields, row.fix ? row.fix->sd : std::nullopt);
    fields.push_back(std::to_string(row.lamps));
    fields.push_back(row.fix ? significant(row.fix->residual_px, sd_digits) : std::string());
    if (noise) add_sd(fields, row.fix ? row.fix->noise_sd : std::nullopt);
    if (rejected) {
      std::string ids;
      for (const int id : row.rejected) {
        if (!ids.empty()) ids += ' ';
        ids += std::to_string(id);
      }
      fields.push_back(std::move(ids));
    }
    csv.row(fields);
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
