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

/// Index of each name: a hash table with open addressing, for tables of millions of rows. It holds
/// views: the names must outlive it.
class NameIndex {
 public:
  /// Reserves memory for `max_names` names, fewer than 2^32.
  explicit NameIndex(std::size_t max_names);

  /// Adds a name with the next index, from 0. Returns false, without a change, if the name exists.
  bool insert(std::string_view name);
  /// Returns the index of a name; std::nullopt if it does not exist.
  std::optional<std::size_t> find(std::string_view name) const;

 private:
  struct Slot {
    std::uint32_t hash = 0;
    std::uint32_t next_index = 0;  // 0: free
  };
  /// Returns the slot of the name, or the free slot for it.
  std::size_t find_slot(std::string_view name, std::uint64_t hash) const;

  std::vector<Slot> slots_;
  std::vector<std::string_view> names_;
};

/// Returns the name in a cell and adds it to `names`. Throws InputError if it is empty or occurs in
/// an earlier row.
std::string_view read_unique_name(const CsvTable& csv, std::size_t row, CsvTable::Column column,
                                  NameIndex& names);

}  // namespace vlp
