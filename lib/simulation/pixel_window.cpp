// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0

#include "simulation/pixel_window.h"

#include <algorithm>
#include <cmath>

#include "geometry/angles.h"
#include "simulation/downlight.h"

namespace vlp {

PixelWindow make_full_window(const PixelRays& rays) {
  const int margin = rays.image_margin_px();
  return {-margin, rays.num_readout_lines() + margin, -margin, rays.pixels_per_line() + margin};
}

PixelWindow compute_moving_window(const std::vector<Eigen::Vector3d>& outline_m,
                                  const BaseMotion& motion, const Shutter& shutter,
                                  const PixelRays& rays) {
  const double begin_s = shutter.sample_begin_s(-rays.image_margin_px());
  const double end_s = shutter.sample_end_s(rays.num_readout_lines() + rays.image_margin_px());
  // Between two samples an arc of 450 px deviates from its chord by less than 0.1 px.
  const double step_rad = rad_from_deg(2);
  constexpr double samples_per_period = 16;
  const double samples_for_vibration =
      motion.vibration.amplitude_rad > 0 ? samples_per_period * motion.vibration.frequency_hz : 0;
  const int samples =
      4 +
      static_cast<int>((std::abs(motion.turn_rate_rad_per_s) / step_rad + samples_for_vibration) *
                       (end_s - begin_s));
  constexpr double max_coordinate = 1e6;
  Eigen::Array2d lower = Eigen::Array2d::Constant(max_coordinate), upper = -lower;
  for (int i = 0; i <= samples; ++i) {
    const double time_s = begin_s + (end_s - begin_s) * i / samples;
    const Eigen::Isometry3d camera_from_world = motion.world_from_camera(time_s).inverse();
    for (const Eigen::Vector3d& point_m : outline_m) {
      const auto pixel = rays.camera_lens().project_point(camera_from_world * point_m);
      if (!pixel) return make_full_window(rays);
      const Eigen::Array2d at =
          rays.to_readout_order(*pixel).array().max(-max_coordinate).min(max_coordinate);
      lower = lower.min(at);
      upper = upper.max(at);
    }
  }
  constexpr int bulge_px = 2;  // bulge of the outline between two points
  const int spare = rays.image_margin_px() + bulge_px;
  const PixelWindow all = make_full_window(rays);
  return {std::max(all.line_begin, int(std::floor(lower[0])) - spare),
          std::min(all.line_end, int(std::ceil(upper[0])) + spare + 1),
          std::max(all.place_begin, int(std::floor(lower[1])) - spare),
          std::min(all.place_end, int(std::ceil(upper[1])) + spare + 1)};
}

PixelWindow intersect_windows(const PixelWindow& a, const PixelWindow& b) {
  return {std::max(a.line_begin, b.line_begin), std::min(a.line_end, b.line_end),
          std::max(a.place_begin, b.place_begin), std::min(a.place_end, b.place_end)};
}

Panel make_bounding_panel(const Glow& glow) {
  const auto at = [&](double x, double y) {
    return transform_shape_point_to_world(glow.shape, glow.position_m, {x, y});
  };
  const Eigen::Vector3d corner_m = at(-1, -1);
  return {corner_m, at(1, -1) - corner_m, at(-1, 1) - corner_m, glow.electron_rate_e_per_s};
}

std::vector<Eigen::Vector3d> list_outline_points(const Glow& glow) {
  return compute_lamp_outline_points(
      glow.halo ? make_disc_lamp_shape(2 * compute_source_radius_m(glow)) : glow.shape,
      glow.position_m, 96);
}

std::vector<Eigen::Vector3d> list_outline_points(const Panel& panel) {
  constexpr int per_edge = 24;
  std::vector<Eigen::Vector3d> points_m;
  for (int i = 0; i <= per_edge; ++i) {
    const double fraction = double(i) / per_edge;
    const Eigen::Vector3d along_a = panel.corner_m + fraction * panel.edge_a_m;
    const Eigen::Vector3d along_b = panel.corner_m + fraction * panel.edge_b_m;
    points_m.insert(points_m.end(),
                    {along_a, along_a + panel.edge_b_m, along_b, along_b + panel.edge_a_m});
  }
  return points_m;
}

double compute_max_motion_px(const std::vector<Eigen::Vector3d>& points_m,
                             const CameraFromTarget& camera_from_target, double exposure_s,
                             const PixelRays& rays) {
  constexpr int pieces = 16;
  const Eigen::Array2d size(rays.num_readout_lines(), rays.pixels_per_line());
  const auto near_image = [&](const Eigen::Vector2d& pixel) {
    const Eigen::Array2d at = rays.to_readout_order(pixel);
    return (at >= -0.1 * size).all() && (at <= 1.1 * size).all();
  };
  std::vector<std::optional<Eigen::Vector2d>> before(points_m.size());
  std::vector<double> lengths_px(points_m.size(), 0);
  for (int piece = 0; piece <= pieces; ++piece) {
    const auto pose = camera_from_target((double(piece) / pieces - 0.5) * exposure_s);
    for (std::size_t i = 0; i < points_m.size(); ++i) {
      const auto pixel = rays.camera_lens().project_point(pose * points_m[i]);
      const bool counts = pixel && before[i] && (near_image(*pixel) || near_image(*before[i]));
      if (counts) lengths_px[i] += (*pixel - *before[i]).norm();
      before[i] = pixel;
    }
  }
  return lengths_px.empty() ? 0 : *std::max_element(lengths_px.begin(), lengths_px.end());
}

int count_time_samples(double motion_px) {
  constexpr double max_motion_px = 0.1, max_parts = 1000;
  return 1 + static_cast<int>(std::min(motion_px / max_motion_px, max_parts - 1));
}

}  // namespace vlp
