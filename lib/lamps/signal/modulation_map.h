// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "lamps/image/image_view.h"
#include "lamps/image/pixel_box.h"

namespace vlp {

/// Width of a cell along a scanline, in pixels. A sum over this width loses no signal, because all
/// pixels of a scanline are exposed at the same time.
inline constexpr int kCellWidth_px = 8;

/// Mean gray levels of the cells of an image whose rows are the scanlines. A cell is kCellWidth_px
/// wide and `lines_per_bin` scanlines (a bin) high. There are `cells` columns of them and `bins`
/// rows.
struct CellLevels {
  PixelBox box;  ///< part of the image; cells begin at its corner
  int cells, bins, lines_per_bin;
  /// Mean level of each cell above the dark level, in gray levels, by bin and cell.
  std::vector<float> levels;

  const float* levels_of_bin(int bin) const { return levels.data() + std::ptrdiff_t(bin) * cells; }
};

/// Averages the pixels of `box` over cells. Subtracts `dark_level`; darker cells are 0.
CellLevels average_over_cells(const ImageView& lines, const PixelBox& box, double dark_level,
                              int lines_per_bin);

/// Amplitude of the modulation in a part of an image, for each cell and every second bin.
struct ModulationMap {
  PixelBox box;
  int cells, steps, lines_per_step;
  /// Largest amplitude over all periods, and the mean level around it, in gray levels, by step and
  /// cell.
  std::vector<float> amplitude, mean;
  /// Complex amplitudes by period (row), and step and cell (column). They take 8 bytes for each
  /// cell and period; empty if they are not kept.
  Eigen::ArrayXXcf amplitudes;

  /// Returns the middle of a step's bin, as a scanline of the image.
  double middle_of_step(int step) const { return box.y + (step + 0.75) * lines_per_step - 0.5; }
  std::size_t cell_index(int step, int cell) const {
    return std::size_t(step) * std::size_t(cells) + std::size_t(cell);
  }
};

/// Demodulates each cell column at each period:
///
///     a_i(l) = 2 |sum_k w_i(k) I(l + k) exp(-2 pi j (l + k) / P_i)|,
///
/// where w_i is the convolution of two boxes of exactly P_i scanlines. The first box removes a
/// constant level and all harmonics of the period, the second a linear change of the level. `mean`
/// is the same filter without the carrier, so that amplitude / mean is the modulation depth: 4 / pi
/// for a square wave of duty 0.5. Scanlines outside the box count as dark.
///
/// @param keeps_amplitudes  true: sets ModulationMap::amplitudes
ModulationMap make_modulation_map(const CellLevels& cells, std::span<const double> periods_lines,
                                  bool keeps_amplitudes);

/// Returns the amplitude that noise of the dark level exceeds with the probability 1e-9 in one
/// cell, at one period, in gray levels. The squared amplitude of white noise with the standard
/// deviation `noise` per pixel is exponentially distributed. Its mean is 4 noise^2 sum w^2 /
/// kCellWidth_px, with sum w^2 = 2 / (3 P).
double compute_min_amplitude(double noise, double period_lines);

/// Minimum amplitude of a cell of a region, as a fraction of the region's maximum.
inline constexpr float kBorderFraction = 0.12F;

/// Region of cells around one maximum of the amplitude.
struct ModulatedRegion {
  /// Columns begin to end - 1 of a step, in pixels of the image.
  struct Span {
    int step, begin, end;
  };
  PixelBox box;
  double peak_amplitude;  ///< largest amplitude, in gray levels
  std::vector<Span> spans;
  int cells;
};

/// Finds the regions of significant modulation by a watershed of the amplitude from its maxima
/// down. Uses cells with an amplitude above `min_amplitude` and above a quarter of their mean
/// level. A region ends where the amplitude falls below kBorderFraction of its maximum. Darker
/// cells are light that the lamp casts on its surroundings, or belong to another maximum. Two
/// maxima are merged if the saddle between them is above 60 % of the lower one.
///
/// @param splits_by_phase  true (@pre the map has amplitudes): cells are only joined to a region in
/// phase with it, at the period
///        with the largest sum of its complex amplitudes. This separates lamps that touch, and cuts
///        patterns into pieces.
std::vector<ModulatedRegion> list_modulated_regions(const ModulationMap& map, double min_amplitude,
                                                    bool splits_by_phase = false);

}  // namespace vlp
