// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "captures/fixes_table.h"
#include "evaluation/errors/error_figures.h"

namespace vlp {

/// A straight line that was commanded: from here to there.
using CommandedLine = std::array<Eigen::Vector2d, 2>;

/// A straight line through fixes, and how far it is from the commanded one.
struct LineFit {
  /// Where the fixes begin and end along it: the feet of the outermost, in the order of the
  /// commanded line.
  CommandedLine line_m;
  /// From the commanded line's direction, counter-clockwise, within 90 degrees.
  double angle_rad;
  /// Root of the mean squared distance of the fixes from the fitted line: the jitter that the fit
  /// hides.
  double jitter_m;
  /// Distances from the commanded line, of kLineSamples points along the fitted one.
  ErrorFigures distances_m;
  std::vector<std::pair<double, double>> distribution_m;
};

inline constexpr int kLineSamples = 1001;

/// The protocol of Chen and Guan, section 4, for a moving camera: "errors against the commanded
/// line after a least-squares line fit". The line has the smallest sum of squared distances of the
/// fixes from it, perpendicular to it (orthogonal least squares, which serves a line in any
/// direction): through their mean, along the eigenvector of the larger eigenvalue of their scatter
/// matrix. kLineSamples points are taken at equal distances along it, from the foot of the first
/// fix to that of the last, and each one's error is its distance from the nearest point of the
/// commanded line, which ends where it was commanded to end.
///
/// Averaging over a whole drive takes the jitter of single fixes out of these figures, and the
/// error along the line does not show in them: see also errors_against_path(). Nothing when there
/// are fewer than two fixes, or when their spread has no direction (the larger eigenvalue is less
/// than twice the smaller).
std::optional<LineFit> fit_line(const std::vector<FixRow>& fixes, const CommandedLine& commanded_m);

}  // namespace vlp
