// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-adjust as its users call it.
#include <gmock/gmock.h>

#include <numbers>

#include "calibration/adjustment/adjustment.h"
#include "captures/detections_table.h"
#include "support/csv_cells.h"
#include "support/program.h"
#include "support/random.h"
#include "support/synthetic_rig.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;

class VlpAdjust : public testing::Test {
 protected:
  TemporaryFolder folder;
  SyntheticRig rig{synthetic_lamps(), {synthetic_camera(), {}, {}, {}, {}}, {{0, 0, 0}, 0}, {}};
  const RotationCenter rotation_center = tilted_by(rig.calibration.camera, 0.02, 1);
  std::vector<Frame> frames;
  std::string captures = "image,pivot,x_m,y_m,z_m,reference_point,position_sd_m\n";

  VlpAdjust() {
    rig.calibration.rotation_center = rotation_center;
    int spot = 0;
    for (const Eigen::Vector3d& axis_m : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0.4, 0.2, 0.2),
                                          Eigen::Vector3d(-0.4, 0.1, 0)}) {
      ++spot;
      for (int k = 0; k < 8; ++k) {
        const double yaw_rad = 2 * std::numbers::pi * k / 8;
        const Eigen::Vector3d arm_m = rotation_about_z(yaw_rad) * Eigen::Vector3d(0.009, 0, 0);
        rig.camera = {axis_m + arm_m, yaw_rad};
        const std::string name = std::to_string(frames.size());
        frames.push_back({name, seen_from(rig, 0.05)});
        captures += name + ",s" + std::to_string(spot) + "," + std::to_string(axis_m.x()) + "," +
                    std::to_string(axis_m.y()) + "," + std::to_string(axis_m.z()) +
                    ",axis,0.0001\n";
      }
    }
    rig.calibration.rotation_center.reset();
  }

  ProgramResult adjust(const std::string& options) {
    write_lamp_map(folder / "lamps.yaml", rig.map);
    write_calibration(folder / "camera.yaml", rig.calibration);
    write_detections(folder / "detections.csv", frames);
    folder.file("captures.csv", captures);
    const auto path = [&](const char* name) { return (folder / name).string() + " "; };
    return run_program("vlp-adjust " + path("detections.csv") + "--lamps " + path("lamps.yaml") +
                       "--calibration " + path("camera.yaml") + "-o " + path("adjusted.yaml") +
                       options);
  }
  std::string refined() { return "--refine-map " + (folder / "refined.yaml").string(); }
};

TEST_F(VlpAdjust, ReducesMapErrorsAndAddsCalibrationUncertaintyToFixes) {
  const LampMap truth = rig.map;
  Random random(1);
  for (Lamp& lamp : rig.map.lamps) {
    lamp.sd_m = 0.002;
    for (double& one : lamp.position_m) one += 0.002 * random.normal();
  }
  const ProgramResult result = adjust(refined());
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("captures    24 used, 0 rejected"));
  const LampMap map = read_lamp_map(folder / "refined.yaml");
  for (std::size_t i = 0; i < 8; ++i) {
    // The captures are exact; what is left is what the survey's 2 mm still weigh.
    EXPECT_LT((map.lamps[i].position_m - truth.lamps[i].position_m).norm(), 1e-4);
    EXPECT_GT(*map.lamps[i].sd_m, 0);
  }
  const Calibration calibration = read_calibration(folder / "adjusted.yaml");
  EXPECT_NEAR(calibration.rotation_center->lever_arm_m->x(), 0.009, 1e-6);
  ASSERT_TRUE(calibration.adjustment);
  EXPECT_EQ(calibration.history.back().part, "adjustment");
  const std::string once = TemporaryFolder::read_content(folder / "adjusted.yaml");
  ASSERT_EQ(adjust(refined()).exit_code, 0);
  EXPECT_EQ(TemporaryFolder::read_content(folder / "adjusted.yaml"), once);

  const auto path = [&](const char* name) { return (folder / name).string() + " "; };
  const ProgramResult located =
      run_program("vlp-locate " + path("detections.csv") + "--lamps " + path("refined.yaml") +
                  "--calibration " + path("adjusted.yaml") + "-o " + path("fixes.csv"));
  ASSERT_EQ(located.exit_code, 0) << located.errors;
  const CsvTable fixes(folder / "fixes.csv");
  EXPECT_GT(read_number(fixes, 0, "x_sd_m"), read_number(fixes, 0, "x_noise_sd_m"));
}

TEST_F(VlpAdjust, AsksForSecondHeightForOneCaptureOfTwoLamps) {
  frames.resize(1);
  frames[0].detections.resize(2);
  captures = "image,pivot\n0,s\n";
  const ProgramResult result = adjust("--map-sd-m 0.01");
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.errors, HasSubstr("a second height"));
}

}  // namespace
}  // namespace vlp
