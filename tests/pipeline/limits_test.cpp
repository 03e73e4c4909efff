// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-limits as its users call it.
#include <gmock/gmock.h>

#include <cmath>

#include "rig/calibration_builder.h"
#include "support/csv_cells.h"
#include "support/program.h"
#include "support/synthetic_rig.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

const std::string kLimits = "vlp-limits --lamps " VLP_SOURCE_DIR
                            "/datasets/example/lamps.yaml --calibration " VLP_SOURCE_DIR
                            "/datasets/example/calibration.yaml --height-m 0 --noise-px 0.1 ";

TEST(VlpLimits, PrintsErrorOfEachSourceAndTotal) {
  const TemporaryFolder folder;
  const auto result =
      run_program(kLimits + "--principal-point-px 1 --tilt-deg 0.5 --lamp-map-mm 1 --picture " +
                  (folder / "map.png").string());
  ASSERT_EQ(result.exit_code, 0) << result.errors;
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
  EXPECT_THAT(TemporaryFolder::read_content(folder / "map.png"), StartsWith("\x89PNG"));
}

/// A calibration of the tests' rig that states its zenith, and a map that states its survey.
TEST(VlpLimits, NamesLargestErrorSourceOfCalibration) {
  const TemporaryFolder folder;
  LampMap lamps = synthetic_lamps();
  for (Lamp& lamp : lamps.lamps) lamp.sd_m = 0.002;
  write_lamp_map(folder / "lamps.yaml", lamps);
  const Camera camera = synthetic_camera();
  const JointCovariance zenith{{}, {"zenith_x", "zenith_y"}, 4e-10 * Eigen::Matrix2d::Identity()};
  write_calibration(
      folder / "calibration.yaml",
      add_rotation_center({camera, {}, {}, {}, {}}, tilted_by(camera, 0.02, 1), zenith, {}));
  const auto result =
      run_program("cd " + (folder / "").string() +
                  " && vlp-limits --lamps lamps.yaml --calibration calibration.yaml "
                  "--height-m 0 --noise-px 0.05 --step-m 0.2 --from-calibration "
                  "--map map.csv");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("improve     lamp map first, 99 % of the horizontal"));
  EXPECT_THAT(result.output, HasSubstr("vlp-adjust --refine-map"));
  EXPECT_THAT(result.errors, HasSubstr("lens: the uncertainties are missing and count as zero"));
  const CsvTable map(folder / "map.csv");
  ASSERT_GT(map.num_rows(), 0U);
  for (std::size_t row = 0; row < map.num_rows(); ++row) {
    double variance = 0;
    for (const char* part : {"noise_m", "lens_m", "zenith_m", "lamp_map_m"}) {
      variance += std::pow(read_number(map, row, part), 2);
    }
    EXPECT_NEAR(read_number(map, row, "horizontal_m"), std::sqrt(variance), 1e-8);
    EXPECT_EQ(read_number(map, row, "lens_m"), 0);
  }
}

}  // namespace
}  // namespace vlp
