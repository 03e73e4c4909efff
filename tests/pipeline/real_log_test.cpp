// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// A robot's run under eight real ceiling lamps, when the real captures are there.
#include <gmock/gmock.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>

#include "captures/csv_reader.h"
#include "support/polyline.h"
#include "support/program.h"
#include "support/real_data.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

/// A calibration from the sentence "Camera (given with the log): LENSMODEL_..., fx ..., ..." of the
/// log's description; the size of the image is not stated there.
std::string calibration_in(const std::string& description) {
  const auto begin = description.find("LENSMODEL_OPENCV5", description.find("Camera"));
  const std::string sentence = description.substr(begin, description.find(".\n", begin) - begin);
  std::istringstream words(sentence);
  std::string intrinsics;
  for (std::string word; words >> word;) {
    if (word.ends_with(',')) word.pop_back();
    char* end = nullptr;
    std::strtod(word.c_str(), &end);
    if (*end == '\0') intrinsics += (intrinsics.empty() ? "" : ", ") + word;
  }
  return "format: vlp-calibration/1\n"
         "camera: {id: log, imager_px: [800, 480], lens_model: LENSMODEL_OPENCV5, "
         "intrinsics: [" +
         intrinsics + "]}\n";
}

/// Fixes of the log, against the path that was driven.
class RealLog : public testing::Test {
 protected:
  const std::filesystem::path log = real_data("ceiling-lamps-log");
  const TemporaryFolder folder;
  std::string calibration;

  void SetUp() override {
    if (log.empty()) GTEST_SKIP() << "no real captures: set VLP_REAL_DATA_DIR";
    calibration = folder
                      .file("calibration.yaml",
                            calibration_in(TemporaryFolder::content_of(log / "README.md")))
                      .string();
  }
  std::string in_log(const char* name) const { return "'" + (log / name).string() + "' "; }
  std::string path(const char* name) const { return (folder / name).string() + " "; }

  struct Figures {
    double mean_distance_m;
    double median_residual_px;
  };
  Figures figures(const std::string& lamps, const std::string& with_calibration) const {
    const auto result =
        run_program("vlp-locate " + in_log("detections.csv") + "--lamps " + lamps +
                    "--calibration " + with_calibration + " -o " + path("fixes.csv"));
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    std::vector<Eigen::Vector2d> driven;
    const CsvTable waypoints(log / "path.csv");
    for (std::size_t row = 0; row < waypoints.rows(); ++row) {
      driven.emplace_back(waypoints.number(row, waypoints.required("x_m")),
                          waypoints.number(row, waypoints.required("y_m")));
    }
    const CsvTable fixes(folder / "fixes.csv");
    EXPECT_EQ(fixes.rows(), 5057);
    double sum_m = 0;
    std::vector<double> residuals_px;
    for (std::size_t row = 0; row < fixes.rows(); ++row) {
      EXPECT_EQ(fixes.text(row, fixes.required("status")), "ok");
      sum_m += distance_from(driven, {fixes.number(row, fixes.required("x_m")),
                                      fixes.number(row, fixes.required("y_m"))});
      residuals_px.push_back(fixes.number(row, fixes.required("residual_px")));
    }
    std::nth_element(residuals_px.begin(), residuals_px.begin() + 2528, residuals_px.end());
    return {sum_m / 5057, residuals_px[2528]};
  }
  ProgramResult level(const std::string& options = "") const {
    return run_program("vlp-rotation --method lamps " + in_log("detections.csv") + "--lamps " +
                       in_log("lamps.yaml") + "--calibration " + calibration + " -o " +
                       path("levelled.yaml") + options);
  }
};

/// The same two figures from vlp-evaluate, as a user would have them.
TEST_F(RealLog, IsEvaluatedAgainstItsPath) {
  const auto evaluate = [&](const char* gate) {
    return run_program("vlp-evaluate " + path("fixes.csv") + "--path " + in_log("path.csv") + gate);
  };
  figures(in_log("lamps.yaml"), calibration);
  EXPECT_THAT(evaluate("").output, testing::HasSubstr("mean           65.831 mm"));
  ASSERT_EQ(level().exit_code, 0);
  figures(in_log("lamps.yaml"), path("levelled.yaml"));
  EXPECT_EQ(evaluate("--gate mean_mm=32.9 --gate missing=0").exit_code, 0);
  EXPECT_EQ(evaluate("--gate mean_mm=32.5").exit_code, 1);
}

TEST_F(RealLog, IsSixtySixMillimetresFromThePathWithoutCentreCorrection) {
  const auto [distance_m, residual_px] = figures(in_log("lamps.yaml"), calibration);
  EXPECT_NEAR(distance_m, 0.066, 0.001);
  EXPECT_NEAR(residual_px, 3.8, 0.1);
}

TEST_F(RealLog, IsHalfAsFarOnceTheLampsHaveLevelledTheCamera) {
  ASSERT_EQ(level().exit_code, 0);
  const auto [distance_m, residual_px] = figures(in_log("lamps.yaml"), path("levelled.yaml"));
  EXPECT_LT(distance_m, 0.034);
  EXPECT_LT(residual_px, 1.4);
}

/// The size of the map as a whole is held, and the path says that it is 5 % off: the map's shape
/// shows in the residuals alone.
TEST_F(RealLog, FitsItsLampsTwiceAsWellOnceTheirMapIsRefined) {
  ASSERT_EQ(level("--refine-map " + path("lamps.yaml")).exit_code, 0);
  const auto [distance_m, residual_px] = figures(path("lamps.yaml"), path("levelled.yaml"));
  EXPECT_LT(distance_m, 0.038);
  EXPECT_LT(residual_px, 0.7);
}

}  // namespace
}  // namespace vlp
