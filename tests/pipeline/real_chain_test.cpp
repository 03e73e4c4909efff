// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// The programs from real photographs to figures, when the real captures are there. What is
/// expected comes from the descriptions beside them where no measurement is named.
#include <fmt/core.h>
#include <gmock/gmock.h>

#include <cmath>

#include "camera/lens.h"
#include "captures/fixes_table.h"
#include "geometry/frames.h"
#include "pipeline/intrinsics_program.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"
#include "support/csv_cells.h"
#include "support/real_data.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr double kCeiling_m = 2.46, kFocal_px = 5620;

/// A phone that lay on the floor under five lamps.
class VlpLocateRealLamps : public testing::Test {
 protected:
  const fs::path luxapose = real_data("luxapose");
  const TemporaryFolder folder;

  void SetUp() override {
    if (luxapose.empty()) GTEST_SKIP() << "no real captures here";
  }
  std::string lamps() const { return "'" + (luxapose / "lamps.yaml").string() + "'"; }
  std::string path(const char* name) const { return (folder / name).string(); }

  /// vlp-locate on one image: its lens is a pinhole with a central principal point.
  ProgramResult locate(const char* image, int width_px, int height_px, const char* readout) const {
    fs::create_directory(folder / "images");
    fs::create_symlink(luxapose / image, folder / "images" / image);
    folder.file(
        "calibration.yaml",
        fmt::format("format: vlp-calibration/1\n"
                    "camera: {{id: phone, imager_px: [{}, {}], lens_model: LENSMODEL_PINHOLE, "
                    "intrinsics: [{}, {}, {}, {}], row_time_s: {}, readout: {}}}\n",
                    width_px, height_px, kFocal_px, kFocal_px, (width_px - 1) / 2.0,
                    (height_px - 1) / 2.0, 1 / 47540.0, readout));
    return run_program("vlp-locate " + path("images") + " --lamps " + lamps() + " --calibration " +
                       path("calibration.yaml") + " -o " + path("fixes.csv"));
  }

  FixRow only_fix() const {
    const auto rows = read_fixes(folder / "fixes.csv");
    if (rows.size() != 1 || !rows[0].fix) throw std::runtime_error("not one fix");
    return rows[0];
  }

  /// Lamps of the map that the image holds when it is taken from `camera`.
  std::vector<int> lamps_in_view(const Pose& camera) const {
    const Camera phone = read_calibration(folder / "calibration.yaml").camera;
    const Lens lens(phone.lens_model, phone.intrinsics);
    std::vector<int> ids;
    for (const Lamp& lamp : read_lamp_map(luxapose / "lamps.yaml").lamps) {
      const auto pixel = lens.project_point(level_point_from_world(camera, lamp.position_m));
      if (pixel && pixel->minCoeff() > 0 && pixel->x() < phone.imager_px[0] - 1 &&
          pixel->y() < phone.imager_px[1] - 1) {
        ids.push_back(lamp.id);
      }
    }
    return ids;
  }
};

TEST_F(VlpLocateRealLamps, MaxErrorIsBelow20MmWithFiveLamps) {
  const auto located = locate("x_0_y_1.27.jpg", 7712, 4352, "rows");
  ASSERT_EQ(located.exit_code, 0) << located.errors;
  const FixRow row = only_fix();
  EXPECT_EQ(row.lamps, 5);
  EXPECT_NEAR(kCeiling_m - row.fix->pose.position_m.z(), 2.45, 0.02);
  EXPECT_LT(row.fix->residual_px, 5);  // measured: 4.16, 1.8 mm at the ceiling
  EXPECT_THAT(lamps_in_view(row.fix->pose), testing::ElementsAre(2000, 2500, 3000, 3500, 4000));

  // Within 2 cm of the center; 18.8 mm were measured.
  const auto truth = folder.file("truth.csv", "image,x_m,y_m,z_m\nx_0_y_1.27.jpg,0,0,0.01\n");
  const auto evaluate = [&](const std::string& gates) {
    return run_program("vlp-evaluate " + path("fixes.csv") + " --truth " + truth.string() + gates);
  };
  const auto evaluated =
      evaluate(" --gate max_mm=20 --gate height_rms_mm=20 --gate missing_fraction=0");
  EXPECT_EQ(evaluated.exit_code, 0) << evaluated.output << evaluated.errors;
  EXPECT_EQ(evaluate(" --gate max_mm=18").exit_code, 1);
}

TEST_F(VlpLocateRealLamps, HeightErrorIsBelow20MmWithThreeLamps) {
  const auto located = locate("2014-02-27--18-15-03-62.jpg", 4352, 7712, "columns");
  ASSERT_EQ(located.exit_code, 0) << located.errors;
  // The lamps have no outline: their sigma_px contains the residuals of a lens that is not known.
  EXPECT_THAT(located.errors, testing::Not(HasSubstr("the residuals correspond to ")));
  const FixRow row = only_fix();
  EXPECT_EQ(row.lamps, 3);
  const double distance_m = kCeiling_m - row.fix->pose.position_m.z();
  EXPECT_NEAR(distance_m, 2.346, 0.02);
  EXPECT_NEAR(row.fix->residual_px * distance_m / kFocal_px, 8.3e-3, 1e-3);
  EXPECT_THAT(lamps_in_view(row.fix->pose), testing::ElementsAre(3000, 3500, 4000));
}

/// Another phone, calibrated from its own photographs: what it would reach under those lamps.
TEST_F(VlpIntrinsics, PhoneCalibrationGivesVlpLimitsSdsOfPinholeFormula) {
  const auto board = real_data("apriltag-lattice-phone"), luxapose = real_data("luxapose");
  if (board.empty() || luxapose.empty()) GTEST_SKIP() << "no real captures here";
  const auto calibrated = calibrate(board.string(), (board / "board.yaml").string());
  EXPECT_EQ(calibrated.exit_code, 1);
  EXPECT_THAT(calibrated.errors, HasSubstr("add views, next the board in the bottom left"));
  EXPECT_THAT(calibrated.output, HasSubstr("views         8 used, 0 rejected\n"));
  const Calibration found = read_calibration(folder / "camera.yaml");
  const double rms_px = found.intrinsics_report->rms_px;
  EXPECT_GE(found.intrinsics_report->corners, 1270);  // of 8 x 40 tags
  EXPECT_NEAR(rms_px, 0.229, 0.005);                  // measured

  const auto limits = run_program(
      fmt::format("vlp-limits --lamps '{}' --calibration {} --height-m 0.01 --noise-px {} "
                  "--floor-m 0 0 0 0 --map {}",
                  (luxapose / "lamps.yaml").string(), (folder / "camera.yaml").string(), rms_px,
                  (folder / "map.csv").string()));
  ASSERT_EQ(limits.exit_code, 0) << limits.errors;
  const CsvTable map(folder / "map.csv");
  ASSERT_EQ(map.num_rows(), 1);
  const auto figure = [&](const char* column) { return read_number(map, 0, column); };
  // n lamps about the camera, S the sum of their squared distances from its axis:
  // sd_x = sigma h / (f sqrt(n)), sd_z = sigma h^2 / (f sqrt(S)); the lens stretches the image by
  // up to 3 k1 r^2 = 2 % there, which makes them smaller.
  const double h_m = 2.45, at_ceiling_m = rms_px * h_m / found.camera.focal_px().x();
  EXPECT_EQ(figure("lamps"), 5);
  EXPECT_NEAR(figure("x_sd_m") * std::sqrt(5) / at_ceiling_m, 0.99, 0.01);
  const double apart_m = 2 * std::hypot(0.3556, 0.3683);  // sqrt(S), of four
  EXPECT_NEAR(figure("z_sd_m") * apart_m / (at_ceiling_m * h_m), 0.99, 0.01);
}

}  // namespace
}  // namespace vlp
