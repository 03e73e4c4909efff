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

/// Commanded straight line: its start and end (x, y) in the world, m.
using CommandedLine = std::array<Eigen::Vector2d, 2>;

/// Straight line fitted to the horizontal positions of fixes. Has its angle to the commanded line,
/// and the distances of points along it from the commanded line. Result of fit_line_to_fixes().
struct LineFit {
  /// First and last perpendicular foot of the fixes on the line, in the direction of the commanded
  /// line.
  CommandedLine line_m;
  /// Angle from the commanded line's direction to the fitted line, counter-clockwise seen from
  /// above, within 90 degrees.
  double angle_rad;
  /// RMS distance of the fixes from the fitted line: the jitter that the fit averages out.
  double jitter_m;
  /// Distances from the commanded line, for kLineSamples points along the fitted line.
  ErrorStatistics distances_m;
  std::vector<std::pair<double, double>> distribution_m;
};

inline constexpr int kLineSamples = 1001;

/// Fits a line to fixes and compares it with the commanded line: the protocol of Chen and Guan,
/// section 4, for a moving camera, "errors against the commanded line after a least-squares line
/// fit".
///
/// The line minimizes the sum of squared perpendicular distances (orthogonal least squares, valid
/// for any direction). It passes through the mean of the fixes, along the eigenvector of the larger
/// eigenvalue of their scatter matrix. kLineSamples points lie at equal distances along it, from
/// the foot of the first fix to that of the last. The error of a point is its distance from the
/// nearest point of the commanded line, which ends at the commanded ends.
///
/// Averaging over a drive removes the jitter of single fixes from these statistics. Errors along
/// the line are not visible: see also compare_with_path().
///
/// Returns std::nullopt for fewer than two fixes, or if their distribution has no direction (larger
/// eigenvalue less than twice the smaller).
std::optional<LineFit> fit_line_to_fixes(const std::vector<FixRow>& fixes,
                                         const CommandedLine& commanded_m);

}  // namespace vlp
