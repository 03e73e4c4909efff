// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "camera/lens.h"
#include "lamps/light_detector.h"
#include "lamps/shape/drawn_disc.h"
#include "lamps/shape/light_center.h"
#include "rig/lamp_map.h"
#include "support/random.h"

namespace vlp {

/// Square wave as scanlines record it, each with an exposure of several line times.
struct DrawnStripes {
  double period_lines = 11, duty = 0.5;
  double phase = 0.3;  // in periods
  double exposure_lines = 1.7;

  /// Returns the lit fraction of a scanline's exposure.
  double lit(double line) const {
    const auto lit_until = [&](double at) {
      const double periods = at / period_lines + phase, whole = std::floor(periods);
      return (whole * duty + std::min(periods - whole, duty)) * period_lines;
    };
    const double half = exposure_lines / 2;
    return (lit_until(line + half) - lit_until(line - half)) / exposure_lines;
  }
};

/// Dark bar across a lamp, at the distance `offset_px` from its center.
struct DrawnBar {
  double angle_rad, offset_px, width_px;
};

/// Returns the value of a blurred unit step at the distance `into_px` behind it.
inline double blurred_step(double into_px, double blur_px) {
  return std::erfc(-into_px / (blur_px * std::numbers::sqrt2)) / 2;
}

/// Light without an edge: decreases from its middle as exp((core - sqrt(r^2 + core^2)) / fall).
struct DrawnGlow {
  double fall_px = 13, core_px = 10;
};

/// Source deep in a reflector. Its walls have a fraction of the lamp's level, and a core off the
/// middle has the full level. The ceiling around has a fraction that decreases with the distance
/// from the rim.
struct DrawnRecess {
  Eigen::Vector2d core_off_px{6, 14};
  double core_px = 14, walls = 0.1, halo = 0.02, halo_px = 12;
};

/// Striped disc, glowing bulb, or downlight.
struct DrawnLamp {
  Eigen::Vector2d center{101.3, 79.6};
  double radius_px = 38.4, blur_px = 0.8;
  double level = 0.7;  // fraction of white, above the dark level
  DrawnStripes stripes = {};
  std::optional<DrawnBar> bar = {};
  std::optional<DrawnGlow> glow = {};
  std::optional<DrawnRecess> recess = {};

  double light(const Eigen::Vector2d& pixel) const {
    const Eigen::Vector2d away = pixel - center;
    double light = level * stripes.lit(pixel.y());
    if (glow) {
      const double beyond_px = std::hypot(away.norm(), glow->core_px) - glow->core_px;
      light *= std::exp(-beyond_px / glow->fall_px);
    } else if (recess) {
      const double inside = blurred_step(radius_px - away.norm(), blur_px);
      const double core =
          std::exp(-(away - recess->core_off_px).squaredNorm() / 2 / std::pow(recess->core_px, 2));
      const double beyond_px = std::max(0.0, away.norm() - radius_px);
      light *= inside * (recess->walls + (1 - recess->walls) * core) +
               (1 - inside) * recess->halo * std::exp(-beyond_px / recess->halo_px);
    } else {
      light *= blurred_step(radius_px - away.norm(), blur_px);
    }
    if (bar) {
      const Eigen::Vector2d across(-std::sin(bar->angle_rad), std::cos(bar->angle_rad));
      const double beside_px = std::abs(across.dot(away) - bar->offset_px) - bar->width_px / 2;
      light *= blurred_step(beside_px, blur_px);
    }
    return light;
  }
};

/// Renders lamps on a dark image with normal noise of `noise_of_255` of 255 gray levels.
inline cv::Mat render_lamps(const std::vector<DrawnLamp>& lamps, const cv::Size& size, int depth,
                            double noise_of_255 = 0, std::uint64_t seed = 1) {
  const double white = depth == CV_8U ? 255 : 65535;
  Random random(seed);
  cv::Mat1d light(size);
  for (int row = 0; row < light.rows; ++row) {
    for (int column = 0; column < light.cols; ++column) {
      double fraction = kDark + noise_of_255 / 255 * random.normal();
      for (const DrawnLamp& lamp : lamps) fraction += lamp.light(Eigen::Vector2d(column, row));
      light(row, column) = white * fraction;
    }
  }
  cv::Mat image;
  light.convertTo(image, depth);
  return image;
}

constexpr double kDrawnRowTime_s = 3e-5;

/// Returns a camera that looks straight up, with a lens without distortion.
inline DetectorCamera drawn_camera(const cv::Size& size) {
  const std::vector<double> intrinsics = {520, 520, (size.width - 1) / 2.0,
                                          (size.height - 1) / 2.0};
  return {Readout::rows, kDrawnRowTime_s, Lens(LensModel::pinhole, intrinsics)};
}

/// Returns a lamp with stripes of this period for drawn_camera().
inline Lamp drawn_lamp(int id, double period_lines) {
  return {id, {0.2 * id, 0, 1.6}, {}, 1 / (period_lines * kDrawnRowTime_s), 0.5};
}

}  // namespace vlp
