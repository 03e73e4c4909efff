// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/signal/modulation_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace vlp {
namespace {

/// Number of bins from one step of the map to the next.
constexpr int kBinsPerStep = 2;
/// Probability that noise makes one cell significant at one period: an image has up to 1e5 cells.
constexpr double kFalseAlarmRate = 1e-9;
/// Modulation depth below which a cell is steady: a steady edge reaches 0.2 to 0.3 next to it.
constexpr float kMinCellDepth = 0.25F;
/// Minimum ratio of the amplitude of the saddle to that of the lower maximum at which two maxima
/// are merged.
constexpr float kSaddleFraction = 0.6F;

/// Grid of values by bin and cell.
class CellGrid {
 public:
  CellGrid(int rows, int columns)
      : columns_(columns), values_(std::size_t(rows) * std::size_t(columns)) {}
  float* row(int i) { return values_.data() + std::ptrdiff_t(i) * columns_; }
  const float* row(int i) const { return values_.data() + std::ptrdiff_t(i) * columns_; }

 private:
  int columns_;
  std::vector<float> values_;
};

template <typename Level>
void sum_line(const Level* pixels, int width, float* sums, int cells) {
  const int whole = width / kCellWidth_px;
  for (int c = 0; c < whole; ++c) {
    int sum = 0;
    for (int i = 0; i < kCellWidth_px; ++i) sum += pixels[c * kCellWidth_px + i];
    sums[c] += float(sum);
  }
  if (whole == cells) return;
  int sum = 0;
  for (int i = whole * kCellWidth_px; i < width; ++i) sum += pixels[i];
  sums[whole] += float(sum) * float(kCellWidth_px) / float(width - whole * kCellWidth_px);
}

/// Position between two rows of cumulative sums.
struct SumPlace {
  int row;
  float fraction;
};

SumPlace sum_place_at(double t, int rows) {
  t = std::clamp(t, 0.0, double(rows));
  const int row = std::min(static_cast<int>(t), rows - 1);
  return {row, static_cast<float>(t - row)};
}

/// Moving mean over `length` bins around each bin, from cumulative sums; values outside are 0.
class MovingMean {
 public:
  MovingMean(int bins, int cells, double length)
      : bins_(bins), cells_(cells), length_(length), sums_(bins + 1, cells) {}

  void restart() { std::fill_n(sums_.row(0), cells_, 0.F); }
  /// Return the row of the cumulative sum after `bin`, and that before it.
  float* after(int bin) { return sums_.row(bin + 1); }
  const float* before(int bin) const { return sums_.row(bin); }

  void mean_at(int bin, float* mean) const {
    const SumPlace low = sum_place_at(bin + 0.5 - length_ / 2, bins_);
    const SumPlace high = sum_place_at(bin + 0.5 + length_ / 2, bins_);
    const float *a = sums_.row(low.row), *b = sums_.row(low.row + 1);
    const float *d = sums_.row(high.row), *e = sums_.row(high.row + 1);
    const auto scale = static_cast<float>(1 / length_);
    for (int c = 0; c < cells_; ++c) {
      mean[c] =
          scale * (d[c] + high.fraction * (e[c] - d[c]) - a[c] - low.fraction * (b[c] - a[c]));
    }
  }

 private:
  int bins_, cells_;
  double length_;
  CellGrid sums_;
};

/// Moving mean applied twice with the same length, to values times a factor for each bin.
class TwiceMean {
 public:
  TwiceMean(int bins, int cells, double length)
      : bins_(bins),
        cells_(cells),
        first_(bins, cells, length),
        second_(bins, cells, length),
        mean_(std::size_t(cells)) {}

  void apply(const CellLevels& cells, std::span<const float> factors) {
    first_.restart();
    second_.restart();
    for (int bin = 0; bin < bins_; ++bin) {
      const float factor = factors[std::size_t(bin)];
      const float *level = cells.row(bin), *before = first_.before(bin);
      float* after = first_.after(bin);
      for (int c = 0; c < cells_; ++c) after[c] = before[c] + factor * level[c];
    }
    for (int bin = 0; bin < bins_; ++bin) {
      first_.mean_at(bin, mean_.data());
      const float* before = second_.before(bin);
      float* after = second_.after(bin);
      for (int c = 0; c < cells_; ++c) after[c] = before[c] + mean_[std::size_t(c)];
    }
  }
  void mean_at(int bin, float* mean) const { second_.mean_at(bin, mean); }

 private:
  int bins_, cells_;
  MovingMean first_, second_;
  std::vector<float> mean_;
};

/// Watershed of find_modulated_regions().
class Watershed {
 public:
  explicit Watershed(const ModulationMap& map) : map_(map), labels_(map.amplitude.size(), kNone) {}

  /// Adds the next cell; cells have to be added in descending order of amplitude.
  void add(int cell) {
    const float amplitude = map_.amplitude[std::size_t(cell)];
    const auto [basin, beside_border] = join_neighbors(cell, amplitude);
    int& label = labels_[std::size_t(cell)];
    if (basin >= 0) {
      label = amplitude >= kBorderFraction * peak(basin) ? basin : kBorder;
    } else if (beside_border) {
      label = kBorder;
    } else {
      label = static_cast<int>(parents_.size());
      parents_.push_back(label);
      peaks_.push_back(cell);
    }
  }

  /// Returns the basin of a cell; negative if it has none.
  int find_basin(std::size_t cell) {
    return labels_[cell] < 0 ? labels_[cell] : root(labels_[cell]);
  }
  int peak_cell(int basin) const { return peaks_[std::size_t(basin)]; }
  std::size_t size() const { return parents_.size(); }

 private:
  static constexpr int kNone = -1, kBorder = -2;

  float peak(int basin) const { return map_.amplitude[std::size_t(peaks_[std::size_t(basin)])]; }
  int root(int label) {
    while (parents_[std::size_t(label)] != label) label = parents_[std::size_t(label)];
    return label;
  }

  /// Returns the basin of a cell's neighbors, merged with others if the saddle is high, and whether
  /// one of the neighbors is a border.
  std::pair<int, bool> join_neighbors(int cell, float amplitude) {
    const int x = cell % map_.cells, y = cell / map_.cells;
    int basin = kNone;
    bool beside_border = false;
    for (int v = std::max(0, y - 1); v <= std::min(map_.steps - 1, y + 1); ++v) {
      for (int u = std::max(0, x - 1); u <= std::min(map_.cells - 1, x + 1); ++u) {
        const int label = labels_[map_.index(v, u)];
        beside_border = beside_border || label == kBorder;
        if (label < 0) continue;
        const int other = root(label);
        if (basin < 0 || other == basin) {
          basin = other;
          continue;
        }
        const auto [lower, higher] =
            peak(other) < peak(basin) ? std::pair(other, basin) : std::pair(basin, other);
        if (amplitude >= kSaddleFraction * peak(lower)) parents_[std::size_t(lower)] = higher;
        basin = higher;
      }
    }
    return {basin, beside_border};
  }

  const ModulationMap& map_;
  std::vector<int> labels_, parents_, peaks_;
};

void add_cell(const ModulationMap& map, int step, int cell, ModulatedRegion& region) {
  const PixelBox box{map.box.x + cell * kCellWidth_px, map.box.y + step * map.lines_per_step,
                     kCellWidth_px, map.lines_per_step};
  region.box = region.cells == 0 ? box : around(region.box, box);
  ++region.cells;
  auto& spans = region.spans;
  if (!spans.empty() && spans.back().step == step && spans.back().end == box.x) {
    spans.back().end = box.right();
  } else {
    spans.push_back({step, box.x, box.right()});
  }
}

}  // namespace

CellLevels average_cells(const ImageView& lines, const PixelBox& box, double dark_level,
                         int lines_per_bin) {
  CellLevels result{box,
                    (box.width + kCellWidth_px - 1) / kCellWidth_px,
                    (box.height + lines_per_bin - 1) / lines_per_bin,
                    lines_per_bin,
                    {}};
  result.levels.assign(std::size_t(result.bins) * std::size_t(result.cells), 0);
  for (int bin = 0; bin < result.bins; ++bin) {
    float* sums = result.levels.data() + std::ptrdiff_t(bin) * result.cells;
    const int begin = bin * lines_per_bin, end = std::min(begin + lines_per_bin, box.height);
    for (int line = begin; line < end; ++line) {
      visit_levels(lines, [&](auto level) {
        sum_line(lines.row<decltype(level)>(box.y + line) + box.x, box.width, sums, result.cells);
      });
    }
    const float scale = 1 / float((end - begin) * kCellWidth_px);
    const auto dark = static_cast<float>(dark_level);
    for (int c = 0; c < result.cells; ++c) sums[c] = std::max(0.F, scale * sums[c] - dark);
  }
  return result;
}

ModulationMap map_modulation(const CellLevels& cells, std::span<const double> periods_lines) {
  ModulationMap map{cells.box,
                    cells.cells,
                    (cells.bins + kBinsPerStep - 1) / kBinsPerStep,
                    kBinsPerStep * cells.lines_per_bin,
                    {},
                    {}};
  const std::size_t size = map.index(map.steps, 0), count = std::size_t(cells.cells);
  map.amplitude.assign(size, 0);
  map.mean.assign(size, 0);
  std::vector<float> cosines(std::size_t(cells.bins)), sines(cosines.size()),
      ones(cosines.size(), 1);
  std::vector<float> real(count), imaginary(count), mean(count);
  for (const double period_lines : periods_lines) {
    const double period = period_lines / cells.lines_per_bin;
    for (std::size_t bin = 0; bin < cosines.size(); ++bin) {
      const double angle = 2 * std::numbers::pi * (double(bin) + 0.5) / period;
      cosines[bin] = static_cast<float>(std::cos(angle));
      sines[bin] = static_cast<float>(std::sin(angle));
    }
    std::array filters{TwiceMean(cells.bins, cells.cells, period),
                       TwiceMean(cells.bins, cells.cells, period),
                       TwiceMean(cells.bins, cells.cells, period)};
    filters[0].apply(cells, cosines);
    filters[1].apply(cells, sines);
    filters[2].apply(cells, ones);
    for (int step = 0; step < map.steps; ++step) {
      const int bin = std::min(step * kBinsPerStep + kBinsPerStep / 2, cells.bins - 1);
      filters[0].mean_at(bin, real.data());
      filters[1].mean_at(bin, imaginary.data());
      filters[2].mean_at(bin, mean.data());
      for (std::size_t c = 0; c < count; ++c) {
        const std::size_t k = map.index(step, static_cast<int>(c));
        const float amplitude = 2 * std::sqrt(real[c] * real[c] + imaginary[c] * imaginary[c]);
        if (amplitude <= map.amplitude[k]) continue;
        map.amplitude[k] = amplitude;
        map.mean[k] = mean[c];
      }
    }
  }
  return map;
}

double min_significant_amplitude(double noise, double period_lines) {
  const double mean_square = 4 * noise * noise / kCellWidth_px * 2 / (3 * period_lines);
  return std::sqrt(-std::log(kFalseAlarmRate) * mean_square);
}

std::vector<ModulatedRegion> find_modulated_regions(const ModulationMap& map,
                                                    double min_amplitude) {
  std::vector<int> order;
  for (std::size_t i = 0; i < map.amplitude.size(); ++i) {
    const float amplitude = map.amplitude[i];
    if (amplitude > static_cast<float>(min_amplitude) && amplitude > kMinCellDepth * map.mean[i]) {
      order.push_back(static_cast<int>(i));
    }
  }
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    const float amplitude_a = map.amplitude[std::size_t(a)],
                amplitude_b = map.amplitude[std::size_t(b)];
    return amplitude_a != amplitude_b ? amplitude_a > amplitude_b : a < b;
  });
  Watershed watershed(map);
  for (const int cell : order) watershed.add(cell);
  std::vector<int> region_indices(watershed.size(), -1);
  std::vector<ModulatedRegion> regions;
  for (int step = 0; step < map.steps; ++step) {
    for (int cell = 0; cell < map.cells; ++cell) {
      const int basin = watershed.find_basin(map.index(step, cell));
      if (basin < 0) continue;
      int& region = region_indices[std::size_t(basin)];
      if (region < 0) {
        region = static_cast<int>(regions.size());
        const auto peak = std::size_t(watershed.peak_cell(basin));
        regions.push_back({{}, map.amplitude[peak], {}, 0});
      }
      add_cell(map, step, cell, regions[std::size_t(region)]);
    }
  }
  return regions;
}

}  // namespace vlp
