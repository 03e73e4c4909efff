// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "lamps/image/image_view.h"
#include "lamps/image/pixel_box.h"
#include "lamps/image/runs.h"

namespace vlp {

/// The shortest period that stripes are looked for with: two lines would be all that a shutter can
/// show.
inline constexpr double kShortestPeriod_lines = 2.2;

/// The least of what flickers, and of what can be identified: see Stripes.
inline constexpr double kLeastContrast = 0.2, kLeastPeriods = 1.3;

/// With fewer periods things that have no stripes look like a lamp now and then: a period that is
/// seen once or twice is hardly seen to repeat.
inline constexpr double kEnoughPeriods = 2.5;

/// The share of a disc's height whose lines are used: those at the rim are short and dim.
inline constexpr double kUsedHeight = 0.9;

/// The pixels that a light has on each line, without those at its rim. The light is an ellipse in
/// the box from `low` to `high` (column, row) of an image of that size.
std::vector<Run> chords_of(const Eigen::Vector2d& low, const Eigen::Vector2d& high,
                           const ImageSize& size);

/// How bright each chord of a light is, above the dark, where nothing hides it.
std::vector<double> line_signal(const ImageView& image, const std::vector<Run>& chords,
                                double dark);

struct Stripes {
  /// (bright - dark) / bright of the lines: 0 for steady light, 1 for full stripes.
  double contrast;
  /// Lines from one stripe to the next, and the lit share of it.
  double period_lines;
  double duty;
  /// Share of the signal's variance that a sine of that period explains.
  double clarity;
  /// How many periods the signal shows.
  double periods;
  /// Whether all stripes begin and end in time with the period.
  bool regular;
  /// How many stripes begin or end, half of it, over the lines: once a stripe passes the middle
  /// between dark and bright upwards, and once downwards.
  double count_per_line;
  /// Share of the disc's area that lies on lines brighter than that middle.
  double lit_area;
};

/// Whether the stripes are clear and many enough for what is measured to be trusted: clarity above
/// 0.7 and kEnoughPeriods. Of a lamp that something hides in part they are not.
bool trustworthy(const Stripes& stripes);

/// Whether the period means anything: the stripes are regular, or clearer than that. Something that
/// hides a part of a lamp makes stripes of its own, and by chance like another lamp's.
bool readable(const Stripes& stripes);

/// The period is that of the sine with a constant that fits best (least squares, Lomb 1976),
/// between kShortestPeriod_lines and the length of the signal. The signal is that of line_signal():
/// of a disc, from `kUsedHeight` of its radius above the middle to as much below. Without 8 lines
/// or more contrast and clarity are 0.
Stripes stripes_of(const std::vector<double>& signal);

}  // namespace vlp
