// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-detect end to end.
#include <gmock/gmock.h>

#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "support/csv_cells.h"
#include "support/datasets.h"
#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class VlpDetect : public testing::Test {
 protected:
  ProgramResult detect(const std::string& images, const std::string& options = "") const {
    return run_program("vlp-detect '" + images + "' --lamps " + kRig +
                       "/lamps.yaml --calibration " + kRig + "/true_calibration.yaml -o " +
                       (folder / "found.csv").string() + " " + options);
  }
  const TemporaryFolder folder;
};

TEST_F(VlpDetect, YieldsSameTrueFixesAsImagesForAnyThreadCount) {
  const fs::path pictures = folder / "new" / "pictures";
  ASSERT_EQ(detect(kRig + "/sample", "--threads 1 --annotate " + pictures.string()).exit_code, 0);
  const std::string found = TemporaryFolder::read_content(folder / "found.csv");
  ASSERT_EQ(detect(kRig + "/sample", "--threads 4").exit_code, 0);
  EXPECT_EQ(TemporaryFolder::read_content(folder / "found.csv"), found);
  for (const char* name : {"0000.png.png", "0001.png.png"}) {
    const cv::Mat picture = cv::imread((pictures / name).string(), cv::IMREAD_UNCHANGED);
    ASSERT_EQ(picture.type(), CV_8UC3);
    ASSERT_EQ(picture.size(), cv::Size(800, 600));
    cv::Mat gray, drawn;
    cv::extractChannel(picture, gray, 0);
    cv::extractChannel(picture, drawn, 1);
    EXPECT_GT(cv::countNonZero(gray != drawn), 500) << "green outlines, crosses and numbers";
  }
  const auto locate = [&](const std::string& images, const std::string& output) {
    return run_program("vlp-locate " + images + " --lamps " + kRig + "/lamps.yaml --calibration " +
                       kRig + "/true_calibration.yaml -o " + (folder / output).string());
  };
  const auto located = locate((folder / "found.csv").string(), "fixes.csv");
  ASSERT_EQ(located.exit_code, 0) << located.errors;
  const CsvTable fixes(folder / "fixes.csv"), truth(kRig + "/sample/truth.csv");
  ASSERT_EQ(fixes.num_rows(), 2);
  for (std::size_t row = 0; row < 2; ++row) {
    EXPECT_EQ(read_text(fixes, row, "image"), read_text(truth, row, "image"));
    for (const char* axis : {"x_m", "y_m", "z_m"}) {
      EXPECT_NEAR(read_number(fixes, row, axis), read_number(truth, row, axis), 1e-4);
    }
  }
  for (const std::string threads : {"1", "4"}) {
    const auto of_images = locate(kRig + "/sample --threads " + threads, threads + ".csv");
    EXPECT_EQ(of_images.output, located.output) << of_images.errors;
  }
  EXPECT_EQ(TemporaryFolder::read_content(folder / "4.csv"),
            TemporaryFolder::read_content(folder / "1.csv"));
}

TEST_F(VlpDetect, WritesLightsTableEvenIfNoLampIsFound) {
  const fs::path lights = folder / "lights.csv";
  const auto result = detect(kRig + "/sample-boards", "--lights " + lights.string());
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.errors, HasSubstr("; most often, "));
  EXPECT_FALSE(fs::exists(folder / "found.csv"));
  const CsvTable table(lights);
  EXPECT_GT(table.num_rows(), 0U);
  for (std::size_t row = 0; row < table.num_rows(); ++row) {
    EXPECT_EQ(read_text(table, row, "lamp"), "");
  }
}

TEST_F(VlpDetect, DetectsSameLampsWithRowTimeInsteadOfCalibration) {
  const std::string call = "vlp-detect '" + kRig + "/sample' --lamps " + kRig + "/lamps.yaml -o " +
                           (folder / "found.csv").string();
  ASSERT_EQ(run_program(call + " --row-time-s 3e-5").exit_code, 0);
  const CsvTable without(folder / "found.csv");
  ASSERT_EQ(detect(kRig + "/sample").exit_code, 0);
  const CsvTable with(folder / "found.csv");
  ASSERT_EQ(without.num_rows(), with.num_rows());
  for (std::size_t row = 0; row < with.num_rows(); ++row) {
    // The lens moves the middle of an outline by as much.
    EXPECT_NEAR(read_number(without, row, "u_px"), read_number(with, row, "u_px"), 1);
  }
}

}  // namespace
}  // namespace vlp
