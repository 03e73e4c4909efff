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

constexpr std::array kFaults = {ArchiveFault::leaning, ArchiveFault::out_of_focus,
                                ArchiveFault::moved_lamp, ArchiveFault::cut_image};

struct Harm {
  ArchiveDamage damage;
  const char* target;
};
constexpr std::array kHarms = {
    Harm{ArchiveDamage::cut_images, "boards"},      Harm{ArchiveDamage::missing, "lamps.yaml"},
    Harm{ArchiveDamage::wrong_board, "board.yaml"}, Harm{ArchiveDamage::empty, "rotation"},
    Harm{ArchiveDamage::cut_images, "rotation"},    Harm{ArchiveDamage::missing, "board.yaml"},
    Harm{ArchiveDamage::empty, "boards"},           Harm{ArchiveDamage::missing, "rotation"}};

/// Returns how many of the first n sessions are chosen if the fraction `share` of all is chosen.
/// Rounded to nearest, so that small archives have chosen sessions, too.
std::size_t chosen_of(std::size_t n, double share) {
  return static_cast<std::size_t>(std::floor(static_cast<double>(n) * share + 0.5));
}

/// Returns the number of the choice (from 0) that falls on session `index`; std::nullopt if it is
/// not chosen.
std::optional<std::size_t> choice(std::size_t index, double share) {
  const std::size_t before = chosen_of(index, share);
  if (chosen_of(index + 1, share) == before) return std::nullopt;
  return before;
}

std::string numbered(const std::string& name, std::size_t number, std::size_t digits) {
  const std::string text = std::to_string(number);
  return name + std::string(digits - std::min(digits, text.size()), '0') + text;
}

/// Returns the mount tilted further by `tilt_rad` towards an azimuth of the image.
Mount leaning(const Mount& mount, double tilt_rad, double azimuth_rad) {
  const Eigen::Vector3d zenith_in_camera = mount.level_from_camera.row(2);
  const Eigen::Vector3d axis(-std::sin(azimuth_rad), std::cos(azimuth_rad), 0);
  return {level_from_zenith(Eigen::AngleAxisd(tilt_rad, axis) * zenith_in_camera),
          mount.lever_arm_m};
}

void draw_camera(Scene& scene, const ArchiveSpreads& spreads, cv::RNG random) {
  const auto share = [&] { return random.uniform(-1.0, 1.0); };
  std::vector<double>& intrinsics = scene.camera.intrinsics;
  const double focal = 1 + spreads.focal_share * share();
  for (std::size_t i = 0; i < intrinsics.size(); ++i) {
    if (i < 2) {
      intrinsics[i] *= focal;
    } else if (i < 4) {
      intrinsics[i] += spreads.center_px * share();
    } else {
      intrinsics[i] *= 1 + spreads.distortion_share * share();
    }
  }
  const double tilt_rad = spreads.tilt_rad * std::abs(share());
  scene.mount = leaning(scene.mount, tilt_rad, std::numbers::pi * share());
  for (double& part : scene.mount.lever_arm_m) part += spreads.lever_arm_m * share();
}

void draw_session(Scene& scene, const ArchiveSpreads& spreads, cv::RNG random) {
  scene.seed = next_seed(random);
  for (SceneLamp& lamp : scene.lamps) {
    for (double& part : lamp.map_error_m) {
      part += spreads.map_error_m * random.uniform(-1.0, 1.0);
    }
  }
}

void apply(ArchiveFault fault, Scene& scene) {
  if (fault == ArchiveFault::leaning) scene.mount = leaning(scene.mount, rad_from_deg(4), 0);
  if (fault == ArchiveFault::out_of_focus) {
    scene.optics.blur_px = std::max(0.8, 1.5 * scene.optics.blur_px);
  }
  if (fault == ArchiveFault::moved_lamp) scene.lamps.front().map_error_m.x() += 0.03;
}

}  // namespace

ArchiveSession archive_session(const Scene& scene, std::size_t index) {
  const ArchiveSpreads& spreads = *scene.archive;
  const auto per_camera = static_cast<std::size_t>(spreads.sessions_per_camera);
  const std::size_t camera = index / per_camera;
  ArchiveSession session{numbered("camera-", camera + 1, 5),
                         numbered("session-", index % per_camera + 1, 2),
                         scene,
                         ArchiveFault::none,
                         ArchiveDamage::none,
                         ""};
  session.scene.camera.id = session.camera;
  draw_camera(session.scene, spreads, random_of(scene.seed, "archive camera", camera));
  draw_session(session.scene, spreads, random_of(scene.seed, "archive session", index));
  const auto fault = choice(index, spreads.fault_share);
  if (const auto harm = choice(index, spreads.damage_share)) {
    session.damage = kHarms[*harm % kHarms.size()].damage;
    session.damaged = kHarms[*harm % kHarms.size()].target;
  } else if (fault) {
    session.fault = kFaults[*fault % kFaults.size()];
    apply(session.fault, session.scene);
  }
  return session;
}

}  // namespace vlp
