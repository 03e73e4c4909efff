// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/signal/modulation_map.h"

#include <Eigen/Core>
#include <algorithm>
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

/// Returns the mean over `length` bins around each bin; values outside are 0.
CellArray compute_moving_mean(const CellArray& values, double length) {
  const Eigen::Index bins = values.rows();
  CellArray sums = CellArray::Zero(bins + 1, values.cols()), means(bins, values.cols());
  for (Eigen::Index bin = 0; bin < bins; ++bin) {
    sums.row(bin + 1) = sums.row(bin) + values.row(bin);
  }
  const auto add_integral = [&](Eigen::Index bin, double end, float factor) {
    const double t = std::clamp(end, 0.0, double(bins));
    const Eigen::Index whole = std::min(static_cast<Eigen::Index>(t), bins - 1);
    const auto fraction = static_cast<float>(t - double(whole));
    means.row(bin) += factor * (sums.row(whole) + fraction * values.row(whole));
  };
  means.setZero();
  for (Eigen::Index bin = 0; bin < bins; ++bin) {
    const double middle = double(bin) + 0.5;
    add_integral(bin, middle + length / 2, static_cast<float>(1 / length));
    add_integral(bin, middle - length / 2, static_cast<float>(-1 / length));
  }
  return means;
}

/// Applies the moving mean twice to the levels of the cells, times a factor for each bin.
CellArray filter_cells(const CellLevels& cells, const Eigen::ArrayXf& factors, double length) {
  const Eigen::Map<const CellArray> levels(cells.levels.data(), cells.bins, cells.cells);
  return compute_moving_mean(compute_moving_mean(levels.colwise() * factors, length), length);
}

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
  int find_basin_of_cell(std::size_t cell) {
    return labels_[cell] < 0 ? labels_[cell] : find_root(labels_[cell]);
  }
  int find_peak_cell(int basin) const { return peaks_[std::size_t(basin)]; }
  std::size_t size() const { return parents_.size(); }

 private:
  static constexpr int kNone = -1, kBorder = -2;

  float peak(int basin) const { return map_.amplitude[std::size_t(peaks_[std::size_t(basin)])]; }
  int find_root(int label) {
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
        const int label = labels_[map_.modulation_cell_index(v, u)];
        beside_border = beside_border || label == kBorder;
        if (label < 0) continue;
        const int other = find_root(label);
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

CellLevels average_pixels_over_cells(const ImageView& lines, const PixelBox& box, double dark_level,
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

ModulationMap compute_modulation_map(const CellLevels& cells,
                                     std::span<const double> periods_lines) {
  ModulationMap map{cells.box,
                    cells.cells,
                    (cells.bins + kBinsPerStep - 1) / kBinsPerStep,
                    kBinsPerStep * cells.lines_per_bin,
                    {},
                    {}};
  map.amplitude.assign(map.modulation_cell_index(map.steps, 0), 0);
  map.mean.assign(map.amplitude.size(), 0);
  const Eigen::ArrayXf bins = Eigen::ArrayXf::LinSpaced(cells.bins, 0, float(cells.bins - 1));
  for (const double period_lines : periods_lines) {
    const double period = period_lines / cells.lines_per_bin;
    const Eigen::ArrayXf angles = (bins + 0.5F) * float(2 * std::numbers::pi / period);
    const CellArray real = filter_cells(cells, angles.cos(), period);
    const CellArray imaginary = filter_cells(cells, angles.sin(), period);
    const CellArray mean = filter_cells(cells, Eigen::ArrayXf::Ones(cells.bins), period);
    for (int step = 0; step < map.steps; ++step) {
      const int bin = std::min(step * kBinsPerStep + kBinsPerStep / 2, cells.bins - 1);
      for (int cell = 0; cell < map.cells; ++cell) {
        const std::size_t k = map.modulation_cell_index(step, cell);
        const float amplitude = 2 * std::hypot(real(bin, cell), imaginary(bin, cell));
        if (amplitude <= map.amplitude[k]) continue;
        map.amplitude[k] = amplitude;
        map.mean[k] = mean(bin, cell);
      }
    }
  }
  return map;
}

double compute_min_significant_amplitude(double noise, double period_lines) {
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
      const int basin = watershed.find_basin_of_cell(map.modulation_cell_index(step, cell));
      if (basin < 0) continue;
      int& region = region_indices[std::size_t(basin)];
      if (region < 0) {
        region = static_cast<int>(regions.size());
        const auto peak = std::size_t(watershed.find_peak_cell(basin));
        regions.push_back({{}, map.amplitude[peak], {}, 0});
      }
      add_cell(map, step, cell, regions[std::size_t(region)]);
    }
  }
  return regions;
}

}  // namespace vlp
