// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/signal/modulation_map.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <complex>
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
/// Minimum phase coherence of two maxima that are merged.
constexpr float kMinCosine = 0.25F;
constexpr float kMinCoherenceOfMaxima = 0.9F;

/// Values by bin and cell.
using CellArray = Eigen::Array<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

template <typename Level>
void sum_scanline(const Level* pixels, int width, float* sums, int cells) {
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

/// Returns the mean over `length` bins around each bin `first + i * step`, at most around the last
/// bin, for `count` values of i; values outside are 0.
CellArray compute_moving_mean(const CellArray& values, double length, Eigen::Index first,
                              Eigen::Index step, Eigen::Index count) {
  const Eigen::Index bins = values.rows();
  CellArray sums(bins + 1, values.cols()), means(count, values.cols());
  sums.row(0).setZero();
  for (Eigen::Index bin = 0; bin < bins; ++bin) {
    sums.row(bin + 1) = sums.row(bin) + values.row(bin);
  }
  struct End {
    Eigen::Index whole;
    float fraction;
  };
  const auto find_end = [&](double end) {
    const double t = std::clamp(end, 0.0, double(bins));
    const Eigen::Index whole = std::min(static_cast<Eigen::Index>(t), bins - 1);
    return End{whole, static_cast<float>(t - double(whole))};
  };
  for (Eigen::Index i = 0; i < count; ++i) {
    const double middle = double(std::min(first + i * step, bins - 1)) + 0.5;
    const End low = find_end(middle - length / 2), high = find_end(middle + length / 2);
    means.row(i) = (sums.row(high.whole) - sums.row(low.whole) +
                    high.fraction * values.row(high.whole) - low.fraction * values.row(low.whole)) *
                   static_cast<float>(1 / length);
  }
  return means;
}

/// Watershed of list_modulated_regions().
class Watershed {
 public:
  Watershed(const ModulationMap& map, bool splits_by_phase)
      : map_(map), splits_by_phase_(splits_by_phase), labels_(map.amplitude.size(), kNone) {}

  /// Adds the next cell; cells have to be added in descending order of amplitude.
  void add(int cell) {
    const float amplitude = map_.amplitude[std::size_t(cell)];
    const auto [basin, beside_border] = join_neighbors(cell, amplitude);
    int& label = labels_[std::size_t(cell)];
    if (basin >= 0) {
      label = amplitude >= kBorderFraction * peak(basin) ? basin : kBorder;
      if (label >= 0 && splits_by_phase_) {
        sums_[std::size_t(label)] += map_.amplitudes.col(cell);
        magnitudes_[std::size_t(label)] += map_.amplitudes.col(cell).abs();
      }
    } else if (beside_border) {
      label = kBorder;
    } else {
      label = static_cast<int>(parents_.size());
      parents_.push_back(label);
      peaks_.push_back(cell);
      if (splits_by_phase_) {
        sums_.emplace_back(map_.amplitudes.col(cell));
        magnitudes_.emplace_back(map_.amplitudes.col(cell).abs());
      }
    }
  }

  /// Returns the basin of a cell; negative if it has none.
  int get_basin(std::size_t cell) {
    return labels_[cell] < 0 ? labels_[cell] : get_root(labels_[cell]);
  }
  int get_peak_cell(int basin) const { return peaks_[std::size_t(basin)]; }
  std::size_t size() const { return parents_.size(); }

 private:
  static constexpr int kNone = -1, kBorder = -2;

  float peak(int basin) const { return map_.amplitude[std::size_t(peaks_[std::size_t(basin)])]; }
  /// Returns true if the cells of both basins are modulated in phase, at the period with the
  /// largest sum of both.
  bool are_in_phase(int a, int b) const {
    if (!splits_by_phase_) return true;
    const auto i = std::size_t(a), j = std::size_t(b);
    const Eigen::ArrayXf sum = (sums_[i] + sums_[j]).abs(),
                         magnitude = magnitudes_[i] + magnitudes_[j];
    Eigen::Index period;
    const float largest = sum.maxCoeff(&period);
    return largest > kMinCoherenceOfMaxima * magnitude[period];
  }
  bool is_in_phase(int cell, int basin) const {
    if (!splits_by_phase_) return true;
    const auto& sums = sums_[std::size_t(basin)];
    Eigen::Index period;
    const float largest = sums.abs().maxCoeff(&period);
    const auto z = map_.amplitudes(period, cell);
    return (z * std::conj(sums[period])).real() > kMinCosine * std::abs(z) * largest;
  }
  void merge(int from, int into) {
    parents_[std::size_t(from)] = into;
    if (!splits_by_phase_) return;
    sums_[std::size_t(into)] += sums_[std::size_t(from)];
    magnitudes_[std::size_t(into)] += magnitudes_[std::size_t(from)];
  }
  int get_root(int label) {
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
        const int label = labels_[map_.cell_index(v, u)];
        beside_border = beside_border || label == kBorder;
        if (label < 0) continue;
        const int other = get_root(label);
        if (!is_in_phase(cell, other)) continue;
        if (basin < 0 || other == basin) {
          basin = other;
          continue;
        }
        const auto [lower, higher] =
            peak(other) < peak(basin) ? std::pair(other, basin) : std::pair(basin, other);
        if (amplitude >= kSaddleFraction * peak(lower) && are_in_phase(lower, higher))
          merge(lower, higher);
        basin = higher;
      }
    }
    return {basin, beside_border};
  }

  const ModulationMap& map_;
  bool splits_by_phase_;
  std::vector<int> labels_, parents_, peaks_;
  /// Sums of the complex amplitudes of a basin, and of their magnitudes, by period.
  std::vector<Eigen::ArrayXcf> sums_;
  std::vector<Eigen::ArrayXf> magnitudes_;
};

void add_cell(const ModulationMap& map, int step, int cell, ModulatedRegion& region) {
  const PixelBox box{map.box.x + cell * kCellWidth_px, map.box.y + step * map.lines_per_step,
                     kCellWidth_px, map.lines_per_step};
  region.box = region.cells == 0 ? box : enclosing_box(region.box, box);
  ++region.cells;
  auto& spans = region.spans;
  if (!spans.empty() && spans.back().step == step && spans.back().end == box.x) {
    spans.back().end = box.end_column();
  } else {
    spans.push_back({step, box.x, box.end_column()});
  }
}

}  // namespace

CellLevels average_over_cells(const ImageView& lines, const PixelBox& box, double dark_level,
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
        sum_scanline(lines.row_pixels<decltype(level)>(box.y + line) + box.x, box.width, sums,
                     result.cells);
      });
    }
    const float scale = 1 / float((end - begin) * kCellWidth_px);
    const auto dark = static_cast<float>(dark_level);
    for (int c = 0; c < result.cells; ++c) sums[c] = std::max(0.F, scale * sums[c] - dark);
  }
  return result;
}

ModulationMap make_modulation_map(const CellLevels& cells, std::span<const double> periods_lines,
                                  bool keeps_amplitudes) {
  ModulationMap map{cells.box,
                    cells.cells,
                    (cells.bins + kBinsPerStep - 1) / kBinsPerStep,
                    kBinsPerStep * cells.lines_per_bin,
                    {},
                    {},
                    {}};
  map.amplitude.assign(map.cell_index(map.steps, 0), 0);
  map.mean.assign(map.amplitude.size(), 0);
  if (keeps_amplitudes)
    map.amplitudes.resize(Eigen::Index(periods_lines.size()), Eigen::Index(map.amplitude.size()));
  // Levels times cosine, times sine, and the levels themselves, side by side.
  const Eigen::Index count = cells.cells;
  CellArray products(cells.bins, 3 * count);
  products.rightCols(count) = Eigen::Map<const CellArray>(cells.levels.data(), cells.bins, count);
  const Eigen::ArrayXf bins = Eigen::ArrayXf::LinSpaced(cells.bins, 0.5F, float(cells.bins) - 0.5F);
  for (std::size_t i = 0; i < periods_lines.size(); ++i) {
    const double period = periods_lines[i] / cells.lines_per_bin;
    const Eigen::ArrayXf angles = bins * float(2 * std::numbers::pi / period);
    products.leftCols(count) = products.rightCols(count).colwise() * angles.cos();
    products.middleCols(count, count) = products.rightCols(count).colwise() * angles.sin();
    const CellArray filtered =
        compute_moving_mean(compute_moving_mean(products, period, 0, 1, cells.bins), period,
                            kBinsPerStep / 2, kBinsPerStep, map.steps);
    for (int step = 0; step < map.steps; ++step) {
      for (int cell = 0; cell < map.cells; ++cell) {
        const std::size_t k = map.cell_index(step, cell);
        const std::complex<float> z(2 * filtered(step, cell), 2 * filtered(step, count + cell));
        if (keeps_amplitudes) map.amplitudes(Eigen::Index(i), Eigen::Index(k)) = z;
        const float amplitude = std::sqrt(std::norm(z));
        if (amplitude <= map.amplitude[k]) continue;
        map.amplitude[k] = amplitude;
        map.mean[k] = filtered(step, 2 * count + cell);
      }
    }
  }
  return map;
}

double compute_min_amplitude(double noise, double period_lines) {
  const double mean_square = 4 * noise * noise / kCellWidth_px * 2 / (3 * period_lines);
  return std::sqrt(-std::log(kFalseAlarmRate) * mean_square);
}

std::vector<ModulatedRegion> list_modulated_regions(const ModulationMap& map, double min_amplitude,
                                                    bool splits_by_phase) {
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
  Watershed watershed(map, splits_by_phase);
  for (const int cell : order) watershed.add(cell);
  std::vector<int> region_indices(watershed.size(), -1);
  std::vector<ModulatedRegion> regions;
  for (int step = 0; step < map.steps; ++step) {
    for (int cell = 0; cell < map.cells; ++cell) {
      const int basin = watershed.get_basin(map.cell_index(step, cell));
      if (basin < 0) continue;
      int& region = region_indices[std::size_t(basin)];
      if (region < 0) {
        region = static_cast<int>(regions.size());
        const auto peak = std::size_t(watershed.get_peak_cell(basin));
        regions.push_back({{}, map.amplitude[peak], {}, 0});
      }
      add_cell(map, step, cell, regions[std::size_t(region)]);
    }
  }
  return regions;
}

}  // namespace vlp
