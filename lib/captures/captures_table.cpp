// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/captures_table.h"

#include "captures/csv_reader.h"

namespace vlp {

CapturesTable read_captures(const std::filesystem::path& file) {
  const CsvTable csv(file);
  const auto image = csv.required("image");
  const auto roll = csv.optional("roll_rad"), pitch = csv.optional("pitch_rad");
  const auto place = csv.optional("place"), place_sd = csv.optional("place_sd_m"),
             spot = csv.optional("spot");
  CapturesTable table;
  for (std::size_t row = 0; row < csv.rows(); ++row) {
    const auto field = [&](std::optional<CsvTable::Column> column) {
      return column ? csv.optional_number(row, *column) : std::nullopt;
    };
    Capture capture;
    capture.time_s = field(csv.optional("time_s"));
    capture.x_m = field(csv.optional("x_m"));
    capture.y_m = field(csv.optional("y_m"));
    capture.z_m = field(csv.optional("z_m"));
    capture.yaw_rad = field(csv.optional("yaw_rad"));
    if (place && !csv.text(row, *place).empty()) {
      const std::string_view whose = csv.text(row, *place);
      if (whose != "camera" && whose != "axis") {
        throw csv.error(row, *place, "should be camera or axis: whose place it is");
      }
      capture.place = whose == "axis" ? PlaceOf::axis : PlaceOf::camera;
    }
    capture.place_sd_m = field(place_sd);
    if (capture.place_sd_m && *capture.place_sd_m < 0) {
      throw csv.error(row, *place_sd, "should not be negative");
    }
    if (spot) capture.spot = csv.text(row, *spot);
    const auto roll_rad = field(roll), pitch_rad = field(pitch);
    if (roll_rad.has_value() != pitch_rad.has_value()) {
      throw csv.error(row, image, "has one of roll_rad and pitch_rad without the other");
    }
    if (roll_rad) capture.inclination = Inclination{*roll_rad, *pitch_rad};
    const std::string name(csv.text(row, image));
    if (name.empty()) throw csv.error(row, image, "is empty");
    if (!table.emplace(name, capture).second) {
      throw csv.error(row, image, "'" + name + "' stands twice");
    }
  }
  return table;
}

}  // namespace vlp
