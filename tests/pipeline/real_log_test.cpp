// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// A robot's run under eight real ceiling lamps, when the real captures are there.
#include <gtest/gtest.h>

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

TEST(RealLog, IsSixtySixMillimetresFromThePathWithoutCentreCorrection) {
  const auto log = real_data("ceiling-lamps-log");
  if (log.empty()) GTEST_SKIP() << "no real captures: set VLP_REAL_DATA_DIR";
  const TemporaryFolder folder;
  const auto calibration = folder.file(
      "calibration.yaml", calibration_in(TemporaryFolder::content_of(log / "README.md")));
  const auto fixes_file = folder / "fixes.csv";
  const auto result =
      run_program("vlp-locate '" + (log / "detections.csv").string() + "' --lamps '" +
                  (log / "lamps.yaml").string() + "' --calibration " + calibration.string() +
                  " --correction none -o " + fixes_file.string());
  ASSERT_EQ(result.exit_code, 0) << result.errors;

  std::vector<Eigen::Vector2d> path;
  const CsvTable waypoints(log / "path.csv");
  for (std::size_t row = 0; row < waypoints.rows(); ++row) {
    path.emplace_back(waypoints.number(row, waypoints.required("x_m")),
                      waypoints.number(row, waypoints.required("y_m")));
  }
  const CsvTable fixes(fixes_file);
  ASSERT_EQ(fixes.rows(), 5057);
  double sum_m = 0;
  std::vector<double> residuals_px;
  for (std::size_t row = 0; row < fixes.rows(); ++row) {
    ASSERT_EQ(fixes.text(row, fixes.required("status")), "ok");
    sum_m += distance_from(
        path, {fixes.number(row, fixes.required("x_m")), fixes.number(row, fixes.required("y_m"))});
    residuals_px.push_back(fixes.number(row, fixes.required("residual_px")));
  }
  EXPECT_NEAR(sum_m / 5057, 0.066, 0.001);
  std::nth_element(residuals_px.begin(), residuals_px.begin() + 2528, residuals_px.end());
  EXPECT_NEAR(residuals_px[2528], 3.8, 0.1);
}

}  // namespace
}  // namespace vlp
