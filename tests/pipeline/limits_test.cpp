// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-limits as its users call it.
#include <gmock/gmock.h>

#include "captures/csv_reader.h"
#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

const std::string kLimits = "vlp-limits --lamps " VLP_SOURCE_DIR
                            "/datasets/example/lamps.yaml --calibration " VLP_SOURCE_DIR
                            "/datasets/example/calibration.yaml --height-m 0 --noise-px 0.1 ";

TEST(Limits, PrintsTheErrorBudget) {
  const auto result = run_program(kLimits + "--center-px 1 --tilt-deg 0.5 --lamp-map-mm 1");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  for (const char* row : {"noise", "centre", "tilt", "lamp map", "together"}) {
    EXPECT_THAT(result.output, HasSubstr(std::string("\n") + row));
  }
}

TEST(Limits, WritesTheMapAsATableAndAPicture) {
  const TemporaryFolder folder;
  const auto result =
      run_program(kLimits + "--tilt-deg 1 --floor-m -0.2 0.2 0 0.1 --step-m 0.1 --map " +
                  (folder / "map.csv").string() + " --picture " + (folder / "map.png").string());
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const CsvTable map(folder / "map.csv");
  ASSERT_EQ(map.rows(), 5 * 2);
  for (std::size_t row = 0; row < map.rows(); ++row) {
    const double noise_m = map.number(row, map.required("noise_m"));
    const double tilt_m = map.number(row, map.required("tilt_m"));
    // 0.1 px is about 0.2 mm, one degree on each of two axes at 1.6 m about 40 mm.
    EXPECT_GT(noise_m, 0.1e-3);
    EXPECT_LT(noise_m, 0.5e-3);
    EXPECT_NEAR(tilt_m, 40e-3, 8e-3);
    EXPECT_NEAR(map.number(row, map.required("horizontal_m")), std::hypot(noise_m, tilt_m), 1e-6);
    EXPECT_EQ(map.number(row, map.required("center_m")), 0);
  }
  EXPECT_THAT(TemporaryFolder::content_of(folder / "map.png"), StartsWith("\x89PNG"));
}

TEST(Limits, EndsWithThreeWhereNoTwoLampsAreInView) {
  const auto result = run_program(kLimits + "--floor-m 50 51 50 51");
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.errors, HasSubstr("two lamps are in view nowhere"));
}

TEST(Limits, WritesNothingWhenItsPictureCannotBe) {
  const TemporaryFolder folder;
  const auto map = folder / "map.csv";
  const auto result = run_program(kLimits + "--map " + map.string() + " --picture a.jpg");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.errors, HasSubstr("should end in .png or .svg"));
  EXPECT_FALSE(std::filesystem::exists(map));
}

TEST(Limits, NoticesWhenItsResultsAreLost) {
  const auto result = run_program("{ " + kLimits + "; } >/dev/full");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.errors, HasSubstr("stdout cannot be written"));
}

TEST(Limits, EndsWithTwoOnBadUsage) {
  EXPECT_EQ(run_program(kLimits + "--floor-m 1 0 0 1").exit_code, 2);
  EXPECT_EQ(run_program(kLimits + "--step-m 0").exit_code, 2);
  EXPECT_EQ(run_program(kLimits + "--step-m 1e-9").exit_code, 2);
  EXPECT_EQ(run_program(kLimits + "--tilt-deg nan").exit_code, 2);
  EXPECT_EQ(run_program(kLimits + "--height-m inf").exit_code, 2);
  EXPECT_EQ(run_program(kLimits + "--picture a.bmp").exit_code, 2);
  EXPECT_EQ(run_program("vlp-limits --lamps a --calibration b --height-m 0").exit_code, 2);
}

}  // namespace
}  // namespace vlp
