// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-rotation end to end.
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>

#include "geometry/angles.h"
#include "rotation_program.h"
#include "support/matchers.h"

namespace vlp {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

double angle_between_deg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return deg_from_rad(std::atan2(a.cross(b).norm(), a.dot(b)));
}

TEST_F(VlpRotation, EstimatesTrueTiltAndLeverArmOfExample) {
  const auto result = rotation(kExample + "turning.csv");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(result.errors, "");
  EXPECT_LT(angle_between_deg(found().zenith_in_camera, truth.zenith_in_camera), 0.01);
  EXPECT_EQ(found().model, RotationModel::tilt);
  ASSERT_TRUE(found().lever_arm_m);
  EXPECT_EQ(read_calibration(output).covariance.value().parameters,
            (std::vector<std::string>{"zenith_x", "zenith_y", "lever_arm_x_m", "lever_arm_y_m"}));
  EXPECT_THAT(*found().lever_arm_m, IsNear(Eigen::Vector2d(0.004, -0.002), 3e-4));
  for (const char* part : {"24 of 24", "center", "zenith", "tilt        1.30", "lever arm", "sd ",
                           "spread", "residual", "outliers    0", "turn_23.png"}) {
    EXPECT_THAT(result.output, HasSubstr(part));
  }
}

TEST_F(VlpRotation, SecondRunKeepsCameraAndReplacesRotationCenter) {
  ASSERT_EQ(rotation(kExample + "turning.csv").exit_code, 0);
  ASSERT_EQ(run_program("vlp-rotation -q " + kExample + "turning.csv --lamps " + kExample +
                        "lamps.yaml --calibration " + output.string() + " -o " +
                        (folder / "again.yaml").string())
                .exit_code,
            0);
  const Calibration again = read_calibration(folder / "again.yaml");
  EXPECT_EQ(again.camera.id, "example");
  ASSERT_EQ(again.history.size(), 1U);
  EXPECT_EQ(again.history[0].part, "rotation_center");
  EXPECT_EQ(again.history[0].options, "--lamps lamps.yaml --calibration rotated.yaml");
  EXPECT_EQ(again.history[0].inputs.size(), 3U);
  EXPECT_THAT(again.rotation_center->center_px, IsNear(found().center_px, 1e-6));
}

TEST_F(VlpRotation, WritesIdenticalCalibrationAndPlotOnRepeat) {
  const auto first = rotation(kExample + "turning.csv", "--plot " + (folder / "a.png").string());
  const std::string calibration = TemporaryFolder::read_content(output);
  const auto second = rotation(kExample + "turning.csv", "--plot " + (folder / "b.png").string());
  EXPECT_EQ(TemporaryFolder::read_content(output), calibration);
  EXPECT_EQ(first.output, second.output);
  const std::string picture = TemporaryFolder::read_content(folder / "a.png");
  EXPECT_THAT(picture, StartsWith("\x89PNG"));
  EXPECT_EQ(TemporaryFolder::read_content(folder / "b.png"), picture);
}

/// Lamps at 2.4 to 2.6 m, camera at one height. Rendered images give realistic noise.
TEST_F(VlpRotation, EstimatesTrueLeverArmFromLampsAtSeveralHeights) {
  const std::string rendered = (folder / "wide").string();
  ASSERT_EQ(run_program("vlp-simulate -q " VLP_SOURCE_DIR
                        "/datasets/wide/scene.yaml --only rotation -o " +
                        rendered)
                .exit_code,
            0);
  for (int i = 12; i < 24; ++i) {  // those at the second height
    std::filesystem::remove(rendered + "/rotation/00" + std::to_string(i) + ".png");
  }
  const auto result = run_program("vlp-rotation " + rendered + "/rotation --lamps " + rendered +
                                  "/lamps.yaml --calibration " + rendered +
                                  "/true_calibration.yaml -o " + output.string());
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(result.errors, "");
  const auto expected = *read_calibration(rendered + "/true_calibration.yaml").rotation_center;
  // Without the lever arm it is 0.21 degrees.
  EXPECT_LT(angle_between_deg(found().zenith_in_camera, expected.zenith_in_camera), 0.02);
  ASSERT_TRUE(found().lever_arm_m);
  EXPECT_THAT(*found().lever_arm_m, IsNear(Eigen::Vector2d(0.01, 0.005), 1e-3));
}

TEST_F(VlpRotation, WarnsOfAssumedZeroLeverArmAtOneHeight) {
  auto frames = read_detections(kExample + "turning.csv");
  frames.resize(12);
  for (Frame& frame : frames) {  // without the only lamp that hangs lower
    std::erase_if(frame.detections, [](const Detection& one) { return one.lamp == 5; });
  }
  const auto result = rotation(written(frames));
  ASSERT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.errors, HasSubstr("cannot be separated; the lever arm is assumed to be zero"));
  EXPECT_THAT(result.errors, HasSubstr("add captures at a second height"));
  EXPECT_THAT(result.output, HasSubstr("assumed to be zero"));
  EXPECT_FALSE(found().lever_arm_m);
}

TEST_F(VlpRotation, WarnsOfResidualsAboveStatedNoise) {
  auto frames = read_detections(kExample + "turning.csv");
  for (Frame& frame : frames) {
    for (Detection& detection : frame.detections) detection.sigma_px = 0.01;
  }
  const auto result = rotation(written(frames));
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.errors, HasSubstr("px of noise, 0.01 px are stated"));
}

TEST_F(VlpRotation, MethodCircleEstimatesCenterWithin5Px) {
  ASSERT_EQ(rotation(kExample + "turning.csv", "--method circle").exit_code, 0);
  EXPECT_EQ(found().model, RotationModel::shift);
  EXPECT_THAT(found().center_px, IsNear(truth.center_px, 5));
  EXPECT_EQ(read_calibration(output).history[0].options,
            "--lamps lamps.yaml --calibration calibration.yaml --method circle");
  EXPECT_EQ(rotation(kExample + "turning.csv", "--method guess").exit_code, 2);
}

TEST_F(VlpRotation, CircleMethodWarnsOfMissingSdForThreePointsPerCircle) {
  const auto result =
      rotation(captures([](std::size_t i) { return i % 4 == 0; }), "--method circle");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_FALSE(read_calibration(output).covariance);
  EXPECT_THAT(result.errors, HasSubstr("no standard deviation: add captures"));
  const auto full = rotation(kExample + "turning.csv", "--method circle");
  ASSERT_EQ(full.exit_code, 0) << full.errors;
  EXPECT_TRUE(read_calibration(output).covariance);
  EXPECT_THAT(full.errors, testing::Not(HasSubstr("no standard deviation")));
}

TEST_F(VlpRotation, NamesSwappedDetectionsAndEstimatesTrueZenith) {
  auto frames = read_detections(kExample + "turning.csv");
  std::swap(frames[5].detections[0].pixel, frames[5].detections[1].pixel);
  const auto result = rotation(written(frames));
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_LT(angle_between_deg(found().zenith_in_camera, truth.zenith_in_camera), 0.01);
  for (const Detection& wrong : {frames[5].detections[0], frames[5].detections[1]}) {
    EXPECT_THAT(result.output + result.errors,
                HasSubstr("turn_05.png lamp " + std::to_string(wrong.lamp)));
  }
}

/// From rendered images, with the lens known: the whole way from pixels.
TEST(VlpRotationOfRenderedImages, EstimatesTrueZenithAndLeverArm) {
  for (const std::string rig : {"paper-rig", "paper-rig-faulty"}) {
    SCOPED_TRACE(rig);
    const TemporaryFolder folder;
    const std::string rendered = (folder / "rendered").string();
    ASSERT_EQ(run_program("vlp-simulate -q " VLP_SOURCE_DIR "/datasets/" + rig +
                          "/scene.yaml --only rotation -o " + rendered)
                  .exit_code,
              0);
    const auto result = run_program("vlp-rotation " + rendered + "/rotation --lamps " + rendered +
                                    "/lamps.yaml --calibration " + rendered +
                                    "/true_calibration.yaml -o " + (folder / "r.yaml").string());
    ASSERT_EQ(result.exit_code, 0) << result.errors;
    const auto found = *read_calibration(folder / "r.yaml").rotation_center;
    const auto truth = *read_calibration(rendered + "/true_calibration.yaml").rotation_center;
    // The sd that is reported is 0.0006 degrees.
    EXPECT_LT(angle_between_deg(found.zenith_in_camera, truth.zenith_in_camera), 0.003);
    const Eigen::Vector2d lever_arm_m =
        rig == "paper-rig" ? Eigen::Vector2d(0.002, -0.001) : Eigen::Vector2d(0.012, -0.009);
    EXPECT_THAT(*found.lever_arm_m, IsNear(lever_arm_m, 1e-4));
  }
}

}  // namespace
}  // namespace vlp
