// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-rotation --method lamps as its users call it.
#include <gmock/gmock.h>

#include "captures/detections_table.h"
#include "rig/calibration_error.h"
#include "rig/lamp_map.h"
#include "support/program.h"
#include "support/random.h"
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

}  // namespace
}  // namespace vlp
