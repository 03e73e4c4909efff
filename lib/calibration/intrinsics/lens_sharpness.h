// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "detection/boards/board_detector.h"

namespace vlp {

/// Returns the spatial frequency at which the modulation transfer of a Gaussian blur is 0.5, in
/// cycles per pixel:
///   exp(-2 (pi sigma f)^2) = 0.5,     f = sqrt(ln 2 / 2) / (pi sigma) = 0.1874 / sigma.
/// `sigma_px` is positive. It includes the pixel's own aperture, about 0.29 px.
double compute_mtf50_of_blur(double sigma_px);

/// Computes the sharpness of one view, in cycles per pixel: the MTF50 of the median blur of its tag
/// edges. The median is the upper one. Returns std::nullopt if the blur of no edge is known.
std::optional<double> compute_median_edge_mtf50(const BoardDetection& seen);

/// Sharpness and contrast of lens and pixel together over the image, from the light profiles across
/// tag edges (slanted edges as in ISO 12233). The line spread is a Gaussian with an excess
/// kurtosis.
///
/// Each part of the image has the lower quartile of the blurs of the views there. A shaken or
/// defocused image does therefore not count as a bad lens.
struct LensSharpness {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

  /// Values of equal parts of the image, row by row from the top left; NaN if unknown.
  struct Map {
    int cols, rows;
    std::vector<double> values =
        std::vector<double>(std::size_t(cols) * std::size_t(rows), kUnknown);

    double at(int col, int row) const {
      return values[std::size_t(row) * std::size_t(cols) + std::size_t(col)];
    }
  };
  /// MTF50, cycles per pixel; light of black divided by light of white.
  Map mtf50{12, 9}, black_to_white{12, 9};
  /// Light of white relative to a smooth field over each view, in smaller parts, because specks of
  /// dust are small.
  Map light{24, 18};

  double mean_mtf50 = kUnknown;
  /// Smallest MTF50 of a part of the image divided by the mean.
  double worst_ratio = kUnknown;
  /// Upper bound of the difference of the MTF50 between directions from the middle of the image,
  /// divided by the mean: 2 (|c1| + |c2|) of the terms c1 cos(t - t1) + c2 cos(2 (t - t2)) around
  /// the middle. A centered lens is equally sharp in all directions. A tilted or decentered one is
  /// sharper on one side, or along one axis.
  double asymmetry = kUnknown;
  /// Upper median of black_to_white. Veiling glare raises it.
  double black_level = kUnknown;
  /// Largest fraction by which MTF50 or contrast of a part is below that of the surrounding parts.
  /// A smear raises it.
  double local_loss = kUnknown;
  /// Largest fraction by which the light of a part is below that of the surrounding parts, and the
  /// middle of this part. Dust raises it. NaN if no parts of `light` can be compared.
  double local_shadow = kUnknown;
  Eigen::Vector2d local_shadow_px = Eigen::Vector2d::Zero();
};

/// Measures sharpness and contrast from views of a board of AprilTags, with corners corrected for
/// the tone curve (correct_tone_curve()). Returns std::nullopt if fewer than half of
/// the parts of the image are known, from at least five views each. This is always so for boards
/// with corner squares and for boards of squares.
std::optional<LensSharpness> measure_sharpness(std::span<const BoardView> views,
                                               const std::array<int, 2>& imager_px);

}  // namespace vlp
