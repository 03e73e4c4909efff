// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// scripts/reproduce_paper.sh on fewer captures of paper-rig-faulty.
#include <gmock/gmock.h>

#include <filesystem>
#include <sstream>
#include <vector>

#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;

/// 58 captures instead of 536.
const std::string kFewCaptures = R"(captures:
  - {folder: rotation, exposure_s: 5.0e-5, pivots_m: [[0.05, 0.02]], heights_m: [0, 0.3], turn: {count: 8, jitter_deg: 8}, interval_s: 0.5}
  - {folder: dispersion-one-yaw, exposure_s: 5.0e-5, pivots_m: [[0, 0]], heights_m: [0], yaws_deg: [0], repeat: 6, interval_s: 0.5, known: true}
  - {folder: dispersion, exposure_s: 5.0e-5, pivots_m: [[0, 0]], heights_m: [0], turn: {count: 12, jitter_deg: 4}, interval_s: 0.5, known: true}
  - {folder: check, exposure_s: 5.0e-5, grid: {x_m: [-0.6, 0.6], y_m: [-0.35, 0.35], columns: 3, rows: 2}, heights_m: [0, 0.3], turn: {count: 2, jitter_deg: 60}, interval_s: 0.5}
)";

class ReproducePaper : public testing::Test {
 protected:
  TemporaryFolder folder;
  const std::filesystem::path out = folder / "out";

  void SetUp() override {
    std::string scene =
        TemporaryFolder::read_content(VLP_SOURCE_DIR "/datasets/paper-rig-faulty/scene.yaml");
    scene.resize(scene.find("captures:\n"));
    std::filesystem::create_directory(folder / "few");
    folder.file("few/scene.yaml", scene + kFewCaptures);
  }
  ProgramResult reproduce() const {
    return run_program("VLP_PROGRAMS_DIR='" VLP_PROGRAMS_DIR "' '" VLP_SOURCE_DIR
                       "/scripts/reproduce_paper.sh' '" +
                       (folder / "few").string() + "' '" + out.string() + "'");
  }
};

/// The numbers behind a label, in the n-th row that has it.
std::vector<double> row(const std::string& table, const std::string& label, int n = 0) {
  std::istringstream lines(table);
  std::vector<double> numbers;
  for (std::string line; std::getline(lines, line);) {
    const auto at = line.find(label);
    if (at == std::string::npos || n-- > 0) continue;
    std::istringstream words(line.substr(at + label.size()));
    for (double number = 0; words >> number;) numbers.push_back(number);
    break;
  }
  return numbers;
}

TEST_F(ReproducePaper, CorrectionReducesErrorsAndMissingFixExitsWith1) {
  const auto result = reproduce();
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(result.errors, "");
  EXPECT_THAT(result.output, HasSubstr("errors of 24 fixes"));
  for (const int lamps : {0, 1}) {
    const auto its = row(result.output, "its methods ", lamps);
    const auto exact = row(result.output, "exact methods ", lamps);
    ASSERT_EQ(its.size(), 9U) << result.output;
    ASSERT_EQ(exact.size(), 9U) << result.output;
    // A lean of 1.5 degrees is 42 mm at 1.6 m and 34 mm at 1.3 m.
    EXPECT_GT(its[0], 30);
    EXPECT_LT(its[0], 50);
    EXPECT_EQ(exact[0], its[0]);
    // The lamp map is off by 1 mm at each lamp; measured are 1.4 and 1.1 mm.
    EXPECT_LT(exact[6], 2);
    EXPECT_LT(exact[6], its[6]);
    EXPECT_LT(its[6], 0.3 * its[0]);
  }
  const auto all = row(result.output, "all lamps    exact methods");
  ASSERT_EQ(all.size(), 9U) << result.output;
  EXPECT_LT(all[6], 1.2);  // measured: 0.83
  const auto refined = row(result.output, "refined map");
  ASSERT_EQ(refined.size(), 3U) << result.output;
  EXPECT_LT(refined[0], all[6]);
  for (const char* line : {"none        ours", "our camera is tilted by 1.50 degrees",
                           "rotation    ours", "dispersion  ours", "exact       the remaining"}) {
    EXPECT_THAT(result.output, HasSubstr(line));
  }
  const auto nan = result.output.find("nan");
  EXPECT_EQ(nan, std::string::npos) << result.output;

  // A capture without a fix is not passed over: here one that shows no lamp.
  std::filesystem::remove(out / "check/0003.png");
  std::filesystem::copy_file(VLP_SOURCE_DIR "/datasets/paper-rig/rendered/sample-boards/0000.png",
                             out / "check/0003.png");
  const auto fewer = reproduce();
  EXPECT_EQ(fewer.exit_code, 1);
  EXPECT_THAT(fewer.errors, HasSubstr("1 of 24 captures have no fix"));
}

}  // namespace
}  // namespace vlp
