// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/signal/coherence.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "lamps/signal/stripes.h"

namespace vlp {
namespace {

constexpr std::size_t kPieces = 5;
using PieceLevels = Eigen::Array<double, kPieces, 1>;

/// Returns the levels of each scanline's parts above the dark level.
template <typename Level>
std::vector<PieceLevels> piece_levels(const ImageView& lines, const std::vector<PixelRun>& chords,
                                      double dark) {
  std::vector<PieceLevels> levels;
  levels.reserve(chords.size());
  for (const auto& [row, begin, end] : chords) {
    const auto* pixels = lines.row<Level>(row);
    PieceLevels& line = levels.emplace_back();
    for (int piece = 0; piece < static_cast<int>(kPieces); ++piece) {
      const int from = begin + (end - begin) * piece / static_cast<int>(kPieces);
      const int to =
          std::max(from + 1, begin + (end - begin) * (piece + 1) / static_cast<int>(kPieces));
      double sum = 0;
      for (int column = from; column < to; ++column) sum += pixels[column];
      line[piece] = sum / (to - from) - dark;
    }
  }
  return levels;
}

}  // namespace

double compute_coherence(const ImageView& lines, const std::vector<PixelRun>& chords,
                         const Background& background, double period_lines) {
  constexpr double fraction = 0.05;
  constexpr std::size_t min_values = 3;
  const auto levels = visit_levels(lines, [&](auto level) {
    return piece_levels<decltype(level)>(lines, chords, background.level);
  });
  const auto quarter = static_cast<std::size_t>(std::max(1L, std::lround(period_lines / 4)));
  if (levels.size() + 1 < min_values + 2 * quarter) return 0;
  double brightest = 0;
  std::vector<PieceLevels> sums{PieceLevels::Zero()};  // cumulative
  sums.reserve(levels.size() + 1);
  for (const PieceLevels& line : levels) {
    sums.emplace_back(sums.back() + line);
    brightest = std::max(brightest, line.mean());
  }
  const double soft = (background.threshold - background.level) / 2 + fraction * brightest;
  PieceLevels cross_sums = PieceLevels::Zero(), own_squares = cross_sums,
              other_squares = cross_sums;
  for (std::size_t line = quarter; line + quarter <= levels.size(); ++line) {
    const PieceLevels before = (sums[line] - sums[line - quarter]) / double(quarter);
    const PieceLevels after = (sums[line + quarter] - sums[line]) / double(quarter);
    const PieceLevels step = ((after.max(0) + soft) / (before.max(0) + soft)).log();
    const PieceLevels other_parts = step.sum() - step;
    cross_sums += step * other_parts;
    own_squares += step.square();
    other_squares += other_parts.square();
  }
  std::array<double, kPieces> coherences{};
  for (std::size_t i = 0; i < kPieces; ++i) {
    const auto piece = static_cast<Eigen::Index>(i);
    const double scale = std::sqrt(own_squares[piece] * other_squares[piece]);
    coherences[i] = scale > 0 ? cross_sums[piece] / scale : 0;
  }
  std::sort(coherences.begin(), coherences.end());
  return coherences[1];
}

}  // namespace vlp
