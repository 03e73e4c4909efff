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

/// Light that was found by its modulation, whatever its shape.
struct ModulatedLight {
  /// Bounding box of its cells, extended to the border of the searched box if the light continues
  /// there.
  PixelBox box;
  /// Centroid (column, line) of the lit area in the image whose rows are the scanlines, px.
  /// `radius_px` is the radius of the disc of equal area.
  Eigen::Vector2d center;
  double radius_px;
  /// Standard deviation per axis of the lamp's center from `center`, in pixels. A source deep in a
  /// reflector may appear anywhere in the lamp: the lamp's center may lie on the border of the lit
  /// area.
  double center_sd_px;
  PeriodFit fit;
  /// Index in `lamp_periods_lines` of the light's period; std::nullopt if none or several are
  /// possible.
  std::optional<std::size_t> lamp;
  /// Stripes of its brightest part, divided by the envelope. Their coherence is the phase coherence
  /// |sum z| / sum |z| over the cells of this part, see detect_modulated_lights().
  Stripes stripes;
  /// Level of its brightest scanlines above the dark level, in gray levels. The fundamental of a
  /// square wave between 0 and this level has the amplitude (2 / pi) sin(pi duty) times the level.
  double peak_level;
  /// Sum of the modulation amplitudes of its cells, in gray levels.
  double energy;
  /// True if it is a light only if it has an outline: a lit area whose modulation was not found, or
  /// a part in phase of a region that is out of phase.
  bool requires_outline;
};

/// Detects lights in parts of an image by their modulation and assigns them to the periods of the
/// lamps.
///
/// @param lines  image whose rows are the scanlines
/// @param boxes  parts of the image to search
/// @param background  dark level and noise of the image
/// @param lamp_periods_lines  periods of the lamps of the map; empty if the row time is unknown:
///        the lights then have the period that fits best
///
/// Each region of the modulation map (see list_modulated_regions()) has a line profile, in which a
/// column is weighted by its amplitude. The profile is fitted with each lamp's period within its
/// drift, and with any other period. With the fractions u of the variance that the fits do not
/// explain, the log-likelihood ratio of two periods is
///
///     L = n / 2 log(u_2 / u_1),   n = periods min(6, lines of a period) - 7.
///
/// n is the number of degrees of freedom of three harmonics over the periods that both fits cover.
///
/// A region is assigned to the best lamp under three conditions. The fit leaves less than 45 % of
/// the variance; L against every other lamp exceeds 4; and no period outside the map is better
/// by 4. A lamp that is assigned to another region without doubt is no competitor, unless the phase
/// also agrees with that lamp. Neighboring regions with the same lamp and phase are joined to one
/// light.
///
/// A shutter exposes all pixels of a scanline at the same time. All parts of a lamp are therefore
/// modulated in phase, whatever its shape; the parts of letters and patterns are not. With the
/// complex amplitude z of each cell at the period, the phase coherence |sum z| / sum |z| of a light
/// exceeds 0.9. A phase change of a quarter of a period across the light reduces it to 0.9.
std::vector<ModulatedLight> detect_modulated_lights(const ImageView& lines,
                                                    std::span<const PixelBox> boxes,
                                                    const Background& background,
                                                    std::span<const double> lamp_periods_lines);

/// Returns the index of the lamp period that a profile has. Returns std::nullopt if no period
/// explains 55 % of the variance of the profile with a modulation depth of 0.3, if there are less
/// than kMinPeriods periods, or if another period, whether of a lamp or not, is nearly as probable:
/// the odds have to be at least 55.
std::optional<std::size_t> identify_lamp_period(const LineProfile& profile,
                                                std::span<const double> lamp_periods_lines);

/// Measures the stripes of a profile with approximately this period after division by its envelope.
/// Their period is that of a fit beyond the drift of a lamp, which does not depend on the given row
/// time. Stripes that the ends of a light cut bias that of measure_stripes(). The coherence is not
/// set.
Stripes measure_stripes_of_period(const LineProfile& profile, double period_lines);

}  // namespace vlp
