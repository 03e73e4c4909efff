// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "geometry/angles.h"
#include "simulation/archive.h"
#include "simulation/seeded_random.h"

namespace vlp {
namespace {

constexpr std::array kFaults = {ArchiveFault::tilted, ArchiveFault::out_of_focus,
                                ArchiveFault::moved_lamp, ArchiveFault::cut_image};

struct DamageTarget {
  ArchiveDamage damage;
  const char* target;
};
constexpr std::array kDamageTargets = {DamageTarget{ArchiveDamage::cut_images, "boards"},
                                       DamageTarget{ArchiveDamage::missing, "lamps.yaml"},
                                       DamageTarget{ArchiveDamage::wrong_board, "board.yaml"},
                                       DamageTarget{ArchiveDamage::empty, "rotation"},
                                       DamageTarget{ArchiveDamage::cut_images, "rotation"},
                                       DamageTarget{ArchiveDamage::missing, "board.yaml"},
                                       DamageTarget{ArchiveDamage::empty, "boards"},
                                       DamageTarget{ArchiveDamage::missing, "rotation"}};

/// Returns how many of the first n sessions are chosen if the fraction `fraction` of all is chosen.
/// Rounded to nearest, so that small archives have chosen sessions, too.
std::size_t count_chosen(std::size_t n, double fraction) {
  return static_cast<std::size_t>(std::floor(static_cast<double>(n) * fraction + 0.5));
}

/// Returns the number of the choice (from 0) that falls on session `index`; std::nullopt if it is
/// not chosen.
std::optional<std::size_t> find_choice(std::size_t index, double fraction) {
  const std::size_t before = count_chosen(index, fraction);
  if (count_chosen(index + 1, fraction) == before) return std::nullopt;
  return before;
}

std::string format_numbered(const std::string& name, std::size_t number, std::size_t digits) {
  const std::string text = std::to_string(number);
  return name + std::string(digits - std::min(digits, text.size()), '0') + text;
}

/// Returns the mount tilted further by `tilt_rad` towards an azimuth of the image.
Mount tilted(const Mount& mount, double tilt_rad, double azimuth_rad) {
  const Eigen::Vector3d zenith_in_camera = mount.level_from_camera.row(2);
  const Eigen::Vector3d axis(-std::sin(azimuth_rad), std::cos(azimuth_rad), 0);
  return {level_from_zenith(Eigen::AngleAxisd(tilt_rad, axis) * zenith_in_camera),
          mount.lever_arm_m};
}

void draw_camera(Scene& scene, const ArchiveVariation& variation, cv::RNG random) {
  const auto fraction = [&] { return random.uniform(-1.0, 1.0); };
  std::vector<double>& intrinsics = scene.camera.intrinsics;
  const double focal = 1 + variation.focal_share * fraction();
  for (std::size_t i = 0; i < intrinsics.size(); ++i) {
    if (i < 2) {
      intrinsics[i] *= focal;
    } else if (i < 4) {
      intrinsics[i] += variation.center_px * fraction();
    } else {
      intrinsics[i] *= 1 + variation.distortion_share * fraction();
    }
  }
  const double tilt_rad = variation.tilt_rad * std::abs(fraction());
  scene.mount = tilted(scene.mount, tilt_rad, std::numbers::pi * fraction());
  for (double& part : scene.mount.lever_arm_m) part += variation.lever_arm_m * fraction();
}

void draw_session(Scene& scene, const ArchiveVariation& variation, cv::RNG random) {
  scene.seed = draw_seed_from(random);
  for (SceneLamp& lamp : scene.lamps) {
    for (double& part : lamp.map_error_m) {
      part += variation.map_error_m * random.uniform(-1.0, 1.0);
    }
  }
}

void apply(ArchiveFault fault, Scene& scene) {
  if (fault == ArchiveFault::tilted) scene.mount = tilted(scene.mount, rad_from_deg(4), 0);
  if (fault == ArchiveFault::out_of_focus) {
    scene.optics.blur_px = std::max(0.8, 1.5 * scene.optics.blur_px);
  }
  if (fault == ArchiveFault::moved_lamp) scene.lamps.front().map_error_m.x() += 0.03;
}

}  // namespace

ArchiveSession make_archive_session(const Scene& scene, std::size_t index) {
  const ArchiveVariation& variation = *scene.archive;
  const auto per_camera = static_cast<std::size_t>(variation.sessions_per_camera);
  const std::size_t camera = index / per_camera;
  ArchiveSession session{format_numbered("camera-", camera + 1, 5),
                         format_numbered("session-", index % per_camera + 1, 2),
                         scene,
                         ArchiveFault::none,
                         ArchiveDamage::none,
                         ""};
  session.scene.camera.id = session.camera;
  draw_camera(session.scene, variation, make_random(scene.seed, "archive camera", camera));
  draw_session(session.scene, variation, make_random(scene.seed, "archive session", index));
  const auto fault = find_choice(index, variation.fault_share);
  if (const auto damage_target = find_choice(index, variation.damage_share)) {
    session.damage = kDamageTargets[*damage_target % kDamageTargets.size()].damage;
    session.damaged = kDamageTargets[*damage_target % kDamageTargets.size()].target;
  } else if (fault) {
    session.fault = kFaults[*fault % kFaults.size()];
    apply(session.fault, session.scene);
  }
  return session;
}

}  // namespace vlp
