// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/errors/reference_points.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <unordered_map>

#include "evaluation/errors/split_mix.h"

namespace vlp {
namespace {

using Cell = Eigen::Array3d;  // whole numbers

/// First positions of the reference points, by the hash of their cell in a cubic grid. Cells of one
/// hash differ by the distance.
class ReferencePointTable {
 public:
  ReferencePointTable(std::size_t max_points, double radius_m)
      : radius_m_(radius_m), cell_m_(4 * radius_m) {
    points_by_cell_.reserve(max_points);
  }

  /// Returns the first reference point within the radius. A position without one becomes a new
  /// reference point.
  std::size_t get_or_insert(const Eigen::Vector3d& place_m) {
    std::size_t found = firsts_m_.size();
    // The ball around a position covers one or two cells along each axis.
    const Cell low = ((place_m.array() - radius_m_) / cell_m_).floor();
    const Cell more = ((place_m.array() + radius_m_) / cell_m_).floor() - low;
    for (int corner = 0; corner < 8; ++corner) {
      const Cell step(corner & 1, (corner >> 1) & 1, corner >> 2);
      if ((step > more).any()) continue;
      const auto [begin, end] = points_by_cell_.equal_range(hash_cell(low + step));
      for (auto each = begin; each != end; ++each) {
        const std::size_t point = each->second;
        const bool is_near = (firsts_m_[point] - place_m).norm() <= radius_m_;
        if (is_near) found = std::min(found, point);
      }
    }
    if (found == firsts_m_.size()) {
      points_by_cell_.emplace(hash_cell((place_m.array() / cell_m_).floor()), found);
      firsts_m_.push_back(place_m);
    }
    return found;
  }

 private:
  static std::uint64_t hash_cell(const Cell& cell) {
    std::uint64_t hash = 0;
    for (const double number : cell) {
      // + 0.0 turns a negative zero, which has other bits, into a positive one.
      hash = hash_splitmix64(hash ^ std::bit_cast<std::uint64_t>(number + 0.0));
    }
    return hash;
  }

  double radius_m_, cell_m_;
  std::unordered_multimap<std::uint64_t, std::size_t> points_by_cell_;
  std::vector<Eigen::Vector3d> firsts_m_;
};

}  // namespace

std::vector<std::size_t> group_positions(std::span<const Eigen::Vector3d> places_m,
                                         double radius_m) {
  ReferencePointTable table(places_m.size(), radius_m);
  std::vector<std::size_t> points;
  points.reserve(places_m.size());
  for (const Eigen::Vector3d& place_m : places_m) points.push_back(table.get_or_insert(place_m));
  return points;
}

}  // namespace vlp
