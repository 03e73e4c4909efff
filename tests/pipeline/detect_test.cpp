// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-detect end to end.
#include <gmock/gmock.h>

#include <filesystem>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
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

/// Two rooms with the same frequencies in one map.
TEST_F(VlpDetect, IdentifiesOnlyLampsOfRoomOption) {
  std::istringstream lines(TemporaryFolder::read_content(kRig + "/lamps.yaml"));
  std::string lamps;
  int id = 0;
  for (std::string line; std::getline(lines, line);) {
    const auto begin = line.find("id: ");
    if (begin == std::string::npos) continue;
    ++id;
    const std::string shape = line.substr(line.find("diameter_m"));
    lamps += line.insert(begin, "room: hall, ") + "\n  - {room: office, id: 90" +
             std::to_string(id) + ", position_m: [9, " + std::to_string(id) + ", 1.6], " + shape +
             "\n";
  }
  const auto file = folder.file("rooms.yaml", "format: vlp-lamps/1\nlamps:\n" + lamps);
  const auto detect_in = [&](const std::string& room) {
    return run_program("vlp-detect '" + kRig + "/sample' --lamps " + file.string() +
                       " --calibration " + kRig + "/true_calibration.yaml -o " +
                       (folder / "rooms.csv").string() + room);
  };
  const auto unknown = detect_in("");
  EXPECT_EQ(unknown.exit_code, 3);
  EXPECT_THAT(unknown.errors,
              testing::AllOf(HasSubstr("check"), HasSubstr("share a frequency: 1 and 901, "),
                             HasSubstr("the key room of lamps and --room")));
  ASSERT_EQ(detect_in(" --room hall").exit_code, 0);
  const CsvTable found(folder / "rooms.csv");
  ASSERT_GT(found.num_rows(), 0U);
  for (std::size_t row = 0; row < found.num_rows(); ++row) {
    EXPECT_LT(read_number(found, row, "lamp"), 900);
  }
}

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

TEST_F(VlpDetect, LightsTableListsKindAndReasonOfEachLight) {
  const std::string clutter = std::string(VLP_SOURCE_DIR) + "/datasets/clutter/rendered";
  const fs::path lights = folder / "lights.csv";
  const auto found =
      run_program("vlp-detect --verbose '" + clutter + "/sample' --lamps " + clutter +
                  "/lamps.yaml --calibration " + clutter + "/true_calibration.yaml -o " +
                  (folder / "found.csv").string() + " --lights " + lights.string());
  ASSERT_EQ(found.exit_code, 0) << found.errors;
  const CsvTable table(lights), lamps(folder / "found.csv");
  std::map<std::string, std::size_t> kinds;
  for (std::size_t row = 0; row < table.num_rows(); ++row) {
    const std::string kind(read_text(table, row, "kind"));
    ++kinds[kind];
    const bool identified = kind == "lamp" || kind == "cut";
    EXPECT_EQ(identified, read_text(table, row, "reason") == "identified");
    EXPECT_EQ(identified, !read_text(table, row, "lamp").empty());
  }
  EXPECT_EQ(kinds["lamp"], lamps.num_rows());
  EXPECT_EQ(kinds["steady"], 2U) << "the steady lamp and the window";
  EXPECT_EQ(kinds["unknown"], 1U) << "the reflection of lamp 5";
  EXPECT_THAT(found.output,
              HasSubstr("1         unknown, reflection: it is more blurred than the lamps"));
  EXPECT_THAT(found.errors, HasSubstr(") lamp 5: its stripes match this lamp; radius 28.5 px"));
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

TEST_F(VlpDetect, SkipsAndCountsUnusableImages) {
  const fs::path images = folder / "images";
  fs::copy(kRig + "/sample", images);
  // Neither a folder nor a pipe is an image.
  fs::create_directory(images / "folder.png");
  ASSERT_EQ(run_program("mkfifo '" + (images / "pipe.png").string() + "'").exit_code, 0);
  const std::string whole = TemporaryFolder::read_content(images / "0000.png");
  folder.file("images/empty.png", "");
  folder.file("images/text.png", "no image\n");
  folder.file("images/half.PNG", whole.substr(0, 300));
  fs::copy(VLP_SOURCE_DIR "/datasets/example/limits.png", images / "another.png");
  cv::imwrite((images / "cut.jpg").string(), cv::imread((images / "0000.png").string()));
  const std::string jpeg = TemporaryFolder::read_content(images / "cut.jpg");
  folder.file("images/cut.jpg", jpeg.substr(0, jpeg.size() * 9 / 10));
  const auto result = detect(images.string());
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.output, HasSubstr("images      7\n  skipped   5\n"));
  EXPECT_THAT(result.errors, HasSubstr("empty.png: cannot be read as an image; skipped"));
  EXPECT_THAT(result.errors, HasSubstr("cut.jpg: cannot be read as an image: it is cut short"));
  EXPECT_THAT(result.errors, HasSubstr("half.PNG: cannot be read as an image: it is cut short"));
  EXPECT_THAT(result.errors, testing::Not(HasSubstr("libpng")));
  EXPECT_THAT(result.errors,
              HasSubstr("text.png: cannot be read as an image: it is not PNG, JPEG"));
  EXPECT_THAT(result.errors, HasSubstr("the camera's images are 800 x 600 px; skipped"));
  EXPECT_EQ(CsvTable(folder / "found.csv").num_rows(), 12);
}

}  // namespace
}  // namespace vlp
