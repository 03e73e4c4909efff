// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/truth_table.h"

#include "captures/csv_reader.h"
#include "captures/name_index.h"

namespace vlp {

std::vector<TruthRow> read_truth(const std::filesystem::path& file) {
  const CsvTable csv(file);
  const auto image = csv.required("image");
  const auto x_m = csv.required("x_m"), y_m = csv.required("y_m");
  const auto z_m = csv.optional("z_m"), yaw_rad = csv.optional("yaw_rad");
  NameIndex images(csv.rows());
  std::vector<TruthRow> rows;
  rows.reserve(csv.rows());
  for (std::size_t row = 0; row < csv.rows(); ++row) {
    const auto name = read_unique_name(csv, row, image, images);
    TruthRow& read = rows.emplace_back();
    read.image = name;
    read.xy_m = {csv.coordinate_m(row, x_m), csv.coordinate_m(row, y_m)};
    if (z_m && !csv.text(row, *z_m).empty()) read.z_m = csv.coordinate_m(row, *z_m);
    if (yaw_rad) read.yaw_rad = csv.optional_number(row, *yaw_rad);
    read.line = csv.line(row);
  }
  if (rows.empty()) throw InputError(file, "holds no place");
  return rows;
}

}  // namespace vlp
