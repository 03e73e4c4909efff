// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "lamps/image/image_view.h"
#include "lamps/image/pixel_box.h"
#include "lamps/image/runs.h"

namespace vlp {

/// Minimum period of stripes; the limit of a shutter is two lines.
inline constexpr double kShortestPeriod_lines = 2.2;

/// Minimum contrast of a modulated light, and minimum number of periods of an identified one.
inline constexpr double kMinContrast = 0.2, kMinPeriods = 1.3;

/// Number of periods below which patterns without stripes may look like a lamp by chance.
inline constexpr double kEnoughPeriods = 2.5;

/// Fraction of a disc's height whose lines are used: those at the rim are short and dim.
inline constexpr double kUsedHeight = 0.9;

/// Returns the pixels of a light on each line, without those at its rim. The light is an ellipse in
/// the box from `low` to `high` (column, row) of an image of that size.
std::vector<Run> chords_of(const Eigen::Vector2d& low, const Eigen::Vector2d& high,
                           const ImageSize& size);

/// Computes the level of each chord of a light above the dark, where nothing hides it.
std::vector<double> line_signal(const ImageView& image, const std::vector<Run>& chords,
                                double dark);

struct Stripes {
  /// (bright - dark) / bright of the lines: 0 for steady light, 1 for full stripes.
  double contrast;
  /// Lines from one stripe to the next, and the lit fraction of a period.
  double period_lines;
  double duty;
  /// Fraction of the signal's variance that a sine of that period explains.
  double clarity;
  /// Number of periods in the signal.
  double periods;
  /// Whether all stripes begin and end in time with the period.
  bool regular;
  /// Half of the number of begins and ends of stripes, over the number of lines. The signal passes
  /// the middle between dark and bright there.
  double count_per_line;
  /// Fraction of the disc's area on lines brighter than that middle.
  double lit_area;
};

/// Returns whether the stripes are clear and numerous enough: clarity above 0.7 and kEnoughPeriods.
/// Those of a partly hidden lamp are not.
bool trustworthy(const Stripes& stripes);

/// Returns whether the period is meaningful: the stripes are regular, or their clarity exceeds 0.7.
/// An object that hides a part of a lamp makes stripes of its own, by chance like another lamp's.
bool readable(const Stripes& stripes);

/// Measures the stripes of a signal. The period is that of the sine with a constant that fits best
/// (least squares, Lomb 1976), between kShortestPeriod_lines and the length of the signal. The
/// signal is that of line_signal(): of a disc, from `kUsedHeight` of its radius above the middle to
/// as much below. Without 8 lines or more contrast and clarity are 0.
Stripes stripes_of(const std::vector<double>& signal);

}  // namespace vlp
