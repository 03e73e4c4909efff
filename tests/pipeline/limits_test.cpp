// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-limits as its users call it.
#include <gmock/gmock.h>

#include <cmath>

#include "captures/csv_reader.h"
#include "positioning/stated_rig.h"
#include "rig/calibration_builder.h"
#include "support/program.h"
#include "support/synthetic_rig.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

const std::string kLimits = "vlp-limits --lamps " VLP_SOURCE_DIR
                            "/datasets/example/lamps.yaml --calibration " VLP_SOURCE_DIR
                            "/datasets/example/calibration.yaml --height-m 0 --noise-px 0.1 ";

TEST(VlpLimits, PrintsErrorOfEachSourceAndTotal) {
  const auto result =
      run_program(kLimits + "--principal-point-px 1 --tilt-deg 0.5 --lamp-map-mm 1");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  for (const char* row : {"noise", "principal point", "tilt", "lamp map", "total"}) {
    EXPECT_THAT(result.output, HasSubstr(std::string("\n") + row));
  }
  // Median over the floor, the first number of a row.
  const auto horizontal_mm = [&](const std::string& row) {
    const auto at = result.output.find("\n" + row);
    return at == std::string::npos ? -1 : std::stod(result.output.substr(at + 1 + row.size()));
  };
  // 0.1 px and 1 px are about 0.2 mm and 5 mm, half a degree on each of two axes is about 20 mm.
  EXPECT_NEAR(horizontal_mm("noise"), 0.24, 0.05);
  EXPECT_NEAR(horizontal_mm("principal point"), 4.6, 0.5);
  EXPECT_NEAR(horizontal_mm("tilt"), 20.6, 1);
  EXPECT_NEAR(horizontal_mm("lamp map"), 0.77, 0.1);
  EXPECT_NEAR(horizontal_mm("total"),
              std::hypot(horizontal_mm("principal point"), horizontal_mm("tilt"),
                         std::hypot(horizontal_mm("noise"), horizontal_mm("lamp map"))),
              0.2);
}

TEST(VlpLimits, WritesErrorMapAsCsvAndPng) {
  const TemporaryFolder folder;
  const auto result =
      run_program(kLimits + "--tilt-deg 1 --floor-m -0.2 0.2 0 0.1 --step-m 0.1 --map " +
                  (folder / "map.csv").string() + " --picture " + (folder / "map.png").string());
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const CsvTable map(folder / "map.csv");
  ASSERT_EQ(map.num_rows(), 5 * 2);
  for (std::size_t row = 0; row < map.num_rows(); ++row) {
    const double noise_m = map.get_cell_number(row, map.get_required_column("noise_m"));
    const double tilt_m = map.get_cell_number(row, map.get_required_column("tilt_m"));
    // 0.1 px is about 0.2 mm, one degree on each of two axes at 1.6 m about 40 mm.
    EXPECT_GT(noise_m, 0.1e-3);
    EXPECT_LT(noise_m, 0.5e-3);
    EXPECT_NEAR(tilt_m, 40e-3, 8e-3);
    EXPECT_NEAR(map.get_cell_number(row, map.get_required_column("horizontal_m")),
                std::hypot(noise_m, tilt_m), 1e-6);
    EXPECT_EQ(map.get_cell_number(row, map.get_required_column("principal_point_m")), 0);
  }
  EXPECT_THAT(TemporaryFolder::read_content(folder / "map.png"), StartsWith("\x89PNG"));
}

TEST(VlpLimits, HorizontalErrorIncludesMotionAndRollAndPitch) {
  const TemporaryFolder folder;
  const auto compute_map = [&](const std::string& options) {
    const auto result = run_program(kLimits + "--floor-m -0.2 0.2 0 0.1 --step-m 0.1 --map " +
                                    (folder / "map.csv").string() + options);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    return std::pair(result.output, CsvTable(folder / "map.csv"));
  };
  const auto [output, map] = compute_map(
      " --max-speed-m-per-s 2 --roll-pitch-sd-deg 90 --picture " + (folder / "map.svg").string());
  for (const char* row : {"\nmotion ", "\nroll and pitch ", ", a fix at "}) {
    EXPECT_THAT(output, HasSubstr(row));
  }
  EXPECT_THAT(TemporaryFolder::read_content(folder / "map.svg"),
              HasSubstr("up to 2 m/s, roll and pitch sd 90 deg"));
  const auto [standing_output, standing] = compute_map("");
  EXPECT_THAT(standing_output, Not(HasSubstr("motion")));
  ASSERT_EQ(map.num_rows(), standing.num_rows());
  int with_fix = 0;
  for (std::size_t row = 0; row < map.num_rows(); ++row) {
    EXPECT_EQ(map.get_cell_number(row, map.get_required_column("lamps")),
              standing.get_cell_number(row, standing.get_required_column("lamps")));
    if (map.get_cell_text(row, map.get_required_column("noise_m")).empty()) continue;
    ++with_fix;
    const double noise_m = map.get_cell_number(row, map.get_required_column("noise_m"));
    EXPECT_NEAR(noise_m, standing.get_cell_number(row, standing.get_required_column("noise_m")),
                1e-3 * noise_m);
    EXPECT_NEAR(map.get_cell_number(row, map.get_required_column("horizontal_m")),
                std::hypot(noise_m, map.get_cell_number(row, map.get_required_column("motion_m")),
                           map.get_cell_number(row, map.get_required_column("roll_pitch_m"))),
                1e-8);  // six digits
    EXPECT_GT(map.get_cell_number(row, map.get_required_column("roll_pitch_m")), noise_m);
  }
  EXPECT_GT(with_fix, 0);
}

TEST(VlpLimits, RequiresRowTimeForMotionAndMoreThanTwoLampsForTilt) {
  const TemporaryFolder folder;
  Calibration calibration{synthetic_camera(), {}, {}, {}, {}};
  write_calibration(folder / "camera.yaml", calibration);
  write_lamp_map(folder / "lamps.yaml", make_lamp_map({{-0.5, 0, 1.6}, {0.5, 0, 1.6}}));
  const std::string two_lamps = "vlp-limits --lamps " + (folder / "lamps.yaml").string() +
                                " --calibration " + (folder / "camera.yaml").string() +
                                " --height-m 0 --noise-px 0.1 --step-m 0.5 ";
  const auto result = run_program(two_lamps + "--max-speed-m-per-s 2");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.errors, HasSubstr("a moving camera needs row_time_s and readout"));
  const auto leaning = run_program(two_lamps + "--roll-pitch-sd-deg 90");
  EXPECT_EQ(leaning.exit_code, 3);
  EXPECT_THAT(leaning.errors, HasSubstr("motion and tilt cannot be estimated at any position"));
}

/// A calibration of the tests' rig that states its zenith, and a map that states its survey.
class VlpLimitsFromCalibration : public testing::Test {
 protected:
  TemporaryFolder folder;
  LampMap lamps = synthetic_lamps();
  Calibration calibration{synthetic_camera(), {}, {}, {}, {}};

  VlpLimitsFromCalibration() {
    RotationCenter center = tilted_by(calibration.camera, 0.02, 1);
    calibration = add_rotation_center_to_calibration(
        calibration, center,
        JointCovariance{{}, {"zenith_x", "zenith_y"}, 4e-10 * Eigen::Matrix2d::Identity()}, {});
    for (Lamp& lamp : lamps.lamps) lamp.sd_m = 0.002;
  }
  ProgramResult run(const std::string& options) {
    write_lamp_map(folder / "lamps.yaml", lamps);
    write_calibration(folder / "calibration.yaml", calibration);
    return run_program("vlp-limits --lamps " + (folder / "lamps.yaml").string() +
                       " --calibration " + (folder / "calibration.yaml").string() +
                       " --height-m 0 --noise-px 0.05 --step-m 0.2 " + options);
  }
};

TEST_F(VlpLimitsFromCalibration, NamesLargestErrorSource) {
  const auto result = run("--from-calibration --map " + (folder / "map.csv").string());
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("improve     lamp map first, 99 % of the horizontal"));
  EXPECT_THAT(result.output, HasSubstr("vlp-adjust --refine-map"));
  EXPECT_THAT(result.errors, HasSubstr("lens: the uncertainties are missing and count as zero"));
  const CsvTable map(folder / "map.csv");
  ASSERT_GT(map.num_rows(), 0U);
  for (std::size_t row = 0; row < map.num_rows(); ++row) {
    double variance = 0;
    for (const char* part : {"noise_m", "lens_m", "zenith_m", "lamp_map_m"}) {
      variance += std::pow(map.get_cell_number(row, map.get_required_column(part)), 2);
    }
    EXPECT_NEAR(map.get_cell_number(row, map.get_required_column("horizontal_m")),
                std::sqrt(variance), 1e-8);
    EXPECT_EQ(map.get_cell_number(row, map.get_required_column("lens_m")), 0);
  }
}

TEST_F(VlpLimitsFromCalibration, IncludesOnlyLensUncertaintyWithoutRotationCenter) {
  calibration.rotation_center.reset();
  calibration.covariance.reset();
  calibration.history.clear();  // it names the center
  calibration.intrinsics_report = IntrinsicsReport{10, 1000, 0, 0.1, {}, {}};
  calibration.intrinsics_report->covariance = MatrixX(1e-6 * MatrixX::Identity(12, 12));
  for (Lamp& lamp : lamps.lamps) lamp.sd_m.reset();
  const auto result = run("--from-calibration");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("\nlens  "));
  EXPECT_THAT(result.output, HasSubstr("improve     lens first"));
  EXPECT_THAT(result.errors, HasSubstr("zenith, lamp map: the uncertainties are missing"));
}

TEST_F(VlpLimitsFromCalibration, WarnsOfLampsMovedSinceAdjustment) {
  StatedRig rig;
  rig.adjust(1);
  lamps = rig.map;
  calibration.adjustment = rig.calibration.adjustment;
  calibration.covariance = rig.calibration.covariance;
  calibration.intrinsics_report = IntrinsicsReport{10, 1000, 0, 0.1, {}, {}};
  calibration.intrinsics_report->covariance = calibration.covariance->matrix.topLeftCorner(12, 12);
  calibration.adjustment->sets = {"turn"};
  EXPECT_THAT(run("--from-calibration").errors, Not(HasSubstr("elsewhere")));
  lamps.lamps[2].position_m.x() += 0.01;
  lamps.lamps[2].sd_m = 0.002;
  const auto result = run("--from-calibration");
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.errors,
              HasSubstr("1 lamps have other positions than in the adjustment of the calibration"));
}

TEST_F(VlpLimitsFromCalibration, RejectsTiltOptionAndCalibrationWithoutUncertainties) {
  EXPECT_EQ(run("--from-calibration --tilt-deg 1").exit_code, 2);
  calibration.covariance.reset();
  for (Lamp& lamp : lamps.lamps) lamp.sd_m.reset();
  const auto result = run("--from-calibration");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.errors, HasSubstr("calibration.yaml: has no uncertainties, and"));
}

TEST(VlpLimits, ReturnsThreeWithoutTwoVisibleLamps) {
  const auto result = run_program(kLimits + "--floor-m 50 51 50 51");
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.errors, HasSubstr("two lamps are visible from no position"));
}

TEST(VlpLimits, WritesNothingForInvalidPlotName) {
  const TemporaryFolder folder;
  const auto map = folder / "map.csv";
  const auto result = run_program(kLimits + "--map " + map.string() + " --picture a.jpg");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.errors, HasSubstr("should end in .png or .svg"));
  EXPECT_FALSE(std::filesystem::exists(map));
}

TEST(VlpLimits, CountsMoreVisibleLampsForFisheye) {
  const TemporaryFolder folder;
  const auto compute_map = [&](const Camera& camera) {
    write_calibration(folder / "camera.yaml", {camera, {}, {}, {}, {}});
    const auto result =
        run_program("vlp-limits --lamps " VLP_SOURCE_DIR
                    "/datasets/example/lamps.yaml --height-m 0 "
                    "--noise-px 0.1 --floor-m -1.5 1.5 0 0.5 --step-m 0.5 --calibration " +
                    (folder / "camera.yaml").string() + " --map " + (folder / "map.csv").string());
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    return CsvTable(folder / "map.csv");
  };
  const CsvTable by_fisheye = compute_map(fisheye_camera()),
                 by_other = compute_map(synthetic_camera());
  ASSERT_EQ(by_fisheye.num_rows(), by_other.num_rows());
  int more = 0;
  for (std::size_t row = 0; row < by_fisheye.num_rows(); ++row) {
    const auto lamps = [row](const CsvTable& map) {
      return map.get_cell_number(row, map.get_required_column("lamps"));
    };
    EXPECT_GE(lamps(by_fisheye), lamps(by_other));
    if (lamps(by_fisheye) > lamps(by_other)) ++more;
    EXPECT_GT(by_fisheye.get_cell_number(row, by_fisheye.get_required_column("noise_m")), 0);
  }
  EXPECT_GT(more, 0);
}

TEST(VlpLimits, RejectsTwoOutputsInOneFile) {
  const TemporaryFolder folder;
  const auto result = run_program("cd '" + (folder / "").string() + "' && " + kLimits +
                                  "--map a.svg --picture ./a.svg");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.errors, HasSubstr("--map and --picture are the same file"));
  EXPECT_FALSE(std::filesystem::exists(folder / "a.svg"));
}

TEST(VlpLimits, ReturnsTwoWhenStdoutCannotBeWritten) {
  const auto result = run_program("{ " + kLimits + "; } >/dev/full");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.errors, HasSubstr("stdout cannot be written"));
}

TEST(VlpLimits, ReturnsTwoForBadUsage) {
  EXPECT_EQ(run_program(kLimits + "--floor-m 1 0 0 1").exit_code, 2);
  EXPECT_EQ(run_program(kLimits + "--step-m 0").exit_code, 2);
  EXPECT_EQ(run_program(kLimits + "--step-m 1e-9").exit_code, 2);
  EXPECT_EQ(run_program(kLimits + "--tilt-deg nan").exit_code, 2);
  EXPECT_EQ(run_program(kLimits + "--height-m inf").exit_code, 2);
  EXPECT_EQ(run_program(kLimits + "--picture a.bmp").exit_code, 2);
  EXPECT_EQ(run_program(kLimits + "--roll-pitch-sd-deg -1").exit_code, 2);
  EXPECT_EQ(run_program(kLimits + "--max-yaw-rate-deg-per-s 10").exit_code, 2);
  EXPECT_EQ(run_program("vlp-limits --lamps a --calibration b --height-m 0").exit_code, 2);
}

}  // namespace
}  // namespace vlp
