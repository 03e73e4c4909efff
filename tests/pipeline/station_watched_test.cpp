// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-station run while images arrive: the same result, refusals, tables that come late.
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "small_station.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

class VlpStationWatched : public SmallStation {};

TEST_F(VlpStationWatched, CalibrationEqualsBatchRunAndImagesAreArchived) {
  render();
  ASSERT_EQ(run_program(batch("a")).exit_code, 0);
  take_again();
  prepare("b");
  drop_all("b");
  const auto result = run_program(run("b", "--idle-s 60"));
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.errors, AllOf(HasSubstr("boards 0000.png: taken"), HasSubstr("(16/16)")));
  EXPECT_NE(comparable_calibration("a"), "");
  EXPECT_EQ(comparable_calibration("b"), comparable_calibration("a"));
  EXPECT_FALSE(fs::exists(captures("b")));
  int kept = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder / "station/captures")) {
    kept += entry.path().extension() == ".png" ? 1 : 0;
  }
  EXPECT_EQ(kept, 48);
}

TEST_F(VlpStationWatched, PrintsReasonForEachRejectedImage) {
  const auto at = captures("a") / "boards";
  fs::create_directories(at);
  const std::string view = VLP_SOURCE_DIR "/datasets/paper-rig/rendered/sample-boards/0000.png";
  fs::copy_file(view, at / "0.png");
  fs::copy_file(view, at / "1.png");
  cv::imwrite((at / "2.png").string(), cv::Mat1b(600, 800, static_cast<unsigned char>(3)));
  cv::imwrite((at / "3.png").string(), cv::Mat1b(480, 640, static_cast<unsigned char>(90)));
  std::ofstream(at / "4.png") << "no image";
  const auto result = run_program(run("a", "--idle-s 1"));
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.errors, AllOf(HasSubstr("0.png: taken"),
                                   HasSubstr("1.png: refused: is the same image as 0.png"),
                                   HasSubstr("2.png: refused: too dark"),
                                   HasSubstr("3.png: refused: is 640 x 480 px, the camera"),
                                   HasSubstr("4.png: refused: cannot be read")));
}

/// All that is there when a run goes on comes at once: its order is no order.
TEST_F(VlpStationWatched, AcceptsGoodImageAmongManyUnreadableExistingImages) {
  const auto at = captures("a") / "boards";
  fs::create_directories(at);
  for (int i = 0; i < 13; ++i) std::ofstream(at / ("bad-" + std::to_string(i) + ".png")) << "none";
  fs::copy_file(VLP_SOURCE_DIR "/datasets/paper-rig/rendered/sample-boards/0000.png",
                at / "good.png");
  const auto result = run_program(run("a", "--idle-s 1 --threads 2"));
  EXPECT_THAT(result.errors, HasSubstr("good.png: taken"));
  EXPECT_THAT(result.output, HasSubstr("boards: no image came for 1 s"));
  EXPECT_THAT(records("show").output, HasSubstr("images     14, 1 used"));
}

/// A name cannot speak to the terminal.
TEST_F(VlpStationWatched, EscapesControlCharactersOfFileNamesInOutput) {
  const auto at = captures("a") / "boards";
  fs::create_directories(at);
  std::ofstream(at / "\x1b[2Jgone.png") << "none";
  const auto result = run_program(run("a", "--idle-s 1"));
  EXPECT_THAT(result.errors, HasSubstr("\\x1b[2Jgone.png: refused"));
  const auto shown = records("show");
  for (const std::string& said : {result.output, result.errors, shown.output, shown.errors}) {
    EXPECT_EQ(said.find('\x1b'), std::string::npos) << said;
  }
}

/// A captures.csv that comes last, and in parts, is read when it is whole.
TEST_F(VlpStationWatched, WaitsForCompleteCapturesTable) {
  render();
  prepare("a");
  const auto table = captures("a") / "check/captures.csv";
  const std::string places = TemporaryFolder::read_content(table);
  std::ofstream(table) << places.substr(0, places.size() - 5);  // cut short
  drop_all("a");
  const auto result =
      run_program("(sleep 4; mv " + folder.file("places", places).string() + " " + table.string() +
                  ") & timeout 60 " + run("a", "") + "; code=$?; wait; exit $code");
  EXPECT_EQ(result.exit_code, 0) << result.errors;
}

/// Inclinations that arrive after the images: lamps are detected again in the planes that are level
/// by them, as for inclinations that arrive before.
TEST_F(VlpStationWatched, CalibrationIsSameWhenInclinationsArriveAfterImages) {
  render();
  const std::string told = with_inclinations("dispersion");
  ASSERT_EQ(run_program(batch("untold")).exit_code, 0);
  take_again();
  folder.file("unit/dispersion/captures.csv", told);
  ASSERT_EQ(run_program(batch("a")).exit_code, 0);
  take_again();
  prepare("b");
  const std::string said = folder.file("said", "").string();
  const auto late = captures("b") / "dispersion/captures.csv";
  std::ofstream(late) << told.substr(0, told.size() - 12);  // cut short
  drop_all("b");
  const auto result = run_program("(until grep -q 'dispersion 0011.png: taken' " + said +
                                  "; do sleep 0.1; done; mv " + folder.file("told", told).string() +
                                  " " + late.string() + ") & timeout 60 " + run("b", "") + " 2>" +
                                  said + "; code=$?; wait; exit $code");
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_NE(comparable_calibration("a"), "");
  EXPECT_EQ(comparable_calibration("b"), comparable_calibration("a"));
  EXPECT_NE(comparable_calibration("untold"), comparable_calibration("a"));
}

}  // namespace
}  // namespace vlp
