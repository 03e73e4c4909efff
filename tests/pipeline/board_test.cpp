// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-board end to end.
#include <gmock/gmock.h>

#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "detection/boards/board_detector.h"
#include "rig/board_layout.h"
#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class VlpBoard : public testing::Test {
 protected:
  const TemporaryFolder folder;
};

TEST_F(VlpBoard, WritesIdenticalPdfTwiceAndMatchingBoardFile) {
  const std::string pdf = (folder / "board.pdf").string();
  ASSERT_EQ(run_program("vlp-board --kalibr --tag-mm 30 --paper A3 -o " + pdf).exit_code, 0);
  const std::string bytes = TemporaryFolder::read_content(pdf);
  EXPECT_TRUE(bytes.starts_with("%PDF-"));
  const Board board = read_board(folder / "board.yaml");
  EXPECT_EQ(board.tag_size_m, 0.03);
  EXPECT_EQ(board.border_bits, 2);
  EXPECT_TRUE(board.corner_squares);
  ASSERT_EQ(run_program("vlp-board --kalibr --tag-mm 30 --paper A3 -o " + pdf).exit_code, 0);
  EXPECT_EQ(TemporaryFolder::read_content(pdf), bytes);
}

TEST_F(VlpBoard, PrintsTagsToScale) {
  if (run_program("command -v pdftoppm").exit_code != 0) GTEST_SKIP() << "no pdftoppm here";
  const std::string pdf = (folder / "board.pdf").string();
  ASSERT_EQ(run_program("vlp-board -o " + pdf).exit_code, 0);
  constexpr double px_per_mm = 10;  // 254 dpi
  ASSERT_EQ(run_program("pdftoppm -r 254 -gray -singlefile -png " + pdf + " " +
                        (folder / "page").string())
                .exit_code,
            0);
  const cv::Mat page = cv::imread((folder / "page.png").string(), cv::IMREAD_GRAYSCALE);
  EXPECT_NEAR(page.cols, 297 * px_per_mm, 2);
  const Board board = read_board(folder / "board.yaml");
  const BoardDetection seen = BoardDetector(board).detect_board(page);
  ASSERT_EQ(seen.tags.size(), 30U);
  const double width_px = (seen.tags[5].corners_px[2] - seen.tags[0].corners_px[3]).norm();
  EXPECT_NEAR(width_px / px_per_mm / 1000, compute_tag_field_size_m(board).x(), 1e-4);
}

TEST_F(VlpBoard, RejectsTooLargeBoardUnknownPaperAndTooHighIds) {
  const std::string output = " -o " + (folder / "board.pdf").string();
  const auto large = run_program("vlp-board --tag-mm 50" + output);
  EXPECT_EQ(large.exit_code, 2);
  EXPECT_THAT(large.errors, HasSubstr("does not fit on A4"));
  EXPECT_EQ(run_program("vlp-board --paper B5" + output).exit_code, 2);
  EXPECT_EQ(run_program("vlp-board --first-id 580" + output).exit_code, 2);
  EXPECT_FALSE(fs::exists(folder / "board.pdf"));
}

}  // namespace
}  // namespace vlp
