// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-locate as its users call it.
#include <gmock/gmock.h>

#include "captures/detections_table.h"
#include "support/csv_cells.h"
#include "support/program.h"
#include "support/synthetic_rig.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;

class VlpLocate : public testing::Test {
 protected:
  TemporaryFolder folder;
  SyntheticRig rig{
      synthetic_lamps(), {synthetic_camera(), {}, {}, {}, {}}, {{0.1, -0.2, 0.05}, 0.5}, {}};

  ProgramResult locate(const std::vector<Frame>& frames, const std::string& options = "") {
    write_lamp_map(folder / "lamps.yaml", rig.map);
    write_calibration(folder / "calibration.yaml", rig.calibration);
    write_detections(folder / "detections.csv", frames);
    const auto path = [&](const char* name) { return (folder / name).string() + " "; };
    return run_program("vlp-locate " + path("detections.csv") + "--lamps " + path("lamps.yaml") +
                       "--calibration " + path("calibration.yaml") + "-o " + path("fixes.csv") +
                       options);
  }
  double figure(std::size_t row, const char* column) {
    const CsvTable fixes(folder / "fixes.csv");
    return read_number(fixes, row, column);
  }
  std::string word(std::size_t row, const char* column) {
    const CsvTable fixes(folder / "fixes.csv");
    return read_text(fixes, row, column);
  }
  std::vector<Detection> seen(std::size_t lamps, std::optional<double> sigma_px = 0.1) {
    auto detections = seen_from(rig);
    detections.resize(lamps);
    for (Detection& detection : detections) detection.sigma_px = sigma_px;
    return detections;
  }
};

TEST_F(VlpLocate, WritesRowPerFrameWithFixOrStatus) {
  auto swapped = seen(8);
  std::swap(swapped[0].lamp, swapped[1].lamp);
  auto unknown = seen(3);
  unknown[0].lamp = 99;
  const auto result =
      locate({{"two", seen(2)}, {"one", seen(1)}, {"swapped", swapped}, {"99", unknown}});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(word(0, "status"), "ok");
  EXPECT_NEAR(figure(0, "x_m"), 0.1, 1e-5);
  EXPECT_NEAR(figure(0, "z_m"), 0.05, 1e-5);
  EXPECT_EQ(word(1, "status"), "too_few_lamps");
  EXPECT_EQ(word(1, "x_m"), "");
  EXPECT_EQ(figure(2, "lamps"), 6);
  EXPECT_EQ(figure(3, "lamps"), 2);
  EXPECT_THAT(result.output, HasSubstr("fixes       3\n"));
  EXPECT_THAT(result.output, HasSubstr("1 too_few_lamps"));
  EXPECT_THAT(result.errors, HasSubstr("1 detections of lamps not in the map"));
  EXPECT_THAT(result.errors, HasSubstr("2 detections that contradict the others"));
}

TEST_F(VlpLocate, UsesInclinationHeightAndYawOfCapturesTable) {
  rig.inclination = {0.05, -0.03};
  const auto captures =
      folder.file("captures.csv", "image,roll_rad,pitch_rad,z_m,yaw_rad\na,0.05,-0.03,0.05,0.5\n");
  const std::string with_captures = "--captures " + captures.string();
  ASSERT_EQ(locate({{"a", seen(4)}}, with_captures).exit_code, 0);
  EXPECT_NEAR(figure(0, "x_m"), 0.1, 1e-5);
  const double sd_m = figure(0, "x_sd_m");
  locate({{"a", seen(4)}}, with_captures + " --inclination-sigma-deg 0.1");
  EXPECT_GT(figure(0, "x_sd_m"), 2 * sd_m);
  const auto refused = locate({{"a", seen(1)}}, with_captures);
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.errors, HasSubstr("no frame has a fix; the first: fewer than two lamps"));
  EXPECT_EQ(word(0, "status"), "too_few_lamps") << "the rows are written all the same";
  ASSERT_EQ(locate({{"a", seen(1)}}, with_captures + " --one-lamp").exit_code, 0);
  EXPECT_NEAR(figure(0, "x_m"), 0.1, 1e-5);
}

TEST_F(VlpLocate, WritesRobotPoseWithTiltCorrectionUnlessOptionIsNone) {
  rig.calibration.rotation_center = tilted_by(rig.calibration.camera, 0.03, 1);
  const std::string on_robot = "--camera-on-robot 0.3 0 0.2 90 ";
  const double robot_yaw_rad = 0.5 - M_PI / 2;
  const auto error_m = [&] {
    return std::hypot(figure(0, "x_m") - 0.1 + 0.3 * std::cos(robot_yaw_rad),
                      figure(0, "y_m") + 0.2 + 0.3 * std::sin(robot_yaw_rad));
  };
  for (const std::string options : {"", "--quiet --correction rotation"}) {
    const auto result = locate({{"a", seen(4)}}, on_robot + options);
    EXPECT_EQ(result.output.empty(), !options.empty());
    EXPECT_LT(error_m(), 1e-5) << options;
    EXPECT_NEAR(figure(0, "yaw_rad"), robot_yaw_rad, 1e-5);
    EXPECT_NEAR(figure(0, "z_m"), 0.05 - 0.2, 1e-5);
  }
  locate({{"a", seen(4)}}, on_robot + "--correction none");
  EXPECT_GT(error_m(), 0.02);
}

}  // namespace
}  // namespace vlp
