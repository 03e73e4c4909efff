// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-detect end to end.
#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <string>

#include "captures/csv_reader.h"
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
  /// A folder with the captures of the sample.
  fs::path images() const {
    fs::copy(kRig + "/sample", folder / "images");
    return folder / "images";
  }
  const TemporaryFolder folder;
};

/// A row time that leaves lamps identified, and one with which each is taken for its neighbor.
TEST_F(VlpDetect, WarnsWithGivenAndMeasuredRowTimeIfTheyDiffer) {
  const std::string images = kRig + "/sample' --lamps " + kRig + "/lamps.yaml";
  const std::string output = " -o " + (folder / "out.csv").string();
  std::string calibration = TemporaryFolder::read_content(kRig + "/true_calibration.yaml");
  std::string stated = "row_time_s: 0.00003";
  for (const std::string wrong_us : {"28.5", "37.5"}) {
    const std::string wrong = "row_time_s: " + wrong_us + "e-06";
    ASSERT_NE(calibration.find(stated), std::string::npos);
    calibration.replace(calibration.find(stated), stated.size(), wrong);
    stated = wrong;
    const std::string file = folder.file("wrong.yaml", calibration).string();
    for (const std::string program : {"vlp-detect '", "vlp-locate '"}) {
      const auto result = run_program(program + images + " --calibration " + file + output);
      EXPECT_THAT(result.errors, testing::ContainsRegex(
                                     "row time is " + wrong_us +
                                     " us in wrong.yaml, but the stripes of [0-9] lamps measure "
                                     "(29[.]9|30[.]0)"))
          << program << wrong_us;
    }
    const auto option =
        run_program("vlp-detect '" + images + " --row-time-s " + wrong_us + "e-6" + output);
    EXPECT_THAT(option.errors, HasSubstr("row time is " + wrong_us + " us in --row-time-s, but"));
  }
  const auto right = run_program("vlp-detect '" + images + " --calibration " + kRig +
                                 "/true_calibration.yaml" + output);
  EXPECT_EQ(right.exit_code, 0);
  EXPECT_THAT(right.errors, testing::Not(HasSubstr("row time")));
}

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
    EXPECT_LT(found.get_cell_number(row, found.get_required_column("lamp")), 900);
  }
  const auto attic = detect_in(" --room attic");
  EXPECT_EQ(attic.exit_code, 2);
  EXPECT_THAT(attic.errors, HasSubstr("has no lamp with 'room: attic'"));
}

TEST_F(VlpDetect, YieldsTruePositionWithVlpLocate) {
  ASSERT_EQ(detect(kRig + "/sample").exit_code, 0);
  const auto located = run_program("vlp-locate -q " + (folder / "found.csv").string() +
                                   " --lamps " + kRig + "/lamps.yaml --calibration " + kRig +
                                   "/true_calibration.yaml -o " + (folder / "fixes.csv").string());
  ASSERT_EQ(located.exit_code, 0) << located.errors;
  const CsvTable fixes(folder / "fixes.csv"), truth(kRig + "/sample/truth.csv");
  ASSERT_EQ(fixes.num_rows(), 2);
  for (std::size_t row = 0; row < 2; ++row) {
    EXPECT_EQ(fixes.get_cell_text(row, fixes.get_required_column("image")),
              truth.get_cell_text(row, truth.get_required_column("image")));
    for (const char* axis : {"x_m", "y_m", "z_m"}) {
      EXPECT_NEAR(fixes.get_cell_number(row, fixes.get_required_column(axis)),
                  truth.get_cell_number(row, truth.get_required_column(axis)), 1e-4);
    }
  }
}

TEST_F(VlpDetect, AnnotateOptionWritesImagesWithColoredOutlines) {
  const fs::path pictures = folder / "new" / "pictures";
  ASSERT_EQ(detect(kRig + "/sample", "--annotate " + pictures.string()).exit_code, 0);
  for (const char* name : {"0000.png.png", "0001.png.png"}) {
    const cv::Mat picture = cv::imread((pictures / name).string(), cv::IMREAD_UNCHANGED);
    ASSERT_EQ(picture.type(), CV_8UC3);
    ASSERT_EQ(picture.size(), cv::Size(800, 600));
    cv::Mat gray, drawn;
    cv::extractChannel(picture, gray, 0);
    cv::extractChannel(picture, drawn, 1);
    EXPECT_GT(cv::countNonZero(gray != drawn), 500) << "green outlines, crosses and numbers";
  }
  const auto refused = detect(kRig + "/sample", "--annotate " + kRig + "/sample");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.errors, HasSubstr("contains the images"));
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
    const std::string kind(table.get_cell_text(row, table.get_required_column("kind")));
    ++kinds[kind];
    const bool identified = kind == "lamp" || kind == "cut";
    EXPECT_EQ(identified,
              table.get_cell_text(row, table.get_required_column("reason")) == "identified");
    EXPECT_EQ(identified, !table.get_cell_text(row, table.get_required_column("lamp")).empty());
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
    EXPECT_EQ(table.get_cell_text(row, table.get_required_column("lamp")), "");
  }
}

TEST_F(VlpDetect, RejectsLightsOptionThatNamesInputOrOutput) {
  const auto refused = [&](const fs::path& lights, const std::string& message) {
    const auto result = detect(kRig + "/sample", "--lights " + lights.string());
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.errors, HasSubstr(message));
    EXPECT_FALSE(fs::exists(folder / "found.csv"));
  };
  refused(folder / "found.csv", "--output and --lights are the same file");
  refused(folder / "." / "found.csv", "--output and --lights are the same file");
  refused(kRig + "/lamps.yaml", "lamps.yaml: is also an input");
  refused(kRig + "/sample/0000.png", "0000.png: is also an input");
  refused(folder / "none" / "lights.csv", "lights.csv");
}

TEST_F(VlpDetect, DetectsSameLampsWithRowTimeInsteadOfCalibration) {
  const std::string call = "vlp-detect '" + kRig + "/sample' --lamps " + kRig + "/lamps.yaml -o " +
                           (folder / "found.csv").string();
  const auto refused = run_program(call);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.errors, HasSubstr("--row-time-s"));
  ASSERT_EQ(run_program(call + " --row-time-s 3e-5").exit_code, 0);
  const CsvTable without(folder / "found.csv");
  ASSERT_EQ(detect(kRig + "/sample").exit_code, 0);
  const CsvTable with(folder / "found.csv");
  ASSERT_EQ(without.num_rows(), with.num_rows());
  for (std::size_t row = 0; row < with.num_rows(); ++row) {
    // The lens moves the middle of an outline by as much.
    EXPECT_NEAR(without.get_cell_number(row, without.get_required_column("u_px")),
                with.get_cell_number(row, with.get_required_column("u_px")), 1);
  }
}

TEST_F(VlpDetect, VlpLocatePrintsSameForImagesAndForDetections) {
  ASSERT_EQ(detect(kRig + "/sample").exit_code, 0);
  const std::string rig = " --lamps " + kRig + "/lamps.yaml --calibration " + kRig +
                          "/true_calibration.yaml -o " + (folder / "fixes").string();
  const auto from_table =
      run_program("vlp-locate " + (folder / "found.csv").string() + rig + "1.csv");
  const auto from_images = run_program("vlp-locate " + kRig + "/sample" + rig + "2.csv");
  ASSERT_EQ(from_images.exit_code, 0) << from_images.errors;
  EXPECT_EQ(from_images.output, from_table.output);
  // An image without a lamp has a row that says so.
  const fs::path images = this->images();
  fs::copy(kRig + "/sample-boards/0000.png", images / "0002.png");
  ASSERT_EQ(run_program("vlp-locate " + images.string() + rig + "3.csv").exit_code, 0);
  const CsvTable fixes(folder / "fixes3.csv");
  ASSERT_EQ(fixes.num_rows(), 3);
  EXPECT_NE(fixes.get_cell_text(2, fixes.get_required_column("status")), "ok");
}

TEST_F(VlpDetect, WritesIdenticalFilesForOneAndFourThreads) {
  ASSERT_EQ(detect(kRig + "/sample", "--threads 1").exit_code, 0);
  const std::string one = TemporaryFolder::read_content(folder / "found.csv");
  ASSERT_EQ(detect(kRig + "/sample", "--threads 4").exit_code, 0);
  EXPECT_EQ(TemporaryFolder::read_content(folder / "found.csv"), one);
  const std::string locate = "vlp-locate " + kRig + "/sample --lamps " + kRig +
                             "/lamps.yaml --calibration " + kRig + "/true_calibration.yaml -o " +
                             (folder / "fixes").string();
  ASSERT_EQ(run_program(locate + "1.csv --threads 1").exit_code, 0);
  ASSERT_EQ(run_program(locate + "4.csv --threads 4").exit_code, 0);
  EXPECT_EQ(TemporaryFolder::read_content(folder / "fixes4.csv"),
            TemporaryFolder::read_content(folder / "fixes1.csv"));
  for (const char* program : {"vlp-locate", "vlp-rotation", "vlp-dispersion"}) {
    const auto none = run_program(program + locate.substr(locate.find(' ')) + ".csv --threads 0");
    EXPECT_EQ(none.exit_code, 2);
    EXPECT_THAT(none.errors, HasSubstr("--threads"));
  }
}

TEST_F(VlpDetect, SkipsAndCountsUnusableImages) {
  const fs::path images = this->images();
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

TEST_F(VlpDetect, ReportsErrorInOneLineForMissingFolderNoImageOrNoLamp) {
  const auto refused = [&](const std::string& images, int exit_code, const std::string& message) {
    const auto result = detect(images);
    EXPECT_EQ(result.exit_code, exit_code);
    EXPECT_THAT(result.errors, HasSubstr(message));
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1);
    EXPECT_FALSE(fs::exists(folder / "found.csv"));
  };
  refused((folder / "none").string(), 2, "none: is not a folder of images");
  fs::create_directory(folder / "bare");
  refused((folder / "bare").string(), 2, "bare: contains no image");
  refused(kRig + "/sample-boards", 3, "no lamp was identified wholly in view in 1 images");
}

TEST_F(VlpDetect, SkipsNonRegularFiles) {
  const fs::path images = this->images();
  fs::create_symlink(images / "loop.png", images / "loop.png");
  fs::create_directory(images / "folder.png");
  ASSERT_EQ(run_program("mkfifo '" + (images / "pipe.png").string() + "'").exit_code, 0);
  const auto result = detect(images.string());
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("images      2\n"));
}

TEST_F(VlpDetect, RejectsOutputThatIsAnInputImage) {
  const fs::path images = this->images();
  const auto result = run_program("vlp-detect " + images.string() + " --lamps " + kRig +
                                  "/lamps.yaml --calibration " + kRig +
                                  "/true_calibration.yaml -o " + (images / "0001.png").string());
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.errors, HasSubstr("0001.png: is also an input"));
}

TEST_F(VlpDetect, ReturnsTwoWhenNoImageIsUsable) {
  fs::create_directory(folder / "bad");
  folder.file("bad/one.png", "no image\n");
  const auto result = detect((folder / "bad").string());
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.errors, HasSubstr("bad: none of its 1 images can be used"));
}

TEST_F(VlpDetect, ReturnsTwoWithoutRowTimeOrLampFrequencies) {
  std::string calibration = TemporaryFolder::read_content(kRig + "/true_calibration.yaml");
  calibration.erase(calibration.find("  row_time_s"), 21);
  const auto without_row_time = run_program(
      "vlp-detect " + kRig + "/sample --lamps " + kRig + "/lamps.yaml --calibration " +
      folder.file("camera.yaml", calibration).string() + " -o " + (folder / "found.csv").string());
  EXPECT_EQ(without_row_time.exit_code, 2);
  EXPECT_THAT(without_row_time.errors, HasSubstr("camera.yaml: camera.row_time_s is missing"));
  const fs::path lamps = folder.file(
      "lamps.yaml", "format: vlp-lamps/1\nlamps:\n  - {id: 1, position_m: [0, 0, 2]}\n");
  const auto without_frequency =
      run_program("vlp-detect " + kRig + "/sample --lamps " + lamps.string() + " --calibration " +
                  kRig + "/true_calibration.yaml -o " + (folder / "found.csv").string());
  EXPECT_EQ(without_frequency.exit_code, 2);
  EXPECT_THAT(without_frequency.errors, HasSubstr("lamps.yaml: no lamp has a frequency_hz"));
}

}  // namespace
}  // namespace vlp
