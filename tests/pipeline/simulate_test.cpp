// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-simulate as its users call it.
#include <set>

#include "small_simulation.h"
#include "support/csv_cells.h"

namespace vlp {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::UnorderedElementsAre;

using VlpSimulate = SmallSimulation;

TEST_F(VlpSimulate, WritesImagesMapsAndGroundTruthFiles) {
  const auto result = simulate();
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(result.output, "rendered 24 captures, 0 existed; in " + output.string() + "\n");
  const Files files = files_below(output);
  EXPECT_EQ(find_images(files).size(), 24U);
  std::set<std::string> others;
  for (const auto& [name, content] : files) {
    if (!name.ends_with(".png")) others.insert(name);
  }
  EXPECT_THAT(others,
              UnorderedElementsAre("scene.yaml", "lamps.yaml", "true_lamps.yaml", "board.yaml",
                                   "true_calibration.yaml", "lamps/captures.csv", "lamps/truth.csv",
                                   "lamps/true_detections.csv", "boards/true_boards.csv",
                                   "boards/true_corners.csv"));
  EXPECT_NE(files.at("lamps.yaml"), files.at("true_lamps.yaml")) << "lamp 1 is off in the map";
}

TEST_F(VlpSimulate, WritesIdenticalFilesForAnyThreadCountOrderAndOwnSceneFile) {
  const Files expected = undisturbed("--threads 1 --seed 1");
  EXPECT_EQ(find_images(expected).size(), 24U);
  EXPECT_NE(expected.at("lamps/0000.png"), expected.at("lamps/0001.png"));
  const auto first = simulate("--only boards --threads 5");
  EXPECT_EQ(first.output, "rendered 8 captures, 0 existed; in " + output.string() + "\n");
  EXPECT_EQ(find_images(files_below(output)).size(), 8U);
  const auto rest = simulate("--only lamps,boards --threads 2");
  EXPECT_EQ(rest.output, "rendered 16 captures, 8 existed; in " + output.string() + "\n");
  EXPECT_TRUE(files_below(output) == expected);
  // The scene that was written gives the same files, without a word if that is asked.
  scene = output / "scene.yaml";
  output = folder / "again";
  const auto again = simulate("--quiet");
  EXPECT_EQ(again.exit_code, 0);
  EXPECT_EQ(again.output + again.errors, "");
  EXPECT_TRUE(files_below(output) == expected);
}

TEST_F(VlpSimulate, WarnsOfBadExposureUnclearStripesAndEmptyViews) {
  const auto warnings_with = [&](const std::string& from, const std::string& to) {
    change_scene(from, to);
    const auto result = simulate("");
    EXPECT_EQ(result.exit_code, 0);
    std::filesystem::remove_all(output);
    change_scene(to, from);
    return result.errors;
  };
  EXPECT_EQ(simulate().errors, "");
  std::filesystem::remove_all(output);
  EXPECT_THAT(warnings_with("bits: 8", "bits: 16"),
              AllOf(HasSubstr("lamps: the brightest lamp is only 200 of 65535 gray levels above"),
                    HasSubstr("boards: the board's white is only 180 of 65535 gray levels")));
  EXPECT_THAT(warnings_with("gain_dn_per_e: 0.02", "gain_dn_per_e: 5.0"),
              HasSubstr("lamps: the ceiling is at 252 of 255 gray levels"));
  EXPECT_THAT(warnings_with("exposure_s: 5.0e-5", "exposure_s: 5.0e-4"),
              AllOf(HasSubstr("lamp 2 has no clear stripes: the exposure is longer than its"),
                    Not(HasSubstr("lamp 1 has"))));
  EXPECT_THAT(warnings_with("row_time_s: 3.0e-5", "row_time_s: 1.0e-4"),
              HasSubstr("lamp 4 has stripes of less than 2.2 lines"));
  EXPECT_THAT(warnings_with("distance_m: [0.2, 0.3]", "distance_m: [0.002, 0.003]"),
              HasSubstr("boards: nothing is in view in "));
}

/// The largest differences of the fixes that vlp-locate makes of the true detections.
struct Differences {
  std::size_t fixes = 0;
  double position_m = 0, yaw_rad = 0;
};

Differences located_against_truth(const std::filesystem::path& output) {
  const std::string path = output.string();
  const auto result = run_program("vlp-locate -q " + path + "/lamps/true_detections.csv --lamps " +
                                  path + "/true_lamps.yaml --calibration " + path +
                                  "/true_calibration.yaml -o " + path + "/fixes.csv");
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  const CsvTable fixes(output / "fixes.csv"), truth(output / "lamps/truth.csv");
  EXPECT_EQ(fixes.num_rows(), truth.num_rows());
  Differences differences;
  for (std::size_t row = 0; row < fixes.num_rows() && row < truth.num_rows(); ++row) {
    EXPECT_EQ(read_text(fixes, row, "image"), read_text(truth, row, "image"));
    if (read_text(fixes, row, "status") != "ok") continue;
    ++differences.fixes;
    const auto difference = [&](const char* column) {
      return read_number(fixes, row, column) - read_number(truth, row, column);
    };
    for (const char* axis : {"x_m", "y_m", "z_m"}) {
      differences.position_m = std::max(differences.position_m, std::abs(difference(axis)));
    }
    const double turn_rad = std::remainder(difference("yaw_rad"), 2 * M_PI);
    differences.yaw_rad = std::max(differences.yaw_rad, std::abs(turn_rad));
  }
  return differences;
}

// Pixels are written to 1e-6 px, which are 2e-8 m here.
TEST_F(VlpSimulate, VlpLocateReproducesTruePosesFromTrueDetections) {
  ASSERT_EQ(simulate("--only lamps").exit_code, 0);
  const Differences differences = located_against_truth(output);
  EXPECT_EQ(differences.fixes, 16U);
  EXPECT_LT(differences.position_m, 1e-7);
  EXPECT_LT(differences.yaw_rad, 1e-7);
}

}  // namespace
}  // namespace vlp
