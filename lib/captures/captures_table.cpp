// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/captures_table.h"

#include "captures/csv_reader.h"
#include "captures/csv_writer.h"
#include "captures/number_text.h"

namespace vlp {
namespace {

/// Reads two fields, both of which are given or empty.
struct Pair {
  std::string_view first_name, second_name;
  std::optional<CsvTable::Column> first, second;

  Pair(const CsvTable& csv, std::string_view name, std::string_view other)
      : first_name(name),
        second_name(other),
        first(csv.find_column(name)),
        second(csv.find_column(other)) {}

  std::optional<Eigen::Vector2d> read(const CsvTable& csv, std::size_t row,
                                      CsvTable::Column image) const {
    const auto a = csv.get_optional_number(row, first), b = csv.get_optional_number(row, second);
    if (a.has_value() != b.has_value()) {
      std::string problem("has one of ");
      problem.append(first_name).append(" and ").append(second_name);
      throw csv.make_cell_error(row, image, problem.append(" without the other"));
    }
    if (!a) return std::nullopt;
    return Eigen::Vector2d(*a, *b);
  }
};

}  // namespace

CapturesTable read_captures_csv(const std::filesystem::path& file) {
  const CsvTable csv(file);
  const auto image = csv.require_column("image");
  const auto place = csv.find_column("reference_point"),
             place_sd = csv.find_column("position_sd_m"), spot = csv.find_column("pivot");
  const Pair lean(csv, "roll_rad", "pitch_rad"), velocity(csv, "vx_m_per_s", "vy_m_per_s");
  const auto velocity_sd = csv.find_column("velocity_sd_m_per_s");
  CapturesTable table;
  for (std::size_t row = 0; row < csv.num_rows(); ++row) {
    const auto field = [&](std::optional<CsvTable::Column> column) {
      return csv.get_optional_number(row, column);
    };
    Capture capture;
    capture.time_s = field(csv.find_column("time_s"));
    capture.x_m = field(csv.find_column("x_m"));
    capture.y_m = field(csv.find_column("y_m"));
    capture.z_m = field(csv.find_column("z_m"));
    capture.yaw_rad = field(csv.find_column("yaw_rad"));
    if (place && !csv.get_cell_text(row, *place).empty()) {
      const std::string_view whose = csv.get_cell_text(row, *place);
      if (whose != "camera" && whose != "axis") {
        throw csv.make_cell_error(row, *place,
                                  "should be camera or axis: the point whose position is given");
      }
      capture.measured_point = whose == "axis" ? MeasuredPoint::axis : MeasuredPoint::camera;
    }
    capture.position_sd_m = field(place_sd);
    if (capture.position_sd_m && *capture.position_sd_m < 0) {
      throw csv.make_cell_error(row, *place_sd, "should not be negative");
    }
    if (spot) capture.pivot = csv.get_cell_text(row, *spot);
    if (const auto angles = lean.read(csv, row, image)) {
      capture.inclination = Inclination{angles->x(), angles->y()};
    }
    capture.velocity_m_per_s = velocity.read(csv, row, image);
    capture.yaw_rate_rad_per_s = field(csv.find_column("yaw_rate_rad_per_s"));
    capture.velocity_sd_m_per_s = field(velocity_sd);
    if (capture.velocity_sd_m_per_s) {
      if (*capture.velocity_sd_m_per_s < 0) {
        throw csv.make_cell_error(row, *velocity_sd, "should not be negative");
      }
      if (!capture.velocity_m_per_s) {
        throw csv.make_cell_error(row, *velocity_sd,
                                  "has no velocity: vx_m_per_s and vy_m_per_s are empty; add them");
      }
    }
    const std::string name(csv.get_cell_text(row, image));
    if (name.empty()) throw csv.make_cell_error(row, image, "is empty");
    if (!table.emplace(name, capture).second) {
      throw csv.make_cell_error(row, image, "'" + name + "' occurs twice");
    }
  }
  return table;
}

CapturesTable read_folder_captures(const std::filesystem::path& folder) {
  const auto file = folder / "captures.csv";
  return std::filesystem::exists(file) ? read_captures_csv(file) : CapturesTable{};
}

void write_capture_times(const std::filesystem::path& file,
                         const std::map<std::string, double>& times_s) {
  constexpr int digits = 6;
  CsvWriter csv(file, {"image", "time_s"});
  for (const auto& [image, time_s] : times_s)
    csv.write_csv_row({image, format_fixed_decimals(time_s, digits)});
  csv.save_file();
}

}  // namespace vlp
