// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

namespace vlp {

/// Range of valid standard deviations of a pixel; values outside indicate a mistake.
inline constexpr double kMinSigma_px = 1e-4;
inline constexpr double kMaxSigma_px = 1e3;

/// Lamp that was detected and identified in one image.
struct Detection {
  /// Id of the lamp in the lamp map.
  int lamp;
  /// Pixel (u, v) of the lamp's center; the center of the top left pixel is (0, 0).
  Eigen::Vector2d pixel;
  /// Standard deviation of `pixel` per axis, from kMinSigma_px to kMaxSigma_px; std::nullopt if the
  /// detector does not report it.
  std::optional<double> sigma_px;
};

}  // namespace vlp
