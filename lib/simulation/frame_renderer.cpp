// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "simulation/frame_renderer.h"

#include <cmath>
#include <variant>
#include <vector>

#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

#include "rig/board_layout.h"
#include "simulation/coverage.h"
#include "simulation/downlight.h"
#include "simulation/pixel_window.h"
#include "simulation/scene.h"
#include "simulation/shapes.h"

namespace vlp {

namespace {

cv::Mat1f compute_vignetting(const PixelRays& rays, double power) {
  cv::Mat1f image(rays.num_readout_lines(), rays.pixels_per_line());
  for (int line = 0; line < rays.num_readout_lines(); ++line) {
    for (int place = 0; place < rays.pixels_per_line(); ++place) {
      const Eigen::Vector3d ray = rays.pixel_corner_ray(line, place).normalized() +
                                  rays.pixel_corner_ray(line, place + 1).normalized() +
                                  rays.pixel_corner_ray(line + 1, place).normalized() +
                                  rays.pixel_corner_ray(line + 1, place + 1).normalized();
      const double cosine = ray.normalized().z();
      // Rays beyond 90 degrees off the axis arrive only without vignetting. NaN: the pixel has no
      // ray.
      const double fraction = cosine > 0                  ? std::pow(cosine, power)
                              : power == 0 && cosine <= 0 ? 1
                                                          : 0;
      image(line, place) = static_cast<float>(fraction);
    }
  }
  return image;
}

}  // namespace

FrameRenderer::FrameRenderer(const Scene& scene)
    : scene_(scene),
      rays_(scene.camera, compute_blur_radius_px(scene.optics)),
      optics_(scene.optics, rays_),
      transmission_(compute_vignetting(rays_, scene.optics.vignetting_power)) {
  transmission_ = transmission_.mul(compute_transmission(scene.optics.dust, rays_));
  if (scene.board) pattern_.emplace(*scene.board);
}

cv::Mat1f FrameRenderer::integrate_electrons(const cv::Mat1f& electrons_per_s,
                                             double exposure_s) const {
  return cv::Mat1f(rays_.crop_image_margin(electrons_per_s).mul(transmission_, exposure_s));
}

namespace {

Eigen::Isometry3d compute_panel_from_world(const Panel& panel) {
  Eigen::Isometry3d world_from_panel;
  const Eigen::Vector3d a = panel.edge_a_m.normalized(), b = panel.edge_b_m.normalized();
  world_from_panel.linear() << a, b, a.cross(b);
  world_from_panel.translation() = panel.corner_m;
  return world_from_panel.inverse();
}

std::vector<Eigen::AlignedBox2d> make_window_bars(const Blind& blind) {
  std::vector<Eigen::AlignedBox2d> bars;
  bars.reserve(std::size_t(blind.slats));
  for (int slat = 0; slat < blind.slats; ++slat) {
    bars.emplace_back(Eigen::Vector2d(0, double(slat) / blind.slats),
                      Eigen::Vector2d(1, (slat + blind.open_fraction) / blind.slats));
  }
  return bars;
}

/// Returns a mosaic with the value 1 in boxes of a panel, given as fractions of its edges.
RectanglePattern make_panel_mosaic(const Panel& panel,
                                   const std::vector<Eigen::AlignedBox2d>& boxes) {
  const Eigen::Vector2d size_m(panel.edge_a_m.norm(), panel.edge_b_m.norm());
  std::vector<Rectangle> rectangles;
  for (const Eigen::AlignedBox2d& box : boxes) {
    const Eigen::Vector2d from_m = box.min().cwiseProduct(size_m);
    const Eigen::Vector2d to_m = box.max().cwiseProduct(size_m);
    rectangles.push_back({from_m.x(), from_m.y(), to_m.x(), to_m.y(), 1});
  }
  return RectanglePattern(rectangles);
}

RectanglePattern make_panel_mosaic(const Panel& panel) {
  return RectanglePattern({{0, 0, panel.edge_a_m.norm(), panel.edge_b_m.norm(), 1}});
}

/// Light with its wave in a capture.
struct Source {
  const Glow& glow;
  LightWave wave;
};

/// Lists the lights that are switched, or that a mirror shows.
std::vector<Source> list_sources(const Scene& scene, const LampShot& shot, bool in_mirror) {
  constexpr RectifiedSine always_on{1, 0, 0};
  const Clutter& clutter = scene.clutter;
  std::vector<Source> sources;
  for (std::size_t i = 0; i < scene.lamps.size(); ++i) {
    sources.push_back({scene.lamps[i].glow, shot.waves[i]});
  }
  if (in_mirror) {
    for (const Glow& lamp : clutter.steady_lamps) sources.push_back({lamp, always_on});
  } else {
    for (const Reflection& each : clutter.reflections) {
      sources.push_back({each.glow, shot.waves[each.lamp]});
    }
  }
  for (std::size_t i = 0; i < clutter.foreign_lights.size(); ++i) {
    sources.push_back({clutter.foreign_lights[i].glow, shot.foreign_waves[i]});
  }
  return sources;
}

/// Light on the sensor during one part of an exposure, in electrons per second, without vignetting.
/// Direct light, or the light reflected by a mirror.
class LampFrame {
 public:
  LampFrame(const Scene& scene, const PixelRays& rays, const PointSpread& optics,
            const LampShot& shot, const Shutter& part, const Mirror* mirror = nullptr)
      : scene_(scene),
        rays_(rays),
        optics_(optics),
        shot_(shot),
        motion_(shot.motion),
        part_(part) {
    if (!scene.clutter.occluders.empty() || mirror) transmittance_ = rays_.make_padded_image(1);
    for (const Panel& occluder : scene.clutter.occluders) {
      transmittance_ = transmittance_.mul(1 - render_coverage(occluder));
    }
    if (!mirror) return;
    transmittance_ = transmittance_.mul(mirror->reflectance * render_coverage(mirror->pane));
    pane_window_ = compute_moving_window(list_outline_points(mirror->pane), motion_, part_, rays_);
    mirror_ = mirror;
    reflection_ = make_reflection_transform(mirror->pane);
  }

  /// Returns the light of all sources that are always on.
  cv::Mat1f render_steady_light() const {
    const Clutter& clutter = scene_.clutter;
    cv::Mat1f image = render_ceiling();
    if (clutter.windows.empty() && clutter.steady_lamps.empty() && clutter.occluders.empty() &&
        clutter.blinds.empty() && clutter.signs.empty()) {
      return image;
    }
    for (const Panel& window : clutter.windows) {
      replace_ceiling(window, make_panel_mosaic(window), image);
    }
    for (const Blind& blind : clutter.blinds) {
      replace_ceiling(blind.window, make_panel_mosaic(blind.window, make_window_bars(blind)),
                      image);
    }
    for (const Sign& sign : clutter.signs) {
      replace_ceiling(sign.panel, make_panel_mosaic(sign.panel, sign.strokes), image);
    }
    for (const Glow& lamp : clutter.steady_lamps) {
      const PixelWindow window = compute_light_window(lamp);
      if (!window.is_empty_window())
        render_light(lamp, window, window.crop(image, rays_.image_margin_px()));
    }
    for (const Panel& occluder : clutter.occluders) {
      const cv::Mat1f hidden = render_coverage(occluder);
      image = image.mul(1 - hidden) + occluder.electron_rate_e_per_s * hidden;
    }
    optics_.apply_point_spread(image, {-rays_.image_margin_px(), -rays_.image_margin_px()});
    optics_.add_veiling_glare(image);
    return image;
  }

  /// Adds a switched light. In a mirror: only lights on the camera's side of its plane.
  void add(const Source& source, cv::Mat1f& image) const {
    const Eigen::Vector3d eye_m = motion_.world_from_camera(0).translation();
    if (mirror_ && !are_on_same_side(*mirror_, source.glow.position_m, eye_m)) return;
    const PixelWindow window = compute_light_window(source.glow);
    if (window.is_empty_window()) return;
    cv::Mat1f patch = window.make_constant_image(0);
    render_light(source.glow, window, patch);
    if (!transmittance_.empty())
      patch = patch.mul(window.crop(transmittance_, rays_.image_margin_px()));
    optics_.apply_point_spread(patch, {window.line_begin, window.place_begin});
    // Light that a veil scatters to all pixels.
    if (const float scattered_e_per_s = optics_.extract_glare(patch); scattered_e_per_s != 0) {
      for (int row = 0; row < image.rows; ++row) {
        image.row(row) += compute_mean_light_fraction(source.wave, row - rays_.image_margin_px()) *
                          scattered_e_per_s;
      }
    }
    cv::Mat1f target = window.crop(image, rays_.image_margin_px());
    for (int line = window.line_begin; line < window.line_end; ++line) {
      const int row = line - window.line_begin;
      target.row(row) += compute_mean_light_fraction(source.wave, line) * patch.row(row);
    }
  }

 private:
  double compute_mean_light_fraction(const LightWave& wave, int line) const {
    return std::visit(
        [&](const auto& each) {
          return each.compute_mean_light_fraction(part_.sample_begin_s(line),
                                                  part_.sample_end_s(line));
        },
        wave);
  }

  /// Returns the ceiling's radiance while a line is exposed.
  double compute_ceiling_radiance(int line) const {
    if (!scene_.clutter.ambient_flicker) return scene_.ambient_e_per_s;
    RectifiedSine wave = *scene_.clutter.ambient_flicker;
    wave.phase = shot_.ambient_phase;
    return scene_.ambient_e_per_s * compute_mean_light_fraction(wave, line);
  }

  cv::Mat1f render_ceiling() const {
    cv::Mat1f image = rays_.make_padded_image(0);
    for (int row = 0; row < image.rows; ++row) {
      image.row(row) = static_cast<float>(compute_ceiling_radiance(row - rays_.image_margin_px()));
    }
    return image;
  }

  /// Replaces the radiance of the ceiling by that of a panel where the pattern is 1.
  void replace_ceiling(const Panel& panel, const RectanglePattern& pattern,
                       cv::Mat1f& image) const {
    const PixelWindow window =
        compute_moving_window(list_outline_points(panel), motion_, part_, rays_);
    if (window.is_empty_window()) return;
    cv::Mat1f cover = window.make_constant_image(0);
    add_shape_to_image(rays_, window, compute_target_from_camera(compute_panel_from_world(panel)),
                       pattern, 1, cover);
    cv::Mat1f target = window.crop(image, rays_.image_margin_px());
    for (int line = window.line_begin; line < window.line_end; ++line) {
      const int row = line - window.line_begin;
      target.row(row) +=
          (panel.electron_rate_e_per_s - compute_ceiling_radiance(line)) * cover.row(row);
    }
  }
  /// Returns the fraction of each pixel that a panel covers.
  cv::Mat1f render_coverage(const Panel& panel) const {
    cv::Mat1f covered = rays_.make_padded_image(0);
    const PixelWindow window =
        compute_moving_window(list_outline_points(panel), motion_, part_, rays_);
    if (!window.is_empty_window())
      render_light(panel, 1, window, window.crop(covered, rays_.image_margin_px()));
    return covered;
  }
  PixelWindow compute_light_window(const Glow& glow) const {
    auto outline_m = list_outline_points(glow);
    if (!mirror_) return compute_moving_window(outline_m, motion_, part_, rays_);
    for (Eigen::Vector3d& point_m : outline_m) point_m = reflection_ * point_m;
    return intersect_windows(compute_moving_window(outline_m, motion_, part_, rays_), pane_window_);
  }
  /// Returns the pose of the camera in a target's frame; for a mirror, of the reflected camera.
  TargetFromCamera compute_target_from_camera(const Eigen::Isometry3d& target_from_world) const {
    return [this, target_from_rays = target_from_world * reflection_](int line) {
      return target_from_rays * motion_.world_from_camera(part_.part_middle_s(line));
    };
  }
  /// Draws a glow. `target` is the window's part of an image.
  void render_light(const Glow& glow, const PixelWindow& window, cv::Mat1f target) const {
    if (!get_lamp_shape_traits(glow.shape.kind).is_round) {
      const Panel panel = make_bounding_panel(glow);
      if (glow.rim_to_center_ratio == 1)
        return render_light(panel, glow.electron_rate_e_per_s, window, target);
      cv::Mat1f patch = window.make_constant_image(0);
      render_light(panel, glow.electron_rate_e_per_s, window, patch);
      apply_panel_falloff(panel, glow.rim_to_center_ratio, window, patch);
      target += patch;
      return;
    }
    const Eigen::Isometry3d world_from_glow =
        Eigen::Translation3d(glow.position_m) *
        Eigen::AngleAxisd(glow.shape.yaw_rad, Eigen::Vector3d::UnitZ());
    const TargetFromCamera glow_from_camera = compute_target_from_camera(world_from_glow.inverse());
    if (glow.recess || glow.chips || !glow.hot_spots.empty() || glow.halo) {
      add_downlight(rays_, window, glow_from_camera, glow, target);
      return;
    }
    add_shape_to_image(rays_, window, glow_from_camera,
                       Disc(*glow.shape.size_m / 2, glow.rim_to_center_ratio),
                       glow.electron_rate_e_per_s, target);
  }
  /// Applies the falloff of Glow towards the edges of a panel, evaluated at each pixel's center.
  void apply_panel_falloff(const Panel& panel, double rim_to_center_ratio,
                           const PixelWindow& window, cv::Mat1f& patch) const {
    const TargetFromCamera panel_from_camera =
        compute_target_from_camera(compute_panel_from_world(panel));
    const Eigen::Array2d size_m(panel.edge_a_m.norm(), panel.edge_b_m.norm());
    for (int line = window.line_begin; line < window.line_end; ++line) {
      const Eigen::Isometry3d pose = panel_from_camera(line);
      for (int place = window.place_begin; place < window.place_end; ++place) {
        float& value = patch(line - window.line_begin, place - window.place_begin);
        if (value == 0) continue;
        const Eigen::Vector3d middle =
            rays_.pixel_corner_ray(line, place) + rays_.pixel_corner_ray(line + 1, place + 1);
        const Eigen::Vector2d at_m = intersect_plane(pose.translation(), pose.linear() * middle);
        const Eigen::Array2d off = 2 * at_m.array() / size_m - 1;
        const Eigen::Array2d left = (1 - (1 - rim_to_center_ratio) * off.square()).max(0);
        value *= static_cast<float>(left.prod());
      }
    }
  }
  /// Draws a panel. `target` is the window's part of an image.
  void render_light(const Panel& panel, double value, const PixelWindow& window,
                    cv::Mat1f target) const {
    add_shape_to_image(rays_, window, compute_target_from_camera(compute_panel_from_world(panel)),
                       make_panel_mosaic(panel), value, target);
  }

  const Scene& scene_;
  const PixelRays& rays_;
  const PointSpread& optics_;
  const LampShot& shot_;
  const BaseMotion& motion_;
  const Shutter& part_;
  /// Fraction of each pixel's light that is not hidden by an occluder, times the reflectance of the
  /// pane for a mirror. Empty if all light arrives.
  cv::Mat1f transmittance_;
  const Mirror* mirror_ = nullptr;
  PixelWindow pane_window_{};
  Eigen::Isometry3d reflection_ = Eigen::Isometry3d::Identity();
};

/// Returns points on the outlines of everything in view, for compute_max_motion_px().
std::vector<Eigen::Vector3d> collect_outlines(const Scene& scene) {
  std::vector<Eigen::Vector3d> points_m;
  const auto add = [&](const auto& thing) {
    const auto outline_m = list_outline_points(thing);
    points_m.insert(points_m.end(), outline_m.begin(), outline_m.end());
  };
  for (const SceneLamp& lamp : scene.lamps) add(lamp.glow);
  for (const Glow& lamp : scene.clutter.steady_lamps) add(lamp);
  for (const Reflection& reflection : scene.clutter.reflections) add(reflection.glow);
  for (const Panel& window : scene.clutter.windows) add(window);
  for (const Panel& occluder : scene.clutter.occluders) add(occluder);
  for (const ForeignLight& light : scene.clutter.foreign_lights) add(light.glow);
  for (const Mirror& mirror : scene.clutter.mirrors) add(mirror.pane);
  for (const Blind& blind : scene.clutter.blinds) add(blind.window);
  for (const Sign& sign : scene.clutter.signs) add(sign.panel);
  return points_m;
}

}  // namespace

cv::Mat1f FrameRenderer::render_lamps(const LampShot& shot) const {
  Shutter part = make_rolling_shutter(shot.exposure_s);
  if (!shot.motion.is_base_at_rest()) {
    const auto pose = [&](double time_s) {
      return shot.motion.world_from_camera(time_s).inverse();
    };
    part.count = count_time_samples(
        compute_max_motion_px(collect_outlines(scene_), pose, shot.exposure_s, rays_));
  }
  cv::Mat1f sum = rays_.make_padded_image(0);
  for (; part.index < part.count; ++part.index) {
    const LampFrame frame(scene_, rays_, optics_, shot, part);
    sum += frame.render_steady_light();
    for (const Source& source : list_sources(scene_, shot, false)) frame.add(source, sum);
    for (const Mirror& mirror : scene_.clutter.mirrors) {
      const LampFrame mirrored(scene_, rays_, optics_, shot, part, &mirror);
      for (const Source& source : list_sources(scene_, shot, true)) mirrored.add(source, sum);
    }
  }
  return integrate_electrons(sum, shot.exposure_s / part.count);
}

namespace {

/// Returns points all over the board, for compute_max_motion_px().
std::vector<Eigen::Vector3d> sample_surface_points(const Board& board) {
  std::vector<Eigen::Vector3d> points_m;
  if (board.has_squares()) {
    for (const Eigen::Vector2d& at_m : list_inner_corners_m(board)) {
      points_m.emplace_back(at_m.x(), at_m.y(), 0);
    }
    return points_m;
  }
  for (const BoardTag& tag : list_board_tags(board)) {
    points_m.emplace_back(tag.corners_m[0].x(), tag.corners_m[0].y(), 0);
    points_m.emplace_back(tag.corners_m[2].x(), tag.corners_m[2].y(), 0);
  }
  return points_m;
}

}  // namespace

cv::Mat1f FrameRenderer::render_board(const BoardShot& shot) const {
  Shutter part = make_rolling_shutter(shot.exposure_s);
  if (!shot.velocity_in_camera_m_per_s.isZero(0)) {
    const auto pose = [&](double time_s) { return shot.camera_from_board(time_s); };
    part.count = count_time_samples(compute_max_motion_px(
        sample_surface_points(scene_.board->pattern), pose, shot.exposure_s, rays_));
  }
  const auto surround = static_cast<float>(scene_.board->surround_e_per_s);
  const cv::Size pixels = rays_.make_padded_image(0).size();
  cv::Mat1f supersampled(2 * pixels.height, 2 * pixels.width, surround), image;
  for (; part.index < part.count; ++part.index) {
    const auto board_from_camera = [&](int line) {
      return shot.camera_from_board(part.part_middle_s(line)).inverse();
    };
    add_shape_to_image(rays_, make_full_window(rays_), board_from_camera, *pattern_,
                       1.0 / part.count, supersampled, 2);
  }
  optics_.apply_point_spread(supersampled, {-rays_.image_margin_px(), -rays_.image_margin_px(), 2});
  cv::resize(supersampled, image, pixels, 0, 0, cv::INTER_AREA);
  optics_.add_veiling_glare(image);
  return integrate_electrons(image, shot.exposure_s);
}

}  // namespace vlp
