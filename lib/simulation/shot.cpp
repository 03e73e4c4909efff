// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "simulation/shot.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "camera/lens.h"
#include "geometry/frames.h"
#include "rig/board_layout.h"
#include "simulation/exposure.h"
#include "simulation/scene.h"

namespace vlp {
namespace {

std::string make_image_name(const Scene& scene, std::size_t index, std::size_t count) {
  const std::string number = std::to_string(index);
  const std::size_t digits = std::max<std::size_t>(4, std::to_string(count - 1).size());
  return std::string(digits - number.size(), '0') + number + image_extension(scene.processing);
}

Eigen::Matrix3d rotation(double angle_rad, const Eigen::Vector3d& axis) {
  return Eigen::AngleAxisd(angle_rad, axis.normalized()).toRotationMatrix();
}

/// Indices of a capture's height, pivot and yaw, and the time since the start of its pass.
struct CaptureIndices {
  std::size_t height, pivot, yaw;
  double driven_s;
};

CaptureIndices compute_capture_indices(const LampShots& captures, std::size_t index) {
  const std::size_t pivots = captures.pivots_m.size(), yaws = captures.yaws_rad.size();
  const auto repeat = static_cast<std::size_t>(captures.repeat);
  if (captures.drive) {
    const std::size_t turned = index / pivots / repeat;
    return {turned / yaws, index % pivots, turned % yaws,
            static_cast<double>(index % pivots) * captures.interval_s};
  }
  const std::size_t turned = index / repeat;
  return {turned / yaws / pivots, turned / yaws % pivots, turned % yaws, 0};
}

/// Returns the ray of the pixel at the offset `offset` from `middle`. If that pixel has no ray,
/// returns the ray of the last pixel on the way there that has one.
std::optional<Lens::Ray> find_last_ray(const Lens& lens, const Eigen::Vector2d& middle,
                                       const Eigen::Vector2d& offset) {
  constexpr int halvings = 30;
  auto ray = lens.unproject_pixel(middle + offset);
  double within = 0, beyond = 1;
  for (int halving = 0; !ray && halving < halvings; ++halving) {
    const double between = (within + beyond) / 2;
    (lens.unproject_pixel(middle + between * offset) ? within : beyond) = between;
  }
  return ray ? ray : lens.unproject_pixel(middle + within * offset);
}

}  // namespace

Pose BaseMotion::camera_pose_at(double time_s) const {
  const double yaw = yaw_rad + turn_rate_rad_per_s * time_s;
  Pose pose{axis_m, yaw};
  pose.position_m.head<2>() +=
      velocity_m_per_s * time_s + Eigen::Rotation2Dd(yaw) * mount.lever_arm_m;
  return pose;
}

Inclination BaseMotion::inclination_at(double time_s) const {
  const double angle = phase_rad + 2 * std::numbers::pi * vibration.frequency_hz * time_s;
  return {inclination.roll_rad + vibration.amplitude_rad * std::sin(angle),
          inclination.pitch_rad + vibration.amplitude_rad * std::cos(angle)};
}

Eigen::Vector2d BaseMotion::camera_velocity_m_per_s() const {
  const Eigen::Vector2d arm_m = Eigen::Rotation2Dd(yaw_rad) * mount.lever_arm_m;
  return velocity_m_per_s + turn_rate_rad_per_s * Eigen::Vector2d(-arm_m.y(), arm_m.x());
}

Eigen::Isometry3d BaseMotion::world_from_camera(double time_s) const {
  const Pose level = camera_pose_at(time_s);
  Eigen::Isometry3d world_from_camera;
  world_from_camera.linear() = rotation_about_z(level.yaw_rad) *
                               level_rotation_from_inclination(inclination_at(time_s)) *
                               mount.level_from_camera;
  world_from_camera.translation() = level.position_m;
  return world_from_camera;
}

Eigen::Isometry3d BoardShot::camera_from_board(double time_s) const {
  return Eigen::Translation3d(velocity_in_camera_m_per_s * time_s) * camera_from_board_at_0;
}

std::size_t count_shots(const CaptureSet& set) {
  if (set.board) return static_cast<std::size_t>(set.board->count);
  const LampShots& lamps = *set.lamps;
  return lamps.heights_m.size() * lamps.pivots_m.size() * lamps.yaws_rad.size() *
         static_cast<std::size_t>(lamps.repeat);
}

LampShot make_lamp_shot(const Scene& scene, const CaptureSet& set, std::size_t index) {
  const LampShots& captures = *set.lamps;
  cv::RNG random = make_generator(scene.seed, set.folder, index);
  const CaptureIndices indices = compute_capture_indices(captures, index);
  const double jitter_rad = captures.yaw_jitter_rad * random.uniform(-1.0, 1.0);

  LampShot shot;
  shot.image = make_image_name(scene, index, count_shots(set));
  shot.time_s = static_cast<double>(index) * captures.interval_s;
  shot.exposure_s = set.exposure_s;
  shot.motion.axis_m << captures.pivots_m[indices.pivot], captures.heights_m[indices.height];
  shot.motion.velocity_m_per_s.setZero();
  if (const auto& drive = captures.drive) {
    shot.motion.velocity_m_per_s =
        (drive->to_m - drive->from_m).normalized() * drive->speed_m_per_s;
  }
  shot.motion.turn_rate_rad_per_s = captures.turn_rate_rad_per_s;
  shot.motion.yaw_rad =
      captures.yaws_rad[indices.yaw] + jitter_rad + captures.turn_rate_rad_per_s * indices.driven_s;
  shot.motion.mount = scene.mount;
  const std::size_t last = count_shots(set) - 1;
  const double fraction = last > 0 ? static_cast<double>(index) / static_cast<double>(last) : 0;
  const auto ramp = [&](const std::pair<double, double>& ends) {
    return ends.first + fraction * (ends.second - ends.first);
  };
  shot.motion.inclination = {ramp(captures.roll_rad), ramp(captures.pitch_rad)};
  shot.motion.vibration = captures.vibration;
  shot.motion.phase_rad = std::remainder(
      2 * std::numbers::pi * captures.vibration.frequency_hz * shot.time_s, 2 * std::numbers::pi);
  const auto draw_phase = [&](const std::optional<double>& phase, double frequency_hz) {
    const double free_phase = random.uniform(0.0, 1.0);
    const double periods = phase ? *phase + frequency_hz * shot.time_s : free_phase;
    return periods - std::floor(periods);
  };
  for (const SceneLamp& lamp : scene.lamps) {
    shot.waves.push_back({lamp.frequency_hz, lamp.duty, draw_phase(lamp.phase, lamp.frequency_hz)});
  }
  shot.noise_seed = draw_seed(random);
  // Drawn last, so that the other random values equal those of a scene without such lights.
  for (const ForeignLight& light : scene.clutter.foreign_lights) {
    const double frequency_hz =
        std::visit([](const auto& wave) { return wave.frequency_hz; }, light.wave);
    shot.foreign_waves.push_back(
        copy_with_phase(light.wave, draw_phase(light.phase, frequency_hz)));
  }
  if (scene.clutter.ambient_flicker) shot.ambient_phase = random.uniform(0.0, 1.0);
  return shot;
}

BoardShot make_board_shot(const Scene& scene, const CaptureSet& set, std::size_t index) {
  const BoardViews& views = *set.board;
  const Lens lens(scene.camera.lens_model, scene.camera.intrinsics);
  cv::RNG random = make_generator(scene.seed, set.folder, index);
  const auto fraction = [&] { return random.uniform(-1.0, 1.0); };

  // The board's center is placed on a random ray and the board faces the camera; then it is rotated
  // in place. Where the lens has no ray, the last ray on the way there is used.
  const Eigen::Vector2d half((scene.camera.imager_px[0] - 1) / 2.0,
                             (scene.camera.imager_px[1] - 1) / 2.0);
  const Eigen::Vector2d offset =
      views.field_coverage * Eigen::Vector2d{fraction(), fraction()}.cwiseProduct(half);
  const auto ray = find_last_ray(lens, half, offset);
  const Eigen::Vector3d sight =
      ray ? ray->direction.normalized() : Eigen::Vector3d(Eigen::Vector3d::UnitZ());
  const double distance_m = random.uniform(views.distance_m.first, views.distance_m.second);
  const double azimuth = std::numbers::pi * fraction(),
               tilt = views.tilt_rad * std::abs(fraction());
  const double roll = views.roll_rad * fraction();
  const Eigen::Matrix3d facing = level_rotation_from_zenith(sight).transpose();
  const Eigen::Vector3d tilt_axis(std::cos(azimuth), std::sin(azimuth), 0);

  BoardShot shot;
  shot.image = make_image_name(scene, index, count_shots(set));
  shot.exposure_s = set.exposure_s;
  shot.camera_from_board_at_0.linear() =
      facing * rotation(tilt, tilt_axis) * rotation(roll, Eigen::Vector3d::UnitZ());
  Eigen::Vector3d middle_m(0, 0, 0);
  middle_m.head<2>() = compute_tag_field_size_m(scene.board->pattern) / 2;
  shot.camera_from_board_at_0.translation() =
      distance_m * sight - shot.camera_from_board_at_0.linear() * middle_m;
  shot.velocity_in_camera_m_per_s = views.velocity_m_per_s;
  shot.noise_seed = draw_seed(random);
  return shot;
}

}  // namespace vlp
