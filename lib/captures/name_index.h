// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>
#include <unordered_map>

#include "captures/csv_reader.h"

namespace vlp {

/// Index of each name. It holds views: the names must outlive it.
class NameIndex {
 public:
  /// Reserves memory for `max_names` names.
  explicit NameIndex(std::size_t max_names) { indices_.reserve(max_names); }

  /// Adds a name with the next index, from 0. Returns false, without a change, if the name exists.
  bool insert(std::string_view name) { return indices_.try_emplace(name, indices_.size()).second; }
  /// Returns the index of a name; std::nullopt if it does not exist.
  std::optional<std::size_t> find(std::string_view name) const {
    const auto found = indices_.find(name);
    return found == indices_.end() ? std::nullopt : std::optional(found->second);
  }

 private:
  std::unordered_map<std::string_view, std::size_t> indices_;
};

/// Returns the name in a cell and adds it to `names`. Throws InputError if it is empty or occurs in
/// an earlier row.
std::string_view read_unique_name(const CsvTable& csv, std::size_t row, CsvTable::Column column,
                                  NameIndex& names);

}  // namespace vlp
