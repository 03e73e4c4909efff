// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "simulation/archive.h"

#include <gmock/gmock.h>

#include <numbers>
#include <set>

#include "simulation/scene_sample.h"

namespace vlp {
namespace {

using testing::HasSubstr;

const std::string kSpreads =
    "archive: {sessions_per_camera: 2, focal_fraction: 0.01, principal_point_px: 3, "
    "distortion_fraction: 0.05, tilt_deg: 1, lever_arm_m: 0.003, map_error_m: 0.001, "
    "fault_fraction: 0.1, damage_fraction: 0.05}\n";

Scene archive_scene(const std::string& variation = kSpreads) {
  return read_scene_text(scene_with("captures:", variation + "captures:"));
}

double tilt_rad(const Scene& scene) { return std::acos(scene.mount.level_from_camera(2, 2)); }

TEST(ReadSceneFile, ReadsArchiveVariationOnlyIfGiven) {
  const auto variation = archive_scene().archive;
  ASSERT_TRUE(variation);
  EXPECT_EQ(variation->sessions_per_camera, 2);
  EXPECT_EQ(variation->focal_fraction, 0.01);
  EXPECT_NEAR(variation->tilt_rad, std::numbers::pi / 180, 1e-12);
  EXPECT_EQ(variation->damage_fraction, 0.05);
  EXPECT_FALSE(read_scene_text(kSceneYaml).archive);
}

TEST(ReadSceneFile, RejectsInvalidMissingOrUnknownArchiveKeys) {
  const auto refusal = [](const std::string& from, const std::string& to) {
    std::string variation = kSpreads;
    variation.replace(variation.find(from), from.size(), to);
    return scene_refusal(scene_with("captures:", variation + "captures:"));
  };
  EXPECT_THAT(refusal("damage_fraction: 0.05", "damage_fraction: 1.5"),
              HasSubstr("damage_fraction"));
  EXPECT_THAT(refusal("sessions_per_camera: 2", "sessions_per_camera: 0"),
              HasSubstr("sessions_per_camera"));
  EXPECT_THAT(refusal("tilt_deg: 1, ", ""), HasSubstr("key 'tilt_deg' is missing"));
  EXPECT_THAT(refusal("tilt_deg: 1", "tilt_deg: 1, odd: 2"), HasSubstr("key 'odd' is unknown"));
}

TEST(MakeArchiveSession, AssignsDamageAndFaultToGivenFractionOfSessions) {
  const Scene scene = archive_scene();
  std::size_t damaged = 0, faulty = 0;
  std::set<std::string> kinds, faults;
  for (std::size_t i = 0; i < 200; ++i) {
    const ArchiveSession session = make_archive_session(scene, i);
    if (session.damage != ArchiveDamage::none) {
      ++damaged;
      kinds.insert(std::string(damage_name(session.damage)) + " " + session.damaged);
      EXPECT_EQ(session.fault, ArchiveFault::none);
    }
    if (session.fault != ArchiveFault::none) {
      ++faulty;
      faults.insert(std::string(archive_fault_name(session.fault)));
    }
  }
  EXPECT_EQ(damaged, 10U);
  EXPECT_EQ(faulty, 20U);
  EXPECT_EQ(kinds.size(), 8U) << "each kind has its turn";
  EXPECT_EQ(faults.size(), 4U);
}

TEST(MakeArchiveSession, SessionsOfCameraShareLensWithinGivenVariation) {
  const Scene scene = archive_scene();
  std::set<double> focal_lengths;
  std::set<std::uint64_t> seeds;
  for (std::size_t i = 0; i < 100; i += 2) {
    const ArchiveSession first = make_archive_session(scene, i),
                         second = make_archive_session(scene, i + 1);
    EXPECT_EQ(first.camera, second.camera);
    EXPECT_NE(first.session, second.session);
    EXPECT_EQ(first.scene.camera.intrinsics, second.scene.camera.intrinsics);
    EXPECT_EQ(first.scene.mount.lever_arm_m, second.scene.mount.lever_arm_m);
    EXPECT_NE(first.scene.lamps[0].map_error_m, second.scene.lamps[0].map_error_m);
    focal_lengths.insert(first.scene.camera.focal_px().x());
    seeds.insert({first.scene.seed, second.scene.seed});
    EXPECT_NEAR(first.scene.camera.focal_px().x(), 100, 1);
    EXPECT_NEAR(first.scene.camera.focal_px().y() / first.scene.camera.focal_px().x(), 1.01, 1e-12);
    EXPECT_NEAR(first.scene.camera.intrinsics[2], 80, 3);
    EXPECT_LE((first.scene.mount.lever_arm_m - scene.mount.lever_arm_m).lpNorm<Eigen::Infinity>(),
              0.003);
    if (first.fault != ArchiveFault::tilted) {
      EXPECT_NEAR(tilt_rad(first.scene), tilt_rad(scene), std::numbers::pi / 180 + 1e-9);
    }
  }
  EXPECT_EQ(focal_lengths.size(), 50U);
  EXPECT_EQ(seeds.size(), 100U);
}

TEST(MakeArchiveSession, ChangesSceneAccordingToFault) {
  const Scene scene = archive_scene();
  for (std::size_t i = 0; i < 60; ++i) {
    const ArchiveSession session = make_archive_session(scene, i);
    EXPECT_EQ(tilt_rad(session.scene) > tilt_rad(scene) + 0.021,
              session.fault == ArchiveFault::tilted)
        << "2 degrees as the scene has, 1 more in any direction; 4 across";
    EXPECT_EQ(session.scene.optics.blur_px > 1, session.fault == ArchiveFault::out_of_focus);
    EXPECT_EQ(session.scene.lamps[0].map_error_m.x() > 0.02,
              session.fault == ArchiveFault::moved_lamp);
  }
}

TEST(SimulateArchive, RejectsSceneWithoutArchiveKeyOrRequiredFolders) {
  const auto refusal = [](const Scene& scene) -> std::string {
    try {
      simulate_archive(scene, 1, "unused", {}, {});
    } catch (const std::invalid_argument& failure) {
      return failure.what();
    }
    return "";
  };
  EXPECT_THAT(refusal(read_scene_text(kSceneYaml)), HasSubstr("no key 'archive'"));
  EXPECT_THAT(refusal(archive_scene()), HasSubstr("folders boards and rotation"));
}

}  // namespace
}  // namespace vlp
