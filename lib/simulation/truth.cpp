// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0

#include "simulation/truth.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "captures/csv_writer.h"
#include "captures/number_text.h"
#include "geometry/angles.h"
#include "rig/board_layout.h"
#include "simulation/board_print.h"
#include "simulation/scene.h"

namespace vlp {
namespace {

struct ImagePoint {
  Eigen::Vector2d pixel;
  double time_s;
};

/// Returns pixel and time of a moving point: the time at which the pixel's line is exposed.
/// `camera_from_target` is a function of the time.
///
/// Returns std::nullopt if the lens does not describe the point. The same if it moves along with
/// the readout, so fast that there is no such time.
template <typename Motion>
std::optional<ImagePoint> find_image_point(const FrameRenderer& renderer, const Shutter& shutter,
                                           const Motion& camera_from_target,
                                           const Eigen::Vector3d& point_m) {
  constexpr double tolerance_px = 1e-7;
  std::optional<Eigen::Vector2d> before;
  double time_s = 0;
  // Each iteration multiplies the error by the lines that the point moves in a row time.
  for (int iteration = 0; iteration < 200; ++iteration) {
    const auto pixel =
        renderer.pixel_rays().camera_lens().project_point(camera_from_target(time_s) * point_m);
    if (!pixel) return std::nullopt;
    if (before && (*pixel - *before).norm() < tolerance_px) return ImagePoint{*pixel, time_s};
    before = pixel;
    time_s = shutter.line_center_s(renderer.pixel_rays().to_readout_order(*pixel)[0]);
  }
  return std::nullopt;
}

bool is_in_image(const Camera& camera, const Eigen::Vector2d& pixel) {
  return pixel.minCoeff() >= -0.5 && pixel.x() < camera.imager_px[0] - 0.5 &&
         pixel.y() < camera.imager_px[1] - 0.5;
}

bool is_point_hidden_by(const Panel& panel, const Eigen::Vector3d& eye_m,
                        const Eigen::Vector3d& point_m) {
  const Eigen::Vector3d normal = panel.edge_a_m.cross(panel.edge_b_m);
  const Eigen::Vector3d displacement = point_m - eye_m;
  const double fraction = normal.dot(panel.corner_m - eye_m) / normal.dot(displacement);
  if (!(fraction > 0 && fraction < 1)) return false;
  const Eigen::Vector3d on_panel = eye_m + fraction * displacement - panel.corner_m;
  const double a = on_panel.dot(panel.edge_a_m) / panel.edge_a_m.squaredNorm();
  const double b = on_panel.dot(panel.edge_b_m) / panel.edge_b_m.squaredNorm();
  return a >= 0 && a <= 1 && b >= 0 && b <= 1;
}

/// Points spread evenly over a glow, and around its rim.
struct GlowPoints {
  std::vector<Eigen::Vector3d> face_m, rim_m;
};

GlowPoints sample_surface_points(const Glow& glow) {
  constexpr int count = 200, per_side = 14, rim_points = 120;
  constexpr double golden_angle = std::numbers::pi * (3 - 2.2360679774997896964);
  GlowPoints points;
  const auto add = [&](const Eigen::Vector2d& at) {
    points.face_m.push_back(transform_shape_point_to_world(glow.shape, glow.position_m, at));
  };
  if (get_lamp_shape_traits(glow.shape.kind).is_round) {
    for (int i = 0; i < count; ++i) {
      const double radius = std::sqrt((i + 0.5) / count), angle = golden_angle * i;
      add(radius * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    }
  } else {
    for (int i = 0; i < per_side * per_side; ++i) {
      const Eigen::Array2d cell(i % per_side, i / per_side);
      add(2 * (cell + 0.5) / per_side - 1);
    }
  }
  points.rim_m = compute_lamp_outline_points(glow.shape, glow.position_m, rim_points);
  return points;
}

/// Image of a glow's center and the visible fraction of the glow, directly or by a mirror.
struct GlowImage {
  Eigen::Vector2d pixel;
  double visible_fraction;
};

template <typename Motion>
double compute_visible_fraction(const Scene& scene, const FrameRenderer& renderer,
                                const Shutter& shutter, const Motion& camera_from_world,
                                const Glow& glow, const Mirror* mirror) {
  Eigen::Isometry3d reflection = Eigen::Isometry3d::Identity();
  if (mirror) reflection = make_reflection_transform(mirror->pane);
  const auto visible = [&](const Eigen::Vector3d& glow_point_m) {
    const Eigen::Vector3d point_m = reflection * glow_point_m;
    const auto at = find_image_point(renderer, shutter, camera_from_world, point_m);
    if (!at || !is_in_image(scene.camera, at->pixel)) return false;
    const Eigen::Vector3d eye_m = camera_from_world(at->time_s).inverse().translation();
    if (mirror && !is_point_hidden_by(mirror->pane, eye_m, point_m)) return false;
    const auto& occluders = scene.clutter.occluders;
    return std::none_of(occluders.begin(), occluders.end(), [&](const Panel& occluder) {
      return is_point_hidden_by(occluder, eye_m, point_m);
    });
  };
  const auto [face_m, rim_m] = sample_surface_points(glow);
  const auto count = std::count_if(face_m.begin(), face_m.end(), visible);
  const auto points = static_cast<double>(face_m.size());
  if (count < std::ptrdiff_t(face_m.size())) return double(count) / points;
  // A lamp counts as wholly in view only if its rim is, too.
  return std::all_of(rim_m.begin(), rim_m.end(), visible) ? 1 : (points - 0.5) / points;
}

/// Returns std::nullopt if the lens does not describe the glow's center, or if no part of it is in
/// view.
std::optional<GlowImage> find_glow_image(const Scene& scene, const FrameRenderer& renderer,
                                         const LampShot& shot, const Glow& glow,
                                         const Mirror* mirror = nullptr) {
  const auto camera_from_world = [&](double time_s) {
    return shot.motion.world_from_camera(time_s).inverse();
  };
  Eigen::Vector3d center_m = glow.position_m;
  if (mirror) {
    const Eigen::Vector3d eye_m = shot.motion.world_from_camera(0).translation();
    if (!are_on_same_side(*mirror, center_m, eye_m)) return std::nullopt;
    center_m = make_reflection_transform(mirror->pane) * center_m;
  }
  const Shutter shutter = renderer.make_rolling_shutter(shot.exposure_s);
  const auto center = find_image_point(renderer, shutter, camera_from_world, center_m);
  if (!center) return std::nullopt;
  const double in_view =
      compute_visible_fraction(scene, renderer, shutter, camera_from_world, glow, mirror);
  if (in_view == 0) return std::nullopt;
  return GlowImage{center->pixel, in_view};
}

std::string length(double value_m) { return format_fixed_decimals(value_m, 9); }
std::string angle(double value_rad) { return format_fixed_decimals(value_rad, 10); }
std::string pixel(double value_px) { return format_fixed_decimals(value_px, 6); }

std::size_t write_lamp_truth(const Scene& scene, const FrameRenderer& renderer,
                             const CaptureSet& set, const std::filesystem::path& folder) {
  // Columns that no capture of the set needs are omitted.
  bool moves = false, has_roll_pitch = false;
  for (std::size_t i = 0; i < count_shots(set); ++i) {
    const BaseMotion motion = make_lamp_shot(scene, set, i).motion;
    moves = moves || !motion.is_base_at_rest();
    has_roll_pitch = has_roll_pitch || !motion.is_base_level();
  }
  std::vector<std::string> columns{"image", "x_m", "y_m", "z_m", "yaw_rad"};
  if (moves) {
    columns.insert(columns.end(), {"time_s", "vx_m_per_s", "vy_m_per_s", "yaw_rate_rad_per_s"});
  }
  if (has_roll_pitch) columns.insert(columns.end(), {"roll_rad", "pitch_rad"});
  CsvWriter truth(folder / "truth.csv", columns);
  CsvWriter detections(folder / "true_detections.csv",
                       {"image", "lamp", "u_px", "v_px", "in_view"});
  const bool known = set.lamps->has_known_positions;
  CsvWriter captures(
      folder / "captures.csv",
      known ? std::initializer_list<std::string_view>{"image", "time_s", "x_m", "y_m", "z_m"}
            : std::initializer_list<std::string_view>{"image", "time_s"});
  std::size_t empty = 0;
  for (std::size_t i = 0; i < count_shots(set); ++i) {
    const LampShot shot = make_lamp_shot(scene, set, i);
    const auto& [position_m, yaw_rad] = shot.motion.camera_pose_at(0);
    const std::string x = length(position_m.x()), y = length(position_m.y());
    const std::string z = length(position_m.z()), time = format_fixed_decimals(shot.time_s, 9);
    std::vector<std::string> row{shot.image, x, y, z, angle(wrap_angle_rad(yaw_rad))};
    if (moves) {
      const Eigen::Vector2d velocity_m_per_s = shot.motion.camera_velocity_m_per_s();
      row.insert(row.end(), {time, length(velocity_m_per_s.x()), length(velocity_m_per_s.y()),
                             angle(shot.motion.turn_rate_rad_per_s)});
    }
    if (has_roll_pitch) {
      const Inclination lean = shot.motion.inclination_at(0);
      row.insert(row.end(), {angle(lean.roll_rad), angle(lean.pitch_rad)});
    }
    truth.write_csv_row(row);
    if (known) {
      captures.write_csv_row({shot.image, time, x, y, z});
    } else {
      captures.write_csv_row({shot.image, time});
    }
    const auto lamps = list_true_lamps(scene, renderer, shot);
    empty += lamps.empty();
    for (const auto& [id, at_px, in_view] : lamps) {
      detections.write_csv_row({shot.image, std::to_string(id), pixel(at_px.x()), pixel(at_px.y()),
                                format_digits(in_view, 3)});
    }
  }
  truth.save_file();
  detections.save_file();
  captures.save_file();
  return empty;
}

void write_other_lights(const Scene& scene, const FrameRenderer& renderer, const CaptureSet& set,
                        const std::filesystem::path& folder) {
  if (scene.clutter.mirrors.empty() && scene.clutter.foreign_lights.empty()) return;
  CsvWriter table(folder / "true_other_lights.csv",
                  {"image", "kind", "lamp", "u_px", "v_px", "in_view"});
  for (std::size_t i = 0; i < count_shots(set); ++i) {
    const LampShot shot = make_lamp_shot(scene, set, i);
    for (const auto& [kind, lamp, at_px, in_view] : list_true_lights(scene, renderer, shot)) {
      table.write_csv_row({shot.image, kind, lamp ? std::to_string(*lamp) : "", pixel(at_px.x()),
                           pixel(at_px.y()), format_digits(in_view, 3)});
    }
  }
  table.save_file();
}

std::size_t write_board_truth(const Scene& scene, const FrameRenderer& renderer,
                              const CaptureSet& set, const std::filesystem::path& folder) {
  CsvWriter boards(folder / "true_boards.csv",
                   {"image", "x_m", "y_m", "z_m", "rx_rad", "ry_rad", "rz_rad"});
  std::vector<std::string> columns{"image", "tag", "corner", "u_px", "v_px"};
  if (scene.board->pattern.has_squares()) columns.erase(columns.begin() + 1);
  CsvWriter corners(folder / "true_corners.csv", columns);
  std::size_t empty = 0;
  for (std::size_t i = 0; i < count_shots(set); ++i) {
    const BoardShot shot = make_board_shot(scene, set, i);
    const Eigen::Isometry3d camera_from_board = shot.camera_from_board(0);
    const Eigen::Vector3d place_m = camera_from_board.translation();
    const Eigen::AngleAxisd rotation(camera_from_board.linear());
    const Eigen::Vector3d rotation_vector_rad = rotation.angle() * rotation.axis();
    boards.write_csv_row({shot.image, length(place_m.x()), length(place_m.y()), length(place_m.z()),
                          angle(rotation_vector_rad.x()), angle(rotation_vector_rad.y()),
                          angle(rotation_vector_rad.z())});
    const auto visible_corners = list_true_corners(scene, renderer, shot);
    empty += visible_corners.empty();
    for (const auto& [tag, corner, at_px] : visible_corners) {
      std::vector<std::string> row{shot.image};
      if (tag) row.push_back(std::to_string(*tag));
      row.insert(row.end(), {std::to_string(corner), pixel(at_px.x()), pixel(at_px.y())});
      corners.write_csv_row(row);
    }
  }
  boards.save_file();
  corners.save_file();
  return empty;
}

}  // namespace

std::vector<TrueLamp> list_true_lamps(const Scene& scene, const FrameRenderer& renderer,
                                      const LampShot& shot) {
  std::vector<TrueLamp> lamps;
  for (const SceneLamp& lamp : scene.lamps) {
    const auto glow_image = find_glow_image(scene, renderer, shot, lamp.glow);
    if (glow_image) lamps.push_back({lamp.id, glow_image->pixel, glow_image->visible_fraction});
  }
  return lamps;
}

std::vector<TrueOtherLight> list_true_lights(const Scene& scene, const FrameRenderer& renderer,
                                             const LampShot& shot) {
  std::vector<TrueOtherLight> lights;
  for (const Mirror& mirror : scene.clutter.mirrors) {
    for (const SceneLamp& lamp : scene.lamps) {
      const auto image = find_glow_image(scene, renderer, shot, lamp.glow, &mirror);
      if (!image) continue;
      lights.push_back({"mirror_image", lamp.id, image->pixel, image->visible_fraction});
    }
  }
  for (const ForeignLight& light : scene.clutter.foreign_lights) {
    const auto image = find_glow_image(scene, renderer, shot, light.glow);
    if (!image) continue;
    const bool is_pwm = std::holds_alternative<SquareWave>(light.wave);
    lights.push_back({is_pwm ? "pwm" : "mains", {}, image->pixel, image->visible_fraction});
  }
  return lights;
}

std::vector<TrueCorner> list_true_corners(const Scene& scene, const FrameRenderer& renderer,
                                          const BoardShot& shot) {
  const BoardWarp warp(*scene.board);
  const auto camera_from_board = [&](double time_s) { return shot.camera_from_board(time_s); };
  std::vector<TrueCorner> corners;
  const auto add = [&](std::optional<int> tag, int corner, const Eigen::Vector2d& at_m) {
    const Eigen::Vector3d point_m(at_m.x(), at_m.y(), warp.compute_deflection(at_m).depth_m);
    const auto at = find_image_point(renderer, renderer.make_rolling_shutter(shot.exposure_s),
                                     camera_from_board, point_m);
    if (at && is_in_image(scene.camera, at->pixel)) corners.push_back({tag, corner, at->pixel});
  };
  const Board& print = scene.board->pattern;
  if (print.has_squares()) {
    const auto corners_m = list_inner_corners_m(print);
    for (std::size_t i = 0; i < corners_m.size(); ++i) add({}, static_cast<int>(i), corners_m[i]);
    return corners;
  }
  for (const BoardTag& tag : list_board_tags(print)) {
    for (int corner = 0; corner < 4; ++corner) {
      add(tag.id, corner, tag.corners_m[static_cast<std::size_t>(corner)]);
    }
  }
  return corners;
}

Calibration make_true_calibration(const Scene& scene) {
  const Lens lens(scene.camera.lens_model, scene.camera.intrinsics);
  RotationCenter center;
  center.model = RotationModel::tilt;
  center.zenith_in_camera = scene.mount.level_from_camera.row(2);
  center.center_px = lens.focal_px().cwiseProduct(center.zenith_in_camera.hnormalized()) +
                     lens.principal_point_px();
  Calibration calibration;
  calibration.camera = scene.camera;
  calibration.rotation_center = center;
  return calibration;
}

LampMap make_lamp_map(const Scene& scene, bool surveyed) {
  LampMap map;
  for (const SceneLamp& lamp : scene.lamps) {
    Eigen::Vector3d position_m = lamp.glow.position_m;
    if (surveyed) position_m += lamp.map_error_m;
    map.lamps.push_back({lamp.id, position_m, lamp.glow.shape, lamp.frequency_hz, lamp.duty});
  }
  return map;
}

std::size_t write_truth_tables(const Scene& scene, const FrameRenderer& renderer,
                               const CaptureSet& set, const std::filesystem::path& folder) {
  if (set.board) {
    return write_board_truth(scene, renderer, set, folder);
  }
  write_other_lights(scene, renderer, set, folder);
  return write_lamp_truth(scene, renderer, set, folder);
}

}  // namespace vlp
