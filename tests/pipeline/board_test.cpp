// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-board end to end.
#include <gmock/gmock.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "detection/boards/board_detector.h"
#include "rig/board_layout.h"
#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

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

TEST_F(VlpBoard, PrintsEachKindOfBoardToScale) {
  if (run_program("command -v pdftoppm").exit_code != 0) GTEST_SKIP() << "no pdftoppm here";
  constexpr double px_per_m = 10000;  // 254 dpi
  const std::string page = (folder / "page").string();
  for (const std::string options :
       {"", "--charuco --dictionary DICT_4X4_50", "--chessboard --square-mm 20"}) {
    SCOPED_TRACE(options);
    ASSERT_EQ(run_program("vlp-board " + options + " -o " + page + ".pdf").exit_code, 0);
    ASSERT_EQ(
        run_program("pdftoppm -r 254 -gray -singlefile -png " + page + ".pdf " + page).exit_code,
        0);
    const Board board = read_board(page + ".yaml");
    const cv::Mat image = cv::imread(page + ".png", cv::IMREAD_GRAYSCALE);
    EXPECT_NEAR(image.cols, 0.297 * px_per_m, 2);
    const BoardDetection seen = BoardDetector(board).detect_board(image);
    if (board.kind == BoardKind::apriltags) {
      ASSERT_EQ(seen.tags.size(), 30U);
      const double width_px = (seen.tags[5].corners_px[2] - seen.tags[0].corners_px[3]).norm();
      EXPECT_NEAR(width_px / px_per_m, compute_tag_field_size_m(board).x(), 1e-4);
    } else {
      ASSERT_EQ(seen.points.size(), static_cast<std::size_t>((board.cols - 1) * (board.rows - 1)));
      const auto last = static_cast<std::size_t>(board.cols - 2);
      const double width_px = (seen.points[last].pixel - seen.points[0].pixel).norm();
      EXPECT_NEAR(width_px / px_per_m, (board.cols - 2) * board.square_size_m, 1e-4);
    }
  }
}

}  // namespace
}  // namespace vlp
