// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "lamps/image/background.h"
#include "lamps/image/image_view.h"
#include "lamps/signal/modulation_map.h"
#include "lamps/signal/period_fit.h"
#include "lamps/signal/stripes.h"

namespace vlp {

/// A light that was found by its modulation, whatever its shape.
struct ModulatedLight {
  PixelBox box;  ///< around its cells
  /// Centre of the area that it lights, (column, line), and the radius of the disc of that area, in
  /// pixels.
  Eigen::Vector2d center;
  double radius_px;
  /// Largest distance per axis of the centre of a brighter part of the area from `center`, in
  /// pixels: of that above a quarter, and above a half, of the largest amplitude.
  double asymmetry_px;
  /// Standard deviation per axis of the lamp's centre from `center`, in pixels. A source deep in a
  /// reflector is seen anywhere in the lamp: the lamp's centre may lie on the border of the lit
  /// area.
  double center_sd_px;
  PeriodFit fit;
  /// Index of the lamp period that it has; std::nullopt where it has none or may have two.
  std::optional<std::size_t> lamp;
  Stripes stripes;  ///< of its brightest part, behind its envelope
  /// |sum z| / sum |z| over the cells of its brightest part, see find_modulated_lights().
  double phase_coherence;
  /// Level of its brightest lines above the dark, in grey levels. The fundamental of a square wave
  /// between 0 and that level has the amplitude (2 / pi) sin(pi duty) times it.
  double peak;
  /// Sum of the amplitude over its cells.
  double energy;
};

/// Finds lights in parts of an image by their modulation and decides which of the lamps' periods
/// they have.
///
/// Each region of the modulation map (see find_modulated_regions()) has a line profile, in which a
/// column counts by its amplitude. The profile is fitted with each lamp's period, give or take its
/// drift, and with any other period. With the fractions u of the variance that the fits leave, the
/// log-likelihood ratio of two periods is
///
///     L = n / 2 log(u_2 / u_1),   n = periods min(6, lines of a period) - 7,
///
/// where n is the number of independent values that three harmonics leave of the periods that both
/// cover. The
/// best lamp is taken if it leaves less than 45 %, if L against every other lamp exceeds 4, and if
/// no period that is no lamp's is better by 4. A lamp that another region of the image has beyond
/// doubt does not count as a rival, unless the phase is that lamp's, too. Regions with one lamp and
/// one phase that are near each other are one light.
///
/// A shutter exposes all pixels of a line at one time, so that all parts of a lamp are modulated in
/// phase, whatever its shape; the parts of letters and patterns are not. With the complex amplitude
/// z of each cell at the period, the phase coherence |sum z| / sum |z| of a light exceeds 0.9. A
/// phase change of a quarter of a period across the light reduces it to that.
///
/// With no lamp periods (the row time is not known) the lights have the period that fits best.
///
/// @param lines  image whose rows are the lines that the shutter reads
/// @param boxes  parts of the image to search
/// @param lamp_periods_lines  periods of the lamps of the map, in lines; may be empty
std::vector<ModulatedLight> find_modulated_lights(const ImageView& lines,
                                                  std::span<const PixelBox> boxes,
                                                  const Background& background,
                                                  std::span<const double> lamp_periods_lines);

}  // namespace vlp
