// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-rotation end to end.
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <fstream>

#include "captures/detections_table.h"
#include "geometry/angles.h"
#include "rig/calibration.h"
#include "support/near.h"
#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

const std::string kExample = VLP_SOURCE_DIR "/datasets/example/";

double angle_between_deg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return deg_from_rad(std::atan2(a.cross(b).norm(), a.dot(b)));
}

class Rotation : public testing::Test {
 protected:
  ProgramResult rotation(const std::string& captures, const std::string& options = "") const {
    return run_program("vlp-rotation '" + captures + "' --lamps " + kExample +
                       "lamps.yaml --calibration " + kExample + "calibration.yaml -o " +
                       output.string() + " " + options);
  }
  RotationCenter found() const { return *read_calibration(output).rotation_center; }

  /// The captures of the example that `keep` accepts, by their number.
  template <typename Keep>
  std::string captures(const Keep& keep) const {
    std::vector<Frame> kept;
    const auto frames = read_detections(kExample + "turning.csv");
    for (std::size_t i = 0; i < frames.size(); ++i) {
      if (keep(i)) kept.push_back(frames[i]);
    }
    return written(kept);
  }
  std::string written(const std::vector<Frame>& frames) const {
    write_detections(folder / "detections.csv", frames);
    return (folder / "detections.csv").string();
  }
  void expect_refusal(const ProgramResult& result, int exit_code, const std::string& message) {
    EXPECT_EQ(result.exit_code, exit_code);
    EXPECT_THAT(result.errors, HasSubstr(message));
    EXPECT_FALSE(std::filesystem::exists(output));
  }

  const TemporaryFolder folder;
  const std::filesystem::path output = folder / "rotated.yaml";
  const RotationCenter truth = *read_calibration(kExample + "calibration.yaml").rotation_center;
};

TEST_F(Rotation, FindsTiltAndLeverArmOfTheExample) {
  const auto result = rotation(kExample + "turning.csv");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(result.errors, "");
  EXPECT_LT(angle_between_deg(found().zenith_in_camera, truth.zenith_in_camera), 0.01);
  EXPECT_EQ(found().model, RotationModel::tilt);
  ASSERT_TRUE(found().covariance && found().lever_arm_m && found().lever_arm_covariance);
  EXPECT_THAT(*found().lever_arm_m, IsNear(Eigen::Vector2d(0.004, -0.002), 3e-4));
  for (const char* part : {"24 of 24", "centre", "zenith", "tilt        1.30", "lever arm", "sd ",
                           "spread", "residual", "outliers    0", "turn_23.png"}) {
    EXPECT_THAT(result.output, HasSubstr(part));
  }
}

TEST_F(Rotation, KeepsTheCameraAndReplacesItsOwnPart) {
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

TEST_F(Rotation, GivesTheSameBytesTwice) {
  const auto first = rotation(kExample + "turning.csv", "--plot " + (folder / "a.png").string());
  const std::string calibration = TemporaryFolder::content_of(output);
  const auto second = rotation(kExample + "turning.csv", "--plot " + (folder / "b.png").string());
  EXPECT_EQ(TemporaryFolder::content_of(output), calibration);
  EXPECT_EQ(first.output, second.output);
  const std::string picture = TemporaryFolder::content_of(folder / "a.png");
  EXPECT_THAT(picture, StartsWith("\x89PNG"));
  EXPECT_EQ(TemporaryFolder::content_of(folder / "b.png"), picture);
}

TEST_F(Rotation, SaysAtOneHeightWhatItAssumes) {
  const auto result = rotation(captures([](std::size_t i) { return i < 12; }));
  ASSERT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.errors, HasSubstr("cannot be told from a tilt; it is taken as zero"));
  EXPECT_THAT(result.errors, HasSubstr("add captures at a second height"));
  EXPECT_THAT(result.output, HasSubstr("taken as zero"));
  EXPECT_FALSE(found().lever_arm_m);
}

/// On a camera that leans no centre in the image is exact, and the residuals tell.
TEST_F(Rotation, SaysWhenTheNoiseDoesNotExplainTheResiduals) {
  const auto result = rotation(kExample + "turning.csv", "--method joint");
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.errors, HasSubstr("px of noise, 0.05 px are stated"));
}

TEST_F(Rotation, HasTheOtherMethods) {
  for (const std::string method : {"joint", "circle"}) {
    ASSERT_EQ(rotation(kExample + "turning.csv", "--method " + method).exit_code, 0);
    EXPECT_EQ(found().model, RotationModel::shift);
    EXPECT_THAT(found().center_px, IsNear(truth.center_px, 5));
    EXPECT_EQ(read_calibration(output).history[0].options,
              "--lamps lamps.yaml --calibration calibration.yaml --method " + method);
  }
  EXPECT_EQ(rotation(kExample + "turning.csv", "--method guess").exit_code, 2);
}

TEST_F(Rotation, NamesAMisidentifiedLamp) {
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

TEST_F(Rotation, RefusesWhatDoesNotDetermineIt) {
  expect_refusal(rotation(captures([](std::size_t i) { return i < 1; })), 3, "add captures");
  expect_refusal(rotation(captures([](std::size_t i) { return i < 3; })), 3,
                 "less than 90 degrees: add captures");
  auto frames = read_detections(kExample + "turning.csv");
  auto alike = frames;
  for (Frame& frame : alike) frame.detections = frames[0].detections;
  expect_refusal(rotation(written(alike)), 3, "all alike: turn the camera");
  for (Frame& frame : frames) frame.detections.resize(1);
  expect_refusal(rotation(written(frames)), 3, "add lamps");
}

TEST_F(Rotation, RefusesTheMapOfAnotherRoom) {
  const std::string map = "format: vlp-lamps/1\nlamps:\n";
  const auto other = [&](const std::string& lamps) {
    return run_program("vlp-rotation " + kExample + "turning.csv --lamps " +
                       folder.file("other.yaml", map + lamps).string() + " --calibration " +
                       kExample + "calibration.yaml -o " + output.string());
  };
  expect_refusal(
      other("  - {id: 11, position_m: [0, 0, 2]}\n  - {id: 12, position_m: [1, 0, 2]}\n"), 2,
      "other.yaml");
  expect_refusal(other("  - {id: 1, position_m: [0.3, 0, 2]}\n  - {id: 2, position_m: [1, 0, 2]}\n"
                       "  - {id: 3, position_m: [1, 0.9, 2]}\n"
                       "  - {id: 4, position_m: [-2, 0.9, 2]}\n"),
                 2, "is it the map of this room?");
}

TEST_F(Rotation, RefusesToWriteOverAnInput) {
  const std::string lamps = kExample + "lamps.yaml";
  EXPECT_EQ(rotation(kExample + "turning.csv", "--plot " + lamps).exit_code, 2);
}

/// From rendered images, with the lens known: the whole way from pixels.
TEST(RotationRendered, FindsTheZenith) {
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
