// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

namespace vlp {

/// Profile of a row from outside a light towards its inside: pixel i is in column `edge + direction
/// * i`.
template <typename Level>
struct Profile {
  const Level* row;
  int columns, edge, direction;

  bool has(int i) const {
    const int column = edge + direction * i;
    return column >= 0 && column < columns;
  }
  double operator()(int i) const { return row[edge + direction * i]; }

  /// Returns the first position from `begin` to before `end` where the profile rises through
  /// `level`; std::nullopt if there is none.
  std::optional<double> crossing(double level, int begin, int end) const {
    for (int i = begin; i < end && has(i) && has(i + 1); ++i) {
      const double below = (*this)(i), above = (*this)(i + 1);
      if (below < level && above >= level) return i + (level - below) / (above - below);
    }
    return std::nullopt;
  }
};

}  // namespace vlp
