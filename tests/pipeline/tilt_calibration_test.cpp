// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-rotation --method lamps as its users call it.
#include <gmock/gmock.h>

#include "captures/detections_table.h"
#include "rig/calibration_error.h"
#include "rig/lamp_map.h"
#include "support/body_rig.h"
#include "support/program.h"
#include "support/synthetic_rig.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;

class VlpRotationByLamps : public testing::Test {
 protected:
  TemporaryFolder folder;
  SyntheticRig rig{synthetic_lamps(), {synthetic_camera(), {}, {}, {}, {}}, {{0, 0, 0}, 0}, {}};
  LampMap surveyed = rig.map;
  Random random{1};

  VlpRotationByLamps() {
    rig.calibration.rotation_center = tilted_by(rig.calibration.camera, 0.06, 1);
  }
  std::string path(const std::string& name) const { return (folder / name).string() + " "; }

  std::vector<Frame> drive(int count, double sigma_px = 0.1) {
    std::vector<Frame> frames;
    for (int i = 0; i < count; ++i) {
      rig.camera = {{random.uniform(-0.5, 0.5), random.uniform(-0.3, 0.3), 0}, 0.7 * i};
      frames.push_back({std::to_string(i), seen_from(rig, sigma_px)});
    }
    return frames;
  }
  ProgramResult level(const std::vector<Frame>& frames, const std::string& options = "") {
    Calibration camera_with_dispersion = rig.calibration;
    camera_with_dispersion.rotation_center.reset();
    camera_with_dispersion.dispersion = Dispersion{{1, 2}, 0, {0, 0}, 1};
    write_calibration(folder / "camera.yaml", camera_with_dispersion);
    write_lamp_map(folder / "lamps.yaml", surveyed);
    write_detections(folder / "detections.csv", frames);
    return run_program("vlp-rotation --method lamps " + path("detections.csv") + "--lamps " +
                       path("lamps.yaml") + "--calibration " + path("camera.yaml") + "-o " +
                       path("leveled.yaml") + options);
  }
};

TEST_F(VlpRotationByLamps, WritesTrueTiltAndDropsDispersion) {
  auto frames = drive(10);
  frames[3].detections.resize(2);
  const auto result = level(frames);
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.output,
              HasSubstr("captures    9 used, 1 of fewer than three lamps, 0 rejected"));
  EXPECT_THAT(result.output, HasSubstr("tilt        3.4377 deg towards 57.3 deg"));
  const Calibration written = read_calibration(folder / "leveled.yaml");
  const RotationCenter& truth = *rig.calibration.rotation_center;
  EXPECT_EQ(written.rotation_center->model, RotationModel::tilt);
  EXPECT_LT((written.rotation_center->zenith_in_camera - truth.zenith_in_camera).norm(), 1e-6);
  EXPECT_LT((written.rotation_center->center_px - truth.center_px).norm(), 1e-3);
  EXPECT_TRUE(find_parameter_covariance(written, kZenithParameter).has_value());
  EXPECT_FALSE(written.dispersion.has_value()) << "it rested on what was before";
  EXPECT_EQ(written.history.back().options,
            "--lamps lamps.yaml --calibration camera.yaml --method lamps");
}

TEST_F(VlpRotationByLamps, RefineMapRestoresTrueLampDistancesUpToScale) {
  for (Lamp& lamp : rig.map.lamps) lamp.position_m.x() += random.uniform(-0.004, 0.004);
  const auto plain = level(drive(20));
  EXPECT_THAT(plain.errors, HasSubstr("--refine-map may help"));
  const auto result = level(drive(20), "--refine-map " + path("refined.yaml"));
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("correction x y z (mm)"));
  const LampMap refined = read_lamp_map(folder / "refined.yaml");
  // Whatever the map as a whole does, distances between lamps keep their proportions.
  const auto distance = [](const LampMap& map, std::size_t i, std::size_t k) {
    return (map.lamps[i].position_m - map.lamps[k].position_m).norm();
  };
  const double scale = distance(refined, 0, 2) / distance(rig.map, 0, 2);
  double worst_before_m = 0;
  for (std::size_t i = 0; i < 8; ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      EXPECT_NEAR(distance(refined, i, k), scale * distance(rig.map, i, k), 1e-5);
      worst_before_m = std::max(
          worst_before_m, std::abs(distance(surveyed, i, k) - scale * distance(rig.map, i, k)));
    }
  }
  EXPECT_GT(worst_before_m, 1e-3);
  EXPECT_EQ(
      read_calibration(folder / "leveled.yaml").history.back().options,
      "--lamps lamps.yaml --calibration camera.yaml --method lamps --refine-map refined.yaml");
}

/// One that drives at 1 m/s, by odometry in captures.csv, by its greatest speed, and left out.
TEST_F(VlpRotationByLamps, TiltErrorDecreasesWithOdometryOrMaximumSpeed) {
  BodyRig body{rig.map, rolling_calibration(), {}, {}};
  body.calibration.rotation_center = rig.calibration.rotation_center;
  rig.calibration.camera = body.calibration.camera;
  std::vector<Frame> frames;
  std::string captures = "image,vx_m_per_s,vy_m_per_s,velocity_sd_m_per_s,yaw_rate_rad_per_s\n";
  for (int i = 0; i < 16; ++i) {
    body.body.pose = {{random.uniform(-0.5, 0.5), random.uniform(-0.3, 0.3), 0}, 0.4 * i};
    body.body.motion = {{std::cos(0.7 * i), std::sin(0.7 * i)}, 0.5, {0, 0}};
    frames.push_back({std::to_string(i), with_noise(seen_from(body, 0.05), random)});
    const Eigen::Vector2d& v = body.body.motion.velocity_m_per_s;
    captures += frames.back().image + "," + std::to_string(v.x()) + "," + std::to_string(v.y()) +
                ",0.01,0.5\n";
  }
  const auto error_rad = [&](const std::string& options) {
    const auto result = level(frames, options);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    const Calibration written = read_calibration(folder / "leveled.yaml");
    return (written.rotation_center->zenith_in_camera -
            rig.calibration.rotation_center->zenith_in_camera)
        .norm();
  };
  const double left_out = error_rad("");
  const std::string odometry = "--captures " + folder.file("captures.csv", captures).string();
  EXPECT_LT(error_rad(odometry), 0.2 * left_out);
  const auto options = read_calibration(folder / "leveled.yaml").history.back().options;
  EXPECT_THAT(options, HasSubstr("--captures captures.csv"));
  EXPECT_LT(error_rad("--max-speed-m-per-s 2"), 0.3 * left_out);
  rig.calibration.camera.row_time_s.reset();
  for (const std::string& moves : {odometry, std::string("--max-speed-m-per-s 2")}) {
    const auto refused = level(frames, moves);
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_THAT(refused.errors, HasSubstr("a moving camera needs row_time_s and readout"));
  }
}

TEST_F(VlpRotationByLamps, RejectsTooFewOrEqualCapturesAndOtherMap) {
  const auto one = level(drive(1));
  EXPECT_EQ(one.exit_code, 3);
  EXPECT_THAT(one.errors, HasSubstr("add captures"));
  EXPECT_FALSE(std::filesystem::exists(folder / "leveled.yaml"));
  const auto alike = level({20, drive(1)[0]});
  EXPECT_EQ(alike.exit_code, 2) << "one image twice is a file that is wrong: " << alike.errors;
  auto frames = drive(1);
  for (int i = 0; i < 9; ++i) frames.push_back({"again" + std::to_string(i), frames[0].detections});
  EXPECT_THAT(level(frames).errors, HasSubstr("all captures have one position and yaw"));
  frames = drive(5);
  for (Frame& frame : frames) frame.detections.resize(2);
  EXPECT_EQ(level(frames).exit_code, 3);
  for (Lamp& lamp : surveyed.lamps) lamp.id += 100;
  const auto other_map = level(drive(5));
  EXPECT_EQ(other_map.exit_code, 2);
  EXPECT_THAT(other_map.errors, HasSubstr("lamps.yaml: has none of the lamps"));
}

TEST_F(VlpRotationByLamps, RejectsOverwrittenInputsAndOptionsOfOtherMethods) {
  EXPECT_EQ(level(drive(5), "--refine-map " + path("leveled.yaml")).exit_code, 2);
  EXPECT_EQ(level(drive(5), "--refine-map " + path("lamps.yaml")).exit_code, 2);
  EXPECT_EQ(level(drive(5), "--plot " + path("a.png")).exit_code, 2);
  const auto axis = run_program("vlp-rotation " + path("detections.csv") + "--lamps " +
                                path("lamps.yaml") + "--calibration " + path("camera.yaml") +
                                "-o " + path("r.yaml") + "--refine-map " + path("s.yaml"));
  EXPECT_EQ(axis.exit_code, 2);
  EXPECT_THAT(axis.errors, HasSubstr("--refine-map needs --method lamps"));
  const auto driving = run_program("vlp-rotation " + path("detections.csv") + "--lamps " +
                                   path("lamps.yaml") + "--calibration " + path("camera.yaml") +
                                   "-o " + path("r.yaml") + "--max-speed-m-per-s 1");
  EXPECT_EQ(driving.exit_code, 2);
  EXPECT_THAT(driving.errors, HasSubstr("--max-speed-m-per-s needs --method lamps"));
}

}  // namespace
}  // namespace vlp
