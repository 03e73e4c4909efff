// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "lamps/image/background.h"
#include "lamps/image/image_view.h"
#include "lamps/image/pixel_box.h"
#include "lamps/image/pixel_runs.h"

namespace vlp {

/// Minimum period of stripes, in scanlines; the theoretical limit is two scanlines.
inline constexpr double kMinPeriod_lines = 2.2;

/// Limits for stripes: minimum contrast (bright - dark) / bright of a modulated light, 0 to 1, and
/// minimum number of stripe periods across an identified light.
inline constexpr double kMinContrast = 0.2, kMinPeriods = 1.3;

/// Number of periods below which patterns without stripes may match a lamp by chance.
inline constexpr double kMinReliablePeriods = 2.5;

/// Fraction of a disc's height that is used: scanlines at the rim are short and dim.
inline constexpr double kUsedHeight = 0.9;

/// Returns the pixels of a light on each scanline, without those at its rim. The light is an
/// ellipse in the box from `low` to `high` (column, row) of an image of `size`.
std::vector<PixelRun> list_chords_in_ellipse(const Eigen::Vector2d& low,
                                             const Eigen::Vector2d& high, const ImageSize& size);

/// Computes the level of each chord of a light above `dark`. Suppresses partial occlusion and
/// specks: the level is that of the second brightest of five parts of the chord. With a bright
/// core, whose level varies between the scanlines, it is that of the second darkest part.
std::vector<double> compute_scanline_signal(const ImageView& image,
                                            const std::vector<PixelRun>& chords, double dark,
                                            bool has_bright_core = false);

/// Stripes of a light and their statistics.
struct Stripes {
  /// Contrast (bright - dark) / bright of the scanlines: 0 for steady light, 1 for full modulation.
  double contrast;
  /// Period in scanlines, and the lit fraction of a period.
  double period_lines;
  double duty;
  /// Fraction of the signal's variance that a sine of this period explains.
  double periodicity_r2;
  /// Number of periods in the signal.
  double periods;
  /// True if the begins and ends of all stripes agree with the period.
  bool is_regular;
  /// Result of measure_part_coherence(), or the phase coherence of a modulated
  /// light, the larger one if both are measured; 0 if none is.
  double coherence;
  /// Number of stripes per scanline: half of the number of begins and ends divided by the number of
  /// scanlines. The signal crosses the middle between dark and bright there.
  double count_per_line;
  /// Fraction of the disc's area that is on scanlines brighter than the middle between dark and
  /// bright.
  double lit_area;
};

/// Returns true if the stripes are clear and numerous: periodicity above 0.7 and more than
/// kMinReliablePeriods periods. Stripes of a partly hidden lamp are not.
bool are_stripes_reliable(const Stripes& stripes);

/// Returns true if the period is meaningful: the stripes are regular, or their periodicity exceeds
/// 0.7. An object that hides a part of a lamp creates stripes that match another lamp by chance.
bool are_stripes_readable(const Stripes& stripes);

/// Measures the stripes of a signal, the result of compute_scanline_signal(). For a disc it covers
/// `kUsedHeight` of the radius above and below the middle. The period is first that of the
/// best-fitting sine with a constant (least squares, Lomb 1976), between kMinPeriod_lines and
/// the length of the signal. If the begins and ends of the stripes agree with it, they determine
/// the period. Contrast and periodicity are 0 for signals of less than 8 scanlines.
Stripes measure_stripes(const std::vector<double>& signal);

/// Minimum coherence of a modulated light: three quarters of the variance in a part of it are
/// common to all parts.
inline constexpr double kMinCoherence = 0.85;

/// Computes the similarity of the stripes in the parts of a light. A shutter exposes all pixels of
/// a scanline at the same time. A lamp's stripes are therefore on the same scanlines in all its
/// parts, whatever its shape. In letters and patterns the parts differ.
///
/// @param lines       image whose rows are the scanlines, see make_scanlines()
/// @param chords      pixels of the light on each scanline, see list_chords_in_ellipse()
/// @param background  dark level and noise of the image
/// @param period_lines  period of the stripes
/// @return  coherence, at most 1; 0 if the light has too few scanlines
///
/// Each scanline is divided into five parts. a_k and b_k are the means of part k over a quarter of
/// a period before and after a scanline. The constant c is half of the noise threshold plus 5 % of
/// the brightest scanline. With
///
///     d_k(line) = log((b_k + c) / (a_k + c)),
///
/// the coherence of part k is the correlation of d_k with the sum of the other parts. The coherence
/// of the light is the second smallest of these, because an object may hide a part.
///
/// Consider independent parts with three independent scanlines, as in one and a half periods. Each
/// reaches kMinCoherence with a probability of (1 - 0.85) / 2, four of five together with 1.5e-4.
/// Tilted bars reach it within 7 degrees if a light shows two of them.
double measure_part_coherence(const ImageView& lines, const std::vector<PixelRun>& chords,
                              const Background& background, double period_lines);

}  // namespace vlp
