// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "lamps/image/image_view.h"
#include "lamps/image/pixel_box.h"

namespace vlp {

/// Width of a cell across the lines, in pixels. Sums over so many pixels of a line lose no signal,
/// because all pixels of a line are exposed at the same time.
inline constexpr int kCellWidth_px = 8;

/// Mean levels of an image's cells, which are kCellWidth_px wide and `lines_per_bin` lines high.
struct CellLevels {
  PixelBox box;  ///< the part of the image, from a cell's corner on
  int cells, bins, lines_per_bin;
  /// Mean of the cell's pixels above the dark level, in grey levels, by bin and cell.
  std::vector<float> levels;

  const float* row(int bin) const { return levels.data() + std::ptrdiff_t(bin) * cells; }
};

/// Averages the pixels of `box` over cells. `dark_level` is subtracted; what is darker counts as 0.
CellLevels average_cells(const ImageView& lines, const PixelBox& box, double dark_level,
                         int lines_per_bin);

/// Amplitude of the modulation in part of an image, at one cell and every second bin.
struct ModulationMap {
  PixelBox box;
  int cells, steps, lines_per_step;
  /// By step and cell, in grey levels: the largest amplitude of all periods and the mean level
  /// around it.
  std::vector<float> amplitude, mean;

  /// Returns the middle of a step's bin, as a line of the image.
  double line(int step) const { return box.y + (step + 0.75) * lines_per_step - 0.5; }
  std::size_t index(int step, int cell) const {
    return std::size_t(step) * std::size_t(cells) + std::size_t(cell);
  }
};

/// Demodulates each cell column at each period:
///
///     a_i(l) = 2 |sum_k w_i(k) I(l + k) exp(-2 pi j (l + k) / P_i)|,
///
/// where w_i is the convolution of two boxes of exactly P_i lines. One box removes a steady level
/// and all harmonics of the period, the second a level that changes evenly. `mean` is the same
/// window without the carrier, so that amplitude / mean is the modulation depth: 4 / pi for a
/// square wave that is lit half of the time. Lines outside of the box count as dark.
ModulationMap map_modulation(const CellLevels& cells, std::span<const double> periods_lines);

/// Returns the amplitude that the noise of the dark exceeds with the probability 1e-9 in one cell,
/// at one period, in grey levels. The squared amplitude of white noise with the standard deviation
/// `noise` per pixel is exponentially distributed with the mean 4 noise^2 sum w^2 / (pixels of a
/// line of a cell), and sum w^2 = 2 / (3 P).
double min_significant_amplitude(double noise, double period_lines);

/// Amplitude below which a cell belongs to no region, over that of the region's maximum.
inline constexpr float kBorderFraction = 0.12F;

/// Cells of one maximum of the amplitude.
struct ModulatedRegion {
  /// Columns of a step, in pixels of the image.
  struct Span {
    int step, begin, end;
  };
  PixelBox box;
  double peak;  ///< largest amplitude, in grey levels
  std::vector<Span> spans;
  int cells;
};

/// Finds the regions of significant modulation by a watershed of the amplitude from its maxima
/// down. Cells count whose amplitude exceeds `min_amplitude` and a quarter of their mean level. A
/// region ends where the amplitude falls below kBorderFraction of its maximum: what is darker is
/// light that the lamp throws on its surroundings, or belongs to another maximum. Two maxima are
/// one where the saddle between them is above 60 % of the lower one.
std::vector<ModulatedRegion> find_modulated_regions(const ModulationMap& map, double min_amplitude);

}  // namespace vlp
