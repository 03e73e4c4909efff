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

/// A name cannot speak to the terminal.
TEST_F(VlpStationWatched, PrintsReasonForEachRejectedImage) {
  const auto at = captures("a") / "boards";
  fs::create_directories(at);
  const std::string view = VLP_SOURCE_DIR "/datasets/paper-rig/rendered/sample-boards/0000.png";
  fs::copy_file(view, at / "0.png");
  fs::copy_file(view, at / "1.png");
  cv::imwrite((at / "2.png").string(), cv::Mat1b(600, 800, static_cast<unsigned char>(3)));
  cv::imwrite((at / "3.png").string(), cv::Mat1b(480, 640, static_cast<unsigned char>(90)));
  std::ofstream(at / "\x1b[2J4.png") << "no image";
  const auto result = run_program(run("a", "--idle-s 1"));
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(
      result.errors,
      AllOf(HasSubstr("0.png: taken"), HasSubstr("1.png: refused: is the same image as 0.png"),
            HasSubstr("2.png: refused: too dark"),
            HasSubstr("3.png: refused: is 640 x 480 px, the camera"),
            HasSubstr("\\x1b[2J4.png: refused: "), HasSubstr("cannot be read")));
  EXPECT_THAT(result.output, HasSubstr("boards: no image came for 1 s"));
  const auto shown = records("show");
  EXPECT_THAT(shown.output, HasSubstr("images     5, 1 used"));
  for (const std::string& said : {result.output, result.errors, shown.output, shown.errors}) {
    EXPECT_EQ(said.find('\x1b'), std::string::npos) << said;
  }
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
  // The images are put away.
  EXPECT_FALSE(fs::exists(captures("b")));
  EXPECT_EQ(std::count_if(fs::recursive_directory_iterator(folder / "station/captures"), {},
                          [](const auto& entry) { return entry.path().extension() == ".png"; }),
            48);
}

}  // namespace
}  // namespace vlp
