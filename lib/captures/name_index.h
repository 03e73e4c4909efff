// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "captures/csv_reader.h"

namespace vlp {

/// Where names stand: a hash table with open addressing, for tables of millions of rows. It holds
/// views: the names outlive it.
class NameIndex {
 public:
  /// For so many names, fewer than 2^32.
  explicit NameIndex(std::size_t most);

  /// Puts a name at the next place, from 0; false, and nothing is done, when it is there.
  bool insert(std::string_view name);
  /// The place of a name.
  std::optional<std::size_t> find(std::string_view name) const;

 private:
  struct Slot {
    std::uint32_t hash = 0;
    std::uint32_t next_place = 0;  // 0: free
  };
  /// The slot of the name, or the one that it would be in.
  std::size_t slot_of(std::string_view name, std::uint64_t hash) const;

  std::vector<Slot> slots_;
  std::vector<std::string_view> names_;
};

/// The name in a cell, put into `names`. Throws InputError when it is empty or stands in a row
/// before.
std::string_view unique_name(const CsvTable& csv, std::size_t row, CsvTable::Column column,
                             NameIndex& names);

}  // namespace vlp
