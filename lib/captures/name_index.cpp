// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/name_index.h"

namespace vlp {

std::string_view read_unique_name(const CsvTable& csv, std::size_t row, CsvTable::Column column,
                                  NameIndex& names) {
  const std::string_view name = csv.text(row, column);
  if (name.empty()) throw csv.error(row, column, "is empty");
  if (!names.insert(name)) {
    throw csv.error(row, column, "'" + std::string(name) + "' stands twice");
  }
  return name;
}

}  // namespace vlp
