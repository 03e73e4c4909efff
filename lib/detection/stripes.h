// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

namespace vlp {

/// How bright each line of a light is, from its first line on, above the dark, where nothing hides
/// the line. The light is an ellipse in the box from `low` to `high` (column, row).
std::vector<double> line_signal(const cv::Mat& image, const Eigen::Vector2d& low,
                                const Eigen::Vector2d& high, double dark);

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
};

/// The period is that of the sine with a constant that fits best (least squares, Lomb 1976),
/// between 2.2 lines and the length of the signal. Without 8 lines or more contrast and clarity are
/// 0.
Stripes stripes_of(const std::vector<double>& signal);

}  // namespace vlp
