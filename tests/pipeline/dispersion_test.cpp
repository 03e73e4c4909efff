// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-dispersion as its users call it.
#include <gmock/gmock.h>

#include "captures/detections_table.h"
#include "support/csv_cells.h"
#include "support/program.h"
#include "support/synthetic_rig.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;

class VlpDispersion : public testing::Test {
 protected:
  TemporaryFolder folder;
  SyntheticRig rig{synthetic_lamps(), {synthetic_camera(), {}, {}, {}, {}}, {{0, 0, 0}, 0}, {}};
  Calibration believed;

  VlpDispersion() {
    rig.calibration.rotation_center = tilted_by(rig.calibration.camera, 0.03, 1);
    believed = rig.calibration;
    believed.rotation_center = tilted_by(believed.camera, 0.02, 1.5);
    believed.dispersion = Dispersion{{50, 50}, 0, {0, 0}, 1};  // an old one
    write_lamp_map(folder / "lamps.yaml", rig.map);
    write_calibration(folder / "rotated.yaml", believed);
  }
  std::string path(const std::string& name) const { return (folder / name).string() + " "; }

  std::vector<Frame> turn(int count, double arc_rad) {
    std::vector<Frame> frames;
    for (int i = 0; i < count; ++i) {
      rig.camera = {{0.1, -0.05, 0.02}, arc_rad * i / count};
      frames.push_back({std::to_string(i) + ".png", seen_from(rig, 0.1)});
    }
    return frames;
  }
  ProgramResult dispersion(const std::vector<Frame>& frames, const std::string& options) {
    write_detections(folder / "detections.csv", frames);
    return run_program("vlp-dispersion " + path("detections.csv") + "--lamps " +
                       path("lamps.yaml") + "--calibration " + path("rotated.yaml") + "-o " +
                       path("calibration.yaml") + options);
  }
};

TEST_F(VlpDispersion, CorrectedCalibrationYieldsExactFixAtOtherPosition) {
  const auto result = dispersion(turn(12, 6.28), "--reference-point 0.102 -0.051");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("captures    12, 12 used, 0 rejected"));
  EXPECT_THAT(result.output, HasSubstr("world       -2.000 1.000 mm"));
  EXPECT_THAT(result.output, HasSubstr("after       radius 0.000 mm, center -2.000 1.000 mm"));
  const Calibration written = read_calibration(folder / "calibration.yaml");
  EXPECT_EQ(written.rotation_center->zenith_in_camera, believed.rotation_center->zenith_in_camera);
  EXPECT_EQ(written.dispersion->captures, 12);
  EXPECT_GT(written.dispersion->radius_m, 0.01) << "of the circle before";
  ASSERT_EQ(written.history.size(), 1);
  EXPECT_EQ(written.history[0].options,
            "--lamps lamps.yaml --calibration rotated.yaml --reference-point 0.102 -0.051");

  rig.camera = {{-0.3, 0.2, 0.25}, -2};
  write_detections(folder / "elsewhere.csv", {{"a", seen_from(rig, 0.1)}});
  const auto located =
      run_program("vlp-locate " + path("elsewhere.csv") + "--lamps " + path("lamps.yaml") +
                  "--calibration " + path("calibration.yaml") + "-o " + path("fixes.csv"));
  ASSERT_EQ(located.exit_code, 0) << located.errors;
  const CsvTable fixes(folder / "fixes.csv");
  EXPECT_NEAR(read_number(fixes, 0, "x_m"), -0.3, 2e-6);
  EXPECT_NEAR(read_number(fixes, 0, "y_m"), 0.2, 2e-6);
  EXPECT_NEAR(read_number(fixes, 0, "z_m"), 0.25, 2e-6);
}

/// From images at the reference point of a scene: a camera whose rotation center has an error of
/// 2 px and -3 px.
TEST(VlpDispersionOfRenderedImages, OffsetIsNegativeErrorOfRotationCenter) {
  const TemporaryFolder folder;
  const std::string rendered = (folder / "rendered").string();
  const auto simulated = run_program("vlp-simulate -q " VLP_SOURCE_DIR
                                     "/datasets/paper-rig/scene.yaml --only "
                                     "dispersion -o " +
                                     rendered);
  ASSERT_EQ(simulated.exit_code, 0) << simulated.errors;
  Calibration calibration = read_calibration(rendered + "/true_calibration.yaml");
  // As if the rotation center were wrong by 2 and -3 px.
  RotationCenter& center = *calibration.rotation_center;
  center.zenith_in_camera += Eigen::Vector3d(2 / calibration.camera.focal_px().x(),
                                             -3 / calibration.camera.intrinsics[1], 0);
  center.zenith_in_camera.normalize();
  write_calibration(folder / "rotated.yaml", calibration);
  const std::string files = " --lamps " + rendered + "/lamps.yaml --calibration ";
  const auto result = run_program("vlp-dispersion " + rendered + "/dispersion" + files +
                                  (folder / "rotated.yaml").string() + " -o " +
                                  (folder / "calibration.yaml").string());
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const Dispersion found = *read_calibration(folder / "calibration.yaml").dispersion;
  EXPECT_NEAR(found.offset_px.x(), -2, 0.01);
  EXPECT_NEAR(found.offset_px.y(), 3, 0.01);
  // A tilt puts fixes off by more than H delta, as the lamps are not straight above.
  EXPECT_NEAR(found.radius_m, 1.6 * std::hypot(2, 3) / 520, 0.0015);
  EXPECT_EQ(found.captures, 40);
}

}  // namespace
}  // namespace vlp
