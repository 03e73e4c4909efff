// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/fixes_table.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <string_view>
#include <system_error>

#include "captures/csv_reader.h"
#include "captures/csv_writer.h"
#include "captures/number_text.h"
#include "rig/yaml_text.h"

namespace vlp {
namespace {

struct FixColumns {
  explicit FixColumns(const CsvTable& csv)
      : pose{csv.require_column("x_m"), csv.require_column("y_m"), csv.require_column("z_m"),
             csv.require_column("yaw_rad")},
        sd{csv.find_column("x_sd_m"), csv.find_column("y_sd_m"), csv.find_column("z_sd_m"),
           csv.find_column("yaw_sd_rad")},
        noise_sd{csv.find_column("x_noise_sd_m"), csv.find_column("y_noise_sd_m"),
                 csv.find_column("z_noise_sd_m"), csv.find_column("yaw_noise_sd_rad")},
        residual_px(csv.find_column("residual_px")),
        time_s(csv.find_column("time_s")),
        velocity{csv.find_column("vx_m_per_s"), csv.find_column("vy_m_per_s")},
        lean{csv.find_column("roll_rad"), csv.find_column("pitch_rad")},
        rejected(csv.find_column("rejected")),
        outside_region(csv.find_column("outside_region")) {}

  std::array<CsvTable::Column, 4> pose;
  std::array<std::optional<CsvTable::Column>, 4> sd, noise_sd;
  std::optional<CsvTable::Column> residual_px, time_s;
  std::array<std::optional<CsvTable::Column>, 2> velocity, lean;
  std::optional<CsvTable::Column> rejected, outside_region;
};

std::optional<Eigen::Vector2d> read_optional_pair(
    const CsvTable& csv, std::size_t row,
    const std::array<std::optional<CsvTable::Column>, 2>& columns) {
  const auto a = csv.get_optional_number(row, columns[0]),
             b = csv.get_optional_number(row, columns[1]);
  if (!a || !b) return std::nullopt;
  return Eigen::Vector2d(*a, *b);
}

std::optional<Eigen::Vector4d> read_sds(
    const CsvTable& csv, std::size_t row,
    const std::array<std::optional<CsvTable::Column>, 4>& columns) {
  Eigen::Vector4d sd;
  for (int i = 0; i < 4; ++i) {
    const auto column = columns[static_cast<std::size_t>(i)];
    const auto value = csv.get_optional_number(row, column);
    if (!value) return std::nullopt;
    if (*value < 0) throw csv.make_cell_error(row, *column, "should not be negative");
    sd[i] = *value;
  }
  return sd;
}

FixRow::Fix read_fix(const CsvTable& csv, std::size_t row, const FixColumns& columns) {
  const auto [x_m, y_m, z_m, yaw_rad] = columns.pose;
  FixRow::Fix fix{{{csv.get_coordinate_m(row, x_m), csv.get_coordinate_m(row, y_m),
                    csv.get_coordinate_m(row, z_m)},
                   csv.get_cell_number(row, yaw_rad)},
                  read_sds(csv, row, columns.sd),
                  csv.get_optional_number(row, columns.residual_px).value_or(0),
                  read_sds(csv, row, columns.noise_sd)};
  fix.velocity_m_per_s = read_optional_pair(csv, row, columns.velocity);
  if (const auto lean = read_optional_pair(csv, row, columns.lean))
    fix.inclination = {lean->x(), lean->y()};
  return fix;
}

/// Reads ids separated by blanks.
std::vector<int> read_id_list(const CsvTable& csv, std::size_t row, CsvTable::Column column) {
  std::vector<int> ids;
  std::string_view remaining = csv.get_cell_text(row, column);
  while (!remaining.empty()) {
    const std::string_view word = remaining.substr(0, remaining.find(' '));
    int id = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), id);
    if (error != std::errc() || end != word.data() + word.size()) {
      throw csv.make_cell_error(row, column, "should be ids of lamps, separated by blanks");
    }
    ids.push_back(id);
    remaining.remove_prefix(std::min(remaining.size(), word.size() + 1));
  }
  return ids;
}

constexpr int kDigits = 9;    // nanometers
constexpr int kSdDigits = 6;  // significant

/// A column that is written if any row has a value in it.
struct AddedColumn {
  std::string_view name;
  std::string (*text)(const FixRow&);
};

std::string format_time(const FixRow& row) {
  return row.time_s ? format_fixed_decimals(*row.time_s, kDigits) : "";
}

template <int axis>
std::string format_noise_sd(const FixRow& row) {
  if (!row.fix || !row.fix->noise_sd) return "";
  return format_digits((*row.fix->noise_sd)[axis], kSdDigits);
}

template <int axis>
std::string format_velocity(const FixRow& row) {
  if (!row.fix || !row.fix->velocity_m_per_s) return "";
  return format_fixed_decimals((*row.fix->velocity_m_per_s)[axis], kDigits);
}

template <double Inclination::*angle>
std::string format_roll_pitch(const FixRow& row) {
  if (!row.fix || !row.fix->inclination) return "";
  return format_fixed_decimals((*row.fix->inclination).*angle, kDigits);
}

template <std::vector<int> FixRow::*lamps>
std::string format_ids(const FixRow& row) {
  std::string ids;
  for (const int id : row.*lamps) {
    if (!ids.empty()) ids += ' ';
    ids += std::to_string(id);
  }
  return ids;
}

constexpr std::array<AddedColumn, 11> kAddedColumns{
    {{"time_s", format_time},
     {"x_noise_sd_m", format_noise_sd<0>},
     {"y_noise_sd_m", format_noise_sd<1>},
     {"z_noise_sd_m", format_noise_sd<2>},
     {"yaw_noise_sd_rad", format_noise_sd<3>},
     {"vx_m_per_s", format_velocity<0>},
     {"vy_m_per_s", format_velocity<1>},
     {"roll_rad", format_roll_pitch<&Inclination::roll_rad>},
     {"pitch_rad", format_roll_pitch<&Inclination::pitch_rad>},
     {"rejected", format_ids<&FixRow::rejected_lamps>},
     {"outside_region", format_ids<&FixRow::lamps_outside_region>}}};

std::vector<AddedColumn> select_used_columns(const std::vector<FixRow>& rows) {
  std::vector<AddedColumn> columns;
  for (const AddedColumn& column : kAddedColumns) {
    const bool is_used = std::any_of(rows.begin(), rows.end(),
                                     [&](const FixRow& row) { return !column.text(row).empty(); });
    if (is_used) columns.push_back(column);
  }
  return columns;
}

}  // namespace

void write_fixes(const std::filesystem::path& file, const std::vector<FixRow>& rows) {
  std::vector<std::string> header{"image",  "status",     "x_m",    "y_m",
                                  "z_m",    "yaw_rad",    "x_sd_m", "y_sd_m",
                                  "z_sd_m", "yaw_sd_rad", "lamps",  "residual_px"};
  const auto added = select_used_columns(rows);
  for (const AddedColumn& column : added) header.emplace_back(column.name);
  CsvWriter csv(file, header);
  for (const FixRow& row : rows) {
    std::vector<std::string> fields{row.image, row.status};
    fields.resize(12);
    fields[10] = std::to_string(row.lamps);
    if (const auto& fix = row.fix) {
      const Eigen::Vector3d& position_m = fix->pose.position_m;
      const std::array<double, 4> pose{position_m.x(), position_m.y(), position_m.z(),
                                       fix->pose.yaw_rad};
      for (std::size_t i = 0; i < 4; ++i) {
        fields[2 + i] = format_fixed_decimals(pose[i], kDigits);
        if (fix->sd) fields[6 + i] = format_digits((*fix->sd)[static_cast<int>(i)], kSdDigits);
      }
      fields[11] = format_digits(fix->residual_px, kSdDigits);
    }
    for (const AddedColumn& column : added) fields.push_back(column.text(row));
    csv.write_csv_row(fields);
  }
  csv.save_file();
}

std::vector<FixRow> read_fixes(const std::filesystem::path& file) {
  const CsvTable csv(file);
  const auto image = csv.require_column("image"), status = csv.require_column("status");
  const auto lamps = csv.find_column("lamps");
  const FixColumns columns(csv);
  NameIndex images(csv.num_rows());
  std::vector<FixRow> rows;
  rows.reserve(csv.num_rows());
  for (std::size_t row = 0; row < csv.num_rows(); ++row) {
    const auto name = read_unique_name(csv, row, image, images);
    FixRow& read = rows.emplace_back(FixRow{std::string(name),
                                            std::string(csv.get_cell_text(row, status)),
                                            {},
                                            lamps ? csv.get_cell_integer(row, *lamps) : 0,
                                            csv.line_number_of_row(row)});
    if (read.status.empty()) throw csv.make_cell_error(row, status, "is empty");
    if (count_utf8_prefix(read.status) != read.status.size()) {
      throw csv.make_cell_error(row, status, "should be UTF-8");
    }
    if (read.status == "ok") read.fix = read_fix(csv, row, columns);
    if (columns.rejected) read.rejected_lamps = read_id_list(csv, row, *columns.rejected);
    if (columns.outside_region)
      read.lamps_outside_region = read_id_list(csv, row, *columns.outside_region);
    read.time_s = csv.get_optional_number(row, columns.time_s);
  }
  if (rows.empty()) throw InputError(file, "contains no fix");
  return rows;
}

}  // namespace vlp
