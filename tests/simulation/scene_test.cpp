// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <numbers>

#include "geometry/angles.h"
#include "simulation/scene_sample.h"
#include "simulation/shot.h"
#include "support/matchers.h"

namespace vlp {
namespace {

using Eigen::Vector2d, Eigen::Vector3d;
using testing::DoubleNear;
using testing::ElementsAre;
using testing::Pointwise;

constexpr double kRounding = 1e-12;

TEST(ReadSceneFile, ReadsCameraAndSensor) {
  const Scene scene = read_scene_text(kSceneYaml);
  EXPECT_EQ(scene.seed, 7U);
  EXPECT_EQ(scene.camera.id, "small");
  EXPECT_EQ(scene.camera.imager_px[1], 120);
  EXPECT_EQ(scene.camera.lens_model, LensModel::pinhole);
  EXPECT_EQ(scene.camera.intrinsics, (std::vector<double>{100, 101, 80, 60}));
  EXPECT_EQ(scene.camera.row_time_s, 3e-5);
  EXPECT_EQ(scene.camera.readout, Readout::columns);
  EXPECT_EQ(scene.optics.blur_px, 0.7);
  EXPECT_EQ(scene.optics.vignetting_power, 4);
  EXPECT_EQ(scene.sensor.bits, 8);
  EXPECT_EQ(scene.sensor.gain_dn_per_e, 0.02);
  EXPECT_EQ(scene.sensor.black_level_dn, 2);
  EXPECT_EQ(scene.sensor.full_well_e, 13000);
  EXPECT_EQ(scene.sensor.read_noise_e, 8);
  EXPECT_TRUE(scene.sensor.shot_noise);
  ASSERT_TRUE(scene.sensor.bloom);
  EXPECT_EQ(scene.sensor.bloom->fraction, 0.3);
  EXPECT_EQ(scene.sensor.bloom->sigma_px, 2.5);
}

TEST(ReadSceneFile, ConvertsMountTiltFromDegreesToRotation) {
  const Mount mount = read_scene_text(kSceneYaml).mount;
  EXPECT_THAT(mount.level_from_camera,
              IsNear(level_rotation_from_zenith({0, std::tan(rad_from_deg(2)), 1}), kRounding));
  EXPECT_EQ(mount.lever_arm_m, Vector2d(0.03, -0.04));
}

TEST(ReadSceneFile, ReadsLampsInOrderOfFile) {
  const Scene scene = read_scene_text(kSceneYaml);
  ASSERT_EQ(scene.lamps.size(), 2U);
  EXPECT_EQ(scene.ambient_e_per_s, 1e6);
  EXPECT_EQ(scene.lamps[0].id, 1);
  EXPECT_FALSE(scene.lamps[0].phase);
  EXPECT_EQ(scene.lamps[0].map_error_m, Vector3d::Zero());
  const SceneLamp& lamp = scene.lamps[1];
  EXPECT_EQ(lamp.id, 5);
  EXPECT_EQ(lamp.glow.position_m, Vector3d(0.6, 0.2, 1.5));
  EXPECT_EQ(lamp.glow.glow_radius_m(), 0.05);
  EXPECT_EQ(lamp.glow.electron_rate_e_per_s, 3e8);
  EXPECT_EQ(lamp.glow.rim_to_center_ratio, 0.9);
  EXPECT_EQ(lamp.frequency_hz, 2500);
  EXPECT_EQ(lamp.duty, 0.5);
  EXPECT_EQ(lamp.phase, 0.25);
  EXPECT_EQ(lamp.map_error_m, Vector3d(0.001, 0.002, 0.003));
}

TEST(ReadSceneFile, ReadsClutterAndBoard) {
  const Scene scene = read_scene_text(kSceneYaml);
  const Clutter& clutter = scene.clutter;
  EXPECT_EQ(clutter.steady_lamps.at(0).rim_to_center_ratio, 0.7);
  EXPECT_EQ(clutter.windows.at(0).edge_b_m, Vector3d(0, 0.3, 0));
  EXPECT_EQ(clutter.windows.at(0).electron_rate_e_per_s, 8e7);
  EXPECT_EQ(clutter.reflections.at(0).lamp, 1U) << "the index of lamp 5";
  EXPECT_EQ(clutter.reflections.at(0).glow.rim_to_center_ratio, 0) << "it fades towards its rim";
  EXPECT_EQ(clutter.occluders.at(0).corner_m, Vector3d(-0.7, -0.2, 1.4));
  ASSERT_TRUE(scene.board);
  EXPECT_EQ(scene.board->pattern.first_id, 9);
  EXPECT_EQ(scene.board->margin_m, 0.02);
  EXPECT_EQ(scene.board->warp_m, Vector2d(0.0003, -0.0002));
  EXPECT_EQ(scene.board->white_e_per_s, 2.4e6);
  EXPECT_EQ(scene.board->black_e_per_s, 1.5e5);
  EXPECT_EQ(scene.board->surround_e_per_s, 6e5);
}

TEST(ReadSceneFile, ReadsShapeOfRectangularReflection) {
  const Scene scene = read_scene_text(
      scene_with("diameter_m: 0.22", "shape: rectangle, size_m: [0.6, 0.1], yaw_rad: 0.2"));
  const Glow& glow = scene.clutter.reflections.at(0).glow;
  EXPECT_EQ(glow.shape.kind, ShapeKind::rectangle);
  EXPECT_EQ(glow.shape.size_m, Eigen::Vector2d(0.6, 0.1));
  EXPECT_EQ(glow.shape.yaw_rad, 0.2);
  EXPECT_EQ(glow.rim_to_center_ratio, 0) << "it fades towards its sides";
}

TEST(ReadSceneFile, ReadsRecessesAndHalosOnlyWhereGiven) {
  const Scene scene = read_scene_text(kSceneYaml);
  ASSERT_EQ(scene.lamps.size(), 2U);
  EXPECT_FALSE(scene.lamps[0].glow.recess);
  EXPECT_FALSE(scene.lamps[0].glow.halo);
  ASSERT_TRUE(scene.lamps[1].glow.halo);
  EXPECT_EQ(scene.lamps[1].glow.halo->fraction, 0.02);
  EXPECT_EQ(scene.lamps[1].glow.halo->length_m, 0.015);
  const Recess recess = scene.clutter.steady_lamps.at(1).recess.value();
  EXPECT_EQ(recess.depth_m, 0.07);
  EXPECT_EQ(recess.source_diameter_m, 0.04);
  EXPECT_EQ(recess.reflector_ratio, 0.1);
  ASSERT_TRUE(recess.dark_side);
  EXPECT_EQ(recess.dark_side->reflector_ratio, 0.05);
  EXPECT_NEAR(recess.dark_side->azimuth_rad, std::numbers::pi / 2, kRounding);
}

TEST(ReadSceneFile, ReadsImageProcessingOnlyIfGiven) {
  const ImageProcessing picture = read_scene_text(kSceneYaml).processing.value();
  EXPECT_EQ(picture.gamma, 2.2);
  ASSERT_TRUE(picture.sharpening);
  EXPECT_EQ(picture.sharpening->amount, 0.6);
  EXPECT_EQ(picture.sharpening->radius_px, 1.5);
  EXPECT_EQ(picture.jpeg_quality, 90);
  EXPECT_FALSE(read_scene_text(scene_with("processing: ", "# ")).processing);
}

TEST(ReadSceneFile, ReadsPivotsHeightsAndYawsInOrderOfFile) {
  const CaptureSet set = read_scene_text(kSceneYaml).sets.at(0);
  EXPECT_EQ(set.folder, "spots");
  EXPECT_EQ(set.exposure_s, 5e-5);
  EXPECT_FALSE(set.board);
  ASSERT_TRUE(set.lamps);
  EXPECT_THAT(set.lamps->pivots_m, ElementsAre(Vector2d(0.1, -0.05), Vector2d(-0.2, 0.3)));
  EXPECT_THAT(set.lamps->heights_m, ElementsAre(0, 0.2));
  EXPECT_THAT(set.lamps->yaws_rad,
              Pointwise(DoubleNear(kRounding), {std::numbers::pi / 9, -std::numbers::pi / 2}));
  EXPECT_EQ(set.lamps->repeat, 3);
  EXPECT_EQ(set.lamps->interval_s, 0.5);
  EXPECT_EQ(set.lamps->turn_rate_rad_per_s, 0);
  EXPECT_TRUE(set.lamps->has_known_positions);
  EXPECT_EQ(count_shots(set), 2U * 2 * 2 * 3);
}

TEST(ReadSceneFile, OrdersPivotsOfGridRowByRow) {
  const LampShots captures = read_scene_text(kSceneYaml).sets.at(1).lamps.value();
  const std::vector<Vector2d> expected{{-0.6, 0.3},  {0, 0.3},  {0.6, 0.3},
                                       {-0.6, -0.3}, {0, -0.3}, {0.6, -0.3}};
  ASSERT_EQ(captures.pivots_m.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_THAT(captures.pivots_m[i], IsNear(expected[i], kRounding)) << i;
  }
  const double quarter_rad = std::numbers::pi / 2;
  EXPECT_THAT(captures.yaws_rad, Pointwise(DoubleNear(kRounding),
                                           {0.0, quarter_rad, 2 * quarter_rad, 3 * quarter_rad}));
  EXPECT_NEAR(captures.yaw_jitter_rad, rad_from_deg(9), kRounding);
  EXPECT_NEAR(captures.turn_rate_rad_per_s, quarter_rad, kRounding);
  EXPECT_EQ(captures.repeat, 1);
  EXPECT_FALSE(captures.has_known_positions);
}

TEST(ReadSceneFile, ReturnsEquidistantDrivePositionsUpToItsEnd) {
  const LampShots captures = read_scene_text(kSceneYaml).sets.at(2).lamps.value();
  ASSERT_TRUE(captures.drive);
  EXPECT_EQ(captures.drive->speed_m_per_s, 0.5);
  // 0.894 m in steps of 0.125 m.
  ASSERT_EQ(captures.pivots_m.size(), 8U);
  const Vector2d step_m = Vector2d(0.8, 0.4).normalized() * 0.125;
  for (int i = 0; i < 8; ++i) {
    EXPECT_THAT(captures.pivots_m[std::size_t(i)],
                IsNear(Vector2d(-0.3, 0) + i * step_m, kRounding));
  }
  const std::string whole_steps = scene_with("to_m: [0.5, 0.4]", "to_m: [0.7, 0]");
  EXPECT_THAT(read_scene_text(whole_steps).sets.at(2).lamps.value().pivots_m.back(),
              IsNear(Vector2d(0.7, 0), kRounding));
}

TEST(ReadSceneFile, ReadsLimitsOfBoardViews) {
  const CaptureSet set = read_scene_text(kSceneYaml).sets.at(3);
  EXPECT_FALSE(set.lamps);
  EXPECT_EQ(count_shots(set), 5U);
  ASSERT_TRUE(set.board);
  EXPECT_EQ(set.board->distance_m, std::pair(0.2, 0.4));
  EXPECT_NEAR(set.board->tilt_rad, std::numbers::pi / 4, kRounding);
  EXPECT_NEAR(set.board->roll_rad, std::numbers::pi, kRounding);
  EXPECT_EQ(set.board->field_coverage, 0.75);
  EXPECT_EQ(set.board->velocity_m_per_s, Vector3d(0.1, 0, 0.2));
}

TEST(ReadSceneFile, ReadsForeignLightsMirrorsBlindsAndSigns) {
  const std::string panel = "corner_m: [0.9, 0.1, 1.5], edges_m: [[0, 0.3, 0], [0, 0, 0.2]], ";
  const Clutter clutter =
      read_scene_text(
          scene_with(
              "clutter:\n",
              "clutter:\n"
              "  foreign_lights:\n"
              "    - {position_m: [0, 0.2, 1.6], diameter_m: 0.2, electron_rate_e_per_s: 1.0e+8, "
              "rim_to_center_ratio: 0.9, pwm: {frequency_hz: 500, duty: 0.3}, phase: 0.25}\n"
              "    - {position_m: [0, 0, 1.6], shape: rectangle, size_m: [0.6, 0.1], yaw_rad: 0.5, "
              "electron_rate_e_per_s: 2.0e+8, mains: {frequency_hz: 120, depth: 0.4}}\n"
              "  mirrors: [{" +
                  panel +
                  "reflectance: 0.15}]\n"
                  "  blinds: [{" +
                  panel +
                  "electron_rate_e_per_s: 3.0e+7, slats: 9, open_fraction: 0.4}]\n"
                  "  signs: [{" +
                  panel +
                  "electron_rate_e_per_s: 4.0e+7, lines: 2, letters: 8}]\n"
                  "  ambient_flicker: {frequency_hz: 100, depth: 0.6}\n"))
          .clutter;
  ASSERT_EQ(clutter.foreign_lights.size(), 2U);
  const ForeignLight &dimmed = clutter.foreign_lights[0], &tube = clutter.foreign_lights[1];
  EXPECT_EQ(dimmed.glow.glow_radius_m(), 0.1);
  EXPECT_EQ(dimmed.glow.rim_to_center_ratio, 0.9);
  EXPECT_EQ(dimmed.phase, 0.25);
  EXPECT_EQ(std::get<SquareWave>(dimmed.wave).frequency_hz, 500);
  EXPECT_EQ(std::get<SquareWave>(dimmed.wave).duty, 0.3);
  EXPECT_EQ(tube.glow.shape.kind, ShapeKind::rectangle);
  EXPECT_EQ(tube.glow.shape.yaw_rad, 0.5);
  EXPECT_EQ(tube.glow.electron_rate_e_per_s, 2e8);
  EXPECT_EQ(std::get<RectifiedSine>(tube.wave).frequency_hz, 120);
  EXPECT_EQ(std::get<RectifiedSine>(tube.wave).depth, 0.4);
  EXPECT_FALSE(tube.phase);
  ASSERT_EQ(clutter.mirrors.size(), 1U);
  EXPECT_EQ(clutter.mirrors[0].reflectance, 0.15);
  EXPECT_EQ(clutter.mirrors[0].pane.edge_b_m, Vector3d(0, 0, 0.2));
  ASSERT_EQ(clutter.blinds.size(), 1U);
  EXPECT_EQ(clutter.blinds[0].slats, 9);
  EXPECT_EQ(clutter.blinds[0].open_fraction, 0.4);
  EXPECT_EQ(clutter.blinds[0].window.electron_rate_e_per_s, 3e7);
  ASSERT_EQ(clutter.signs.size(), 1U);
  EXPECT_EQ(clutter.signs[0].lines, 2);
  EXPECT_EQ(clutter.signs[0].letters, 8);
  EXPECT_GE(clutter.signs[0].strokes.size(), 16U) << "drawn";
  ASSERT_TRUE(clutter.ambient_flicker);
  EXPECT_EQ(clutter.ambient_flicker->depth, 0.6);
}

TEST(ReadSceneFile, ReadsRandomLedChips) {
  const Scene chips = read_scene_text(scene_with("rim_to_center_ratio: 0.8}",
                                                 "rim_to_center_ratio: 0.8, random_chips: {count: "
                                                 "7, sigma_fraction: 0.12, within_fraction: 0.75, "
                                                 "excess: [0.3, 0.8]}}"));
  ASSERT_TRUE(chips.lamps.at(0).glow.random_chips);
  EXPECT_EQ(chips.lamps[0].glow.random_chips->within_fraction, 0.75);
  EXPECT_EQ(chips.lamps[0].glow.random_chips->max_excess, 0.8);
  EXPECT_EQ(chips.lamps[0].glow.hot_spots.size(), 7U) << "drawn";
}

TEST(ReadSceneFile, ReadsExponentsOfRecess) {
  const Scene recess = read_scene_text(scene_with(
      "depth_m: 0.07,",
      "depth_m: 0.07, source_power: 1.5, rim_power: 6, beam_power: 7, far_side_slope: 0.06,"));
  ASSERT_TRUE(recess.clutter.steady_lamps.at(1).recess);
  const Recess& read = *recess.clutter.steady_lamps[1].recess;
  EXPECT_EQ(read.source_power, 1.5);
  EXPECT_EQ(read.rim_power, 6);
  EXPECT_EQ(read.beam_power, 7);
  EXPECT_EQ(read.far_side_slope, 0.06);
}

TEST(ReadSceneFile, ReadsScenesOfDatasets) {
  for (const std::string name :
       {"paper-rig", "paper-rig-faulty", "wide", "clutter", "downlights", "recessed", "foreign"}) {
    SCOPED_TRACE(name);
    const Scene scene = read_scene_file(VLP_SOURCE_DIR "/datasets/" + name + "/scene.yaml");
    EXPECT_EQ(scene.camera.id, name);
    EXPECT_GE(scene.lamps.size(), 5U);
    EXPECT_EQ(scene.sets.at(0).folder, "sample");
  }
}

}  // namespace
}  // namespace vlp
