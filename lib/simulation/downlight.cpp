// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "simulation/downlight.h"

#include <algorithm>
#include <cmath>

#include "simulation/shapes.h"

namespace vlp {
namespace {

/// End of the halo, in lengths from the rim: 3e-4 of the value at the rim is left there.
constexpr double kHaloLengths = 8;

double compute_wall_fraction(const Recess& recess, double radius_m, const Eigen::Vector2d& at_m) {
  if (!recess.dark_side) return recess.reflector_ratio;
  const DarkSide& dark = *recess.dark_side;
  const Eigen::Vector2d towards(std::cos(dark.azimuth_rad), std::sin(dark.azimuth_rad));
  const double position = std::clamp((1 + at_m.dot(towards) / radius_m) / 2, 0.0, 1.0);
  return recess.reflector_ratio + position * (dark.reflector_ratio - recess.reflector_ratio);
}

/// Returns the added fraction from the chips around a point of the disc. Chips further away add
/// less than 1e-3.
double compute_chip_fraction(const Chips& chips, double radius_m, const Eigen::Vector2d& at_m) {
  constexpr double widths = 1.6;
  const Eigen::Array2d first = ((at_m.array() - widths * chips.width_m) / chips.pitch_m).ceil();
  const Eigen::Array2d last = ((at_m.array() + widths * chips.width_m) / chips.pitch_m).floor();
  double sum = 0;
  for (double row = first.y(); row <= last.y(); ++row) {
    for (double column = first.x(); column <= last.x(); ++column) {
      const Eigen::Vector2d chip_m = chips.pitch_m * Eigen::Vector2d(column, row);
      if (chip_m.norm() > radius_m) continue;
      const double ratio = 2 * (at_m - chip_m).norm() / chips.width_m;
      sum += std::exp2(-ratio * ratio);
    }
  }
  return chips.fraction * sum;
}

double compute_hot_spot_fraction(const std::vector<HotSpot>& hot_spots,
                                 const Eigen::Vector2d& at_m) {
  double sum = 0;
  for (const HotSpot& spot : hot_spots) {
    const double ratio = (at_m - spot.center_m).norm() / spot.sigma_m;
    sum += spot.excess * std::exp(-ratio * ratio / 2);
  }
  return sum;
}

double compute_halo_fraction(const Halo& halo, double radius_m, const Eigen::Vector2d& at_m) {
  const double lengths = std::max(0.0, at_m.norm() - radius_m) / halo.length_m;
  return lengths < kHaloLengths ? halo.fraction * std::exp(-lengths) : 0;
}

}  // namespace

double compute_relative_radiance(const Recess& recess, double radius_m,
                                 const Eigen::Vector3d& eye_m, const Eigen::Vector2d& at_m) {
  if (eye_m.z() >= 0) return 0;
  const Eigen::Vector2d slope = (at_m - eye_m.head<2>()) / -eye_m.z();
  double wall = compute_wall_fraction(recess, radius_m, at_m);
  if (recess.rim_power > 0) wall *= std::pow(at_m.norm() / radius_m, recess.rim_power);
  if (recess.far_side_slope) {
    const double halvings = (slope.norm() + at_m.dot(slope) / radius_m) / 2;
    wall *= std::exp2(-halvings / *recess.far_side_slope);
  }
  const double ratio = 2 * (at_m + recess.depth_m * slope).norm() / recess.source_diameter_m;
  const double cosine = 1 / std::sqrt(1 + slope.squaredNorm());
  const double source =
      std::pow(cosine, recess.beam_power) * std::exp2(-std::pow(ratio, recess.source_power));
  return wall + (1 - wall) * source;
}

double compute_source_radius_m(const Glow& glow) {
  return glow.glow_radius_m() + (glow.halo ? kHaloLengths * glow.halo->length_m : 0);
}

void add_downlight(const PixelRays& rays, const PixelWindow& window,
                   const TargetFromCamera& glow_from_camera, const Glow& glow, cv::Mat1f& image) {
  const double radius_m = glow.glow_radius_m();
  cv::Mat1f inside = window.make_constant_image(0);
  add_shape_to_image(rays, window, glow_from_camera, Disc(*glow.shape.size_m / 2, 1), 1, inside);
  if (!glow.recess) {
    add_shape_to_image(rays, window, glow_from_camera,
                       Disc(*glow.shape.size_m / 2, glow.rim_to_center_ratio),
                       glow.electron_rate_e_per_s, image);
  }
  for (int line = window.line_begin; line < window.line_end; ++line) {
    const Eigen::Isometry3d pose = glow_from_camera(line);
    const Eigen::Vector3d eye_m = pose.translation();
    const auto hit = [&](int at_line, int place) {
      return intersect_plane(eye_m, pose.linear() * rays.pixel_corner_ray(at_line, place));
    };
    for (int place = window.place_begin; place < window.place_end; ++place) {
      const int row = line - window.line_begin, column = place - window.place_begin;
      const double part = inside(row, column);
      if (part == 0 && !glow.halo) continue;
      const Eigen::Vector2d at_m = (hit(line, place) + hit(line, place + 1) + hit(line + 1, place) +
                                    hit(line + 1, place + 1)) /
                                   4;
      if (!at_m.allFinite()) continue;
      double fraction = 0;
      if (glow.recess)
        fraction += part * compute_relative_radiance(*glow.recess, radius_m, eye_m, at_m);
      if (glow.chips) fraction += part * compute_chip_fraction(*glow.chips, radius_m, at_m);
      fraction += part * compute_hot_spot_fraction(glow.hot_spots, at_m);
      if (glow.halo && eye_m.z() < 0)
        fraction += (1 - part) * compute_halo_fraction(*glow.halo, radius_m, at_m);
      image(row, column) += static_cast<float>(glow.electron_rate_e_per_s * fraction);
    }
  }
}

}  // namespace vlp
