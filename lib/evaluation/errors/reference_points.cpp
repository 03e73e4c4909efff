// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/errors/reference_points.h"

#include <bit>
#include <cmath>
#include <cstdint>

#include "evaluation/errors/split_mix.h"

namespace vlp {
namespace {

using Cell = Eigen::Array3d;  // whole numbers

/// First positions of the reference points by the cell of a cubic grid: a hash table with open
/// addressing. Its time is dominated by memory latency.
class StationTable {
 public:
  StationTable(std::size_t max_stations, double radius_m)
      : radius_m_(radius_m), cell_m_(4 * radius_m), slots_(std::bit_ceil(2 * max_stations + 1)) {}

  /// Prefetches the memory that find() will access.
  void prefetch(const Eigen::Vector3d& place_m) const {
    for_each_cell_near(place_m,
                       [&](std::uint64_t hash) { __builtin_prefetch(&slots_[slot_index(hash)]); });
  }

  /// Returns the first station within the radius; firsts_m.size() if there is none.
  std::size_t find(const Eigen::Vector3d& place_m,
                   const std::vector<Eigen::Vector3d>& firsts_m) const {
    std::size_t found = firsts_m.size();
    for_each_cell_near(place_m, [&](std::uint64_t hash) {
      for (std::size_t at = slot_index(hash); slots_[at].next_station != 0; at = next(at)) {
        const std::size_t station = slots_[at].next_station - 1;
        if (slots_[at].hash == upper(hash) && station < found &&
            (firsts_m[station] - place_m).norm() <= radius_m_) {
          found = station;
        }
      }
    });
    return found;
  }

  void insert(const Eigen::Vector3d& place_m, std::size_t station) {
    const std::uint64_t hash = hash_cell((place_m.array() / cell_m_).floor());
    std::size_t at = slot_index(hash);
    while (slots_[at].next_station != 0) at = next(at);
    slots_[at] = {upper(hash), static_cast<std::uint32_t>(station + 1)};
  }

 private:
  struct Slot {
    std::uint32_t hash = 0;
    std::uint32_t next_station = 0;  // 0: free
  };

  /// Calls `action` with the hash of each cell near a position. The ball around a position covers
  /// one or two cells along each axis.
  template <typename Action>
  void for_each_cell_near(const Eigen::Vector3d& place_m, const Action& action) const {
    const Cell low = ((place_m.array() - radius_m_) / cell_m_).floor();
    const Cell more = ((place_m.array() + radius_m_) / cell_m_).floor() - low;
    for (int corner = 0; corner < 8; ++corner) {
      const Cell step(corner & 1, (corner >> 1) & 1, corner >> 2);
      if ((step <= more).all()) action(hash_cell(low + step));
    }
  }

  static std::uint64_t hash_cell(const Cell& cell) {
    std::uint64_t hash = 0;
    for (const double number : cell) {
      // + 0.0 turns a negative zero, which has other bits, into a positive one.
      hash = mix(hash ^ std::bit_cast<std::uint64_t>(number + 0.0));
    }
    return hash;
  }
  /// Returns the bits of the hash that do not select the slot.
  static std::uint32_t upper(std::uint64_t hash) { return static_cast<std::uint32_t>(hash >> 32); }
  std::size_t slot_index(std::uint64_t hash) const { return hash & (slots_.size() - 1); }
  std::size_t next(std::size_t slot) const { return (slot + 1) & (slots_.size() - 1); }

  double radius_m_, cell_m_;
  std::vector<Slot> slots_;
};

}  // namespace

std::vector<std::size_t> assign_reference_points(std::span<const Eigen::Vector3d> places_m,
                                                 double radius_m) {
  StationTable table(places_m.size(), radius_m);
  std::vector<Eigen::Vector3d> firsts_m;
  std::vector<std::size_t> stations;
  stations.reserve(places_m.size());
  for (std::size_t i = 0; i < places_m.size(); ++i) {
    constexpr std::size_t ahead = 8;
    if (i + ahead < places_m.size()) table.prefetch(places_m[i + ahead]);
    const Eigen::Vector3d& place_m = places_m[i];
    const std::size_t station = table.find(place_m, firsts_m);
    if (station == firsts_m.size()) {
      table.insert(place_m, station);
      firsts_m.push_back(place_m);
    }
    stations.push_back(station);
  }
  return stations;
}

}  // namespace vlp
