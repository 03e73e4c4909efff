// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/errors/stations.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "evaluation/errors/split_mix.h"

namespace vlp {
namespace {

using Cell = Eigen::Array3d;  // whole numbers

/// The stations' first places by the cell of a cubic lattice that they are in: a hash table with
/// open addressing.
class StationTable {
 public:
  StationTable(std::size_t most, double radius_m)
      : radius_m_(radius_m), cell_m_(4 * radius_m), slots_(std::bit_ceil(2 * most + 1), kFree) {}

  /// The first station within the radius; firsts_m.size() when there is none. The ball around a
  /// place is in one or two cells along each axis.
  std::size_t find(const Eigen::Vector3d& place_m,
                   const std::vector<Eigen::Vector3d>& firsts_m) const {
    const Cell low = ((place_m.array() - radius_m_) / cell_m_).floor();
    const Cell more = ((place_m.array() + radius_m_) / cell_m_).floor() - low;
    std::size_t found = firsts_m.size();
    for (int corner = 0; corner < 8; ++corner) {
      const Cell step(corner & 1, (corner >> 1) & 1, corner >> 2);
      if ((step > more).any()) continue;
      const Cell cell = low + step;
      for (std::size_t slot = slot_of(cell); slots_[slot] != kFree; slot = next(slot)) {
        const std::size_t station = slots_[slot];
        if (station < found && (firsts_m[station] - place_m).norm() <= radius_m_) found = station;
      }
    }
    return found;
  }

  void insert(const Eigen::Vector3d& place_m, std::size_t station) {
    std::size_t slot = slot_of((place_m.array() / cell_m_).floor());
    while (slots_[slot] != kFree) slot = next(slot);
    slots_[slot] = static_cast<std::uint32_t>(station);
  }

 private:
  static constexpr std::uint32_t kFree = std::numeric_limits<std::uint32_t>::max();

  std::size_t next(std::size_t slot) const { return (slot + 1) & (slots_.size() - 1); }
  std::size_t slot_of(const Cell& cell) const {
    std::uint64_t hash = 0;
    for (const double number : cell) {
      // + 0: there is a zero with a minus sign, whose bits are others.
      hash = mixed(hash ^ std::bit_cast<std::uint64_t>(number + 0.0));
    }
    return static_cast<std::size_t>(hash) & (slots_.size() - 1);
  }

  double radius_m_, cell_m_;
  std::vector<std::uint32_t> slots_;
};

}  // namespace

std::vector<std::size_t> stations_of(std::span<const Eigen::Vector3d> places_m, double radius_m) {
  StationTable table(places_m.size(), radius_m);
  std::vector<Eigen::Vector3d> firsts_m;
  std::vector<std::size_t> stations;
  stations.reserve(places_m.size());
  for (const Eigen::Vector3d& place_m : places_m) {
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
