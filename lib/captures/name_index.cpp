// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/name_index.h"

#include <bit>
#include <functional>

namespace vlp {
namespace {

std::uint64_t compute_hash(std::string_view name) { return std::hash<std::string_view>()(name); }

/// Returns the bits of the hash that do not select the slot.
std::uint32_t upper(std::uint64_t hash) { return static_cast<std::uint32_t>(hash >> 32); }

}  // namespace

NameIndex::NameIndex(std::size_t max_names) : slots_(std::bit_ceil(2 * max_names + 1)) {
  names_.reserve(max_names);
}

std::size_t NameIndex::find_slot(std::string_view name, std::uint64_t hash) const {
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = hash & mask;
  for (; slots_[slot].next_index != 0; slot = (slot + 1) & mask) {
    const Slot& taken = slots_[slot];
    if (taken.hash == upper(hash) && names_[taken.next_index - 1] == name) break;
  }
  return slot;
}

bool NameIndex::insert(std::string_view name) {
  const std::uint64_t hash = compute_hash(name);
  Slot& slot = slots_[find_slot(name, hash)];
  if (slot.next_index != 0) return false;
  names_.push_back(name);
  slot = {upper(hash), static_cast<std::uint32_t>(names_.size())};
  return true;
}

std::optional<std::size_t> NameIndex::find(std::string_view name) const {
  const Slot& slot = slots_[find_slot(name, compute_hash(name))];
  if (slot.next_index == 0) return std::nullopt;
  return slot.next_index - 1;
}

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
