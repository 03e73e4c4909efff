// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Rendered boards with known corners, and real boards.
#include "detection/boards/board_detector.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "captures/csv_reader.h"
#include "frontend/image_file.h"
#include "rig/board_layout.h"
#include "support/real_data.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

class BoardDetectorOnRenderedBoard : public testing::TestWithParam<const char*> {
 protected:
  const fs::path rig = fs::path(VLP_SOURCE_DIR "/datasets") / GetParam() / "rendered";
  const Board board = read_board(rig / "board.yaml");
  const cv::Mat image = read_image(rig / "sample-boards/0000.png");

  std::map<int, std::array<Eigen::Vector2d, 4>> find_true_corners() const {
    const CsvTable table(rig / "sample-boards/true_corners.csv");
    std::map<int, std::array<Eigen::Vector2d, 4>> corners;
    for (std::size_t row = 0; row < static_cast<std::size_t>(table.num_rows()); ++row) {
      const int tag = static_cast<int>(table.get_cell_number(row, table.require_column("tag")));
      const auto k =
          static_cast<std::size_t>(table.get_cell_number(row, table.require_column("corner")));
      corners[tag][k] = {table.get_cell_number(row, table.require_column("u_px")),
                         table.get_cell_number(row, table.require_column("v_px"))};
    }
    return corners;
  }
  /// Root of the mean square per axis, with every tag where the truth has it.
  double rms_px(const BoardDetection& seen) const {
    const auto truth = find_true_corners();
    double squares = 0;
    for (const TagDetection& tag : seen.tags) {
      for (std::size_t k = 0; k < 4; ++k) {
        squares += (tag.corners_px[k] - truth.at(tag.id)[k]).squaredNorm();
      }
    }
    return std::sqrt(squares / (8 * static_cast<double>(seen.tags.size())));
  }
};

TEST_P(BoardDetectorOnRenderedBoard, DetectsAllTagsWithAccurateCorners) {
  const BoardDetection seen = BoardDetector(board).detect_board(image);
  EXPECT_EQ(seen.tags.size(), find_true_corners().size());
  EXPECT_TRUE(seen.foreign_tags.empty());
  EXPECT_EQ(seen.num_unusable_tags, 0);
  EXPECT_LT(rms_px(seen), 0.03);  // 0.019 and 0.013 over all views; 0.5 with the origin wrong
}

TEST_P(BoardDetectorOnRenderedBoard, DetectsAllTagsAccuratelyIn16BitImage) {
  cv::Mat deep;
  image.convertTo(deep, CV_16U, 16);  // as a camera of 12 bits has it
  const BoardDetection seen = BoardDetector(board).detect_board(deep);
  EXPECT_EQ(seen.tags.size(), find_true_corners().size());
  EXPECT_LT(rms_px(seen), 0.03);
}

TEST_P(BoardDetectorOnRenderedBoard, DetectsPartOfTagsAccuratelyOnTruncatedBoard) {
  const cv::Mat part = image(cv::Rect(0, 0, image.cols / 2, image.rows)).clone();
  const BoardDetection seen = BoardDetector(board).detect_board(part);
  EXPECT_GT(seen.tags.size(), 3U);
  EXPECT_LT(seen.tags.size(), find_true_corners().size());
  EXPECT_LT(rms_px(seen), 0.03);
}

TEST_P(BoardDetectorOnRenderedBoard, ReturnsSameCornersForUpsideDownImage) {
  cv::Mat turned;
  cv::rotate(image, turned, cv::ROTATE_180);
  const BoardDetection upright = BoardDetector(board).detect_board(image);
  const BoardDetection upside_down = BoardDetector(board).detect_board(turned);
  ASSERT_FALSE(upright.tags.empty());
  ASSERT_EQ(upside_down.tags.size(), upright.tags.size());
  const Eigen::Vector2d last(image.cols - 1, image.rows - 1);
  for (std::size_t i = 0; i < upright.tags.size(); ++i) {
    EXPECT_EQ(upside_down.tags[i].id, upright.tags[i].id);
    for (std::size_t k = 0; k < 4; ++k) {
      const Eigen::Vector2d back = last - upside_down.tags[i].corners_px[k];
      EXPECT_LT((back - upright.tags[i].corners_px[k]).norm(), 0.02);
    }
  }
}

TEST_P(BoardDetectorOnRenderedBoard, ReportsTagsWithOtherIdsAsForeign) {
  Board other = board;
  other.first_id = 100;
  const BoardDetection seen = BoardDetector(other).detect_board(image);
  EXPECT_TRUE(seen.tags.empty());
  EXPECT_GT(seen.foreign_tags.size(), 10U);
}

TEST_P(BoardDetectorOnRenderedBoard, RejectsTagsDetectedTwice) {
  cv::Mat twice;
  cv::hconcat(image, image, twice);
  const BoardDetection seen = BoardDetector(board).detect_board(twice);
  EXPECT_TRUE(seen.tags.empty()) << seen.tags.size();
  EXPECT_EQ(seen.num_unusable_tags, static_cast<int>(find_true_corners().size()));
  EXPECT_EQ(seen.num_overexposed_tags, 0);
}

TEST_P(BoardDetectorOnRenderedBoard, RejectsOnlyTagThatIsCopiedBesideBoard) {
  const BoardDetector detector(board);
  const BoardDetection all = detector.detect_board(image);
  ASSERT_GT(all.tags.size(), 10U);
  const TagDetection copied = all.tags[all.tags.size() / 2];
  std::vector<cv::Point2f> corners;
  for (const auto& corner : copied.corners_px) corners.emplace_back(corner.x(), corner.y());
  const cv::Rect tag = cv::boundingRect(corners);
  constexpr int margin_px = 20;
  cv::Mat larger;
  cv::copyMakeBorder(image, larger, 0, 0, 0, tag.width + 2 * margin_px, cv::BORDER_CONSTANT,
                     cv::Scalar::all(double(image.at<uchar>(tag.y, tag.x))));
  image(tag).copyTo(larger(cv::Rect(image.cols + margin_px, margin_px, tag.width, tag.height)));
  const BoardDetection seen = detector.detect_board(larger);
  EXPECT_EQ(seen.num_unusable_tags, all.num_unusable_tags + 1);
  EXPECT_EQ(seen.tags.size(), all.tags.size() - 1);
  EXPECT_EQ(std::ranges::find(seen.tags, copied.id, &TagDetection::id), seen.tags.end());
}

TEST_P(BoardDetectorOnRenderedBoard, CountsRejectedTagsOnOverexposedPaper) {
  cv::Mat twice, bright;
  cv::hconcat(image, image, twice);
  double brightest = 0;
  cv::minMaxLoc(image, nullptr, &brightest);
  twice.convertTo(bright, CV_8U, 3 * 255 / brightest);
  const BoardDetection seen = BoardDetector(board).detect_board(bright);
  EXPECT_TRUE(seen.tags.empty()) << seen.tags.size();
  EXPECT_GE(seen.num_unusable_tags, 20);
  EXPECT_EQ(seen.num_overexposed_tags, seen.num_unusable_tags);
}

TEST_P(BoardDetectorOnRenderedBoard, ReturnsNoTagsForTinyImages) {
  const BoardDetector detector(board);
  for (const auto& [width, height] : {std::pair{1, 1}, {2, 100}, {800, 1}, {800, 2}, {3, 9}}) {
    cv::Mat part;
    cv::resize(image, part, {width, height});
    EXPECT_TRUE(detector.detect_board(part).tags.empty());
  }
}

INSTANTIATE_TEST_SUITE_P(Boards, BoardDetectorOnRenderedBoard,
                         testing::Values("paper-rig", "paper-rig-faulty"));

/// Small images are searched in full resolution.
TEST(BoardDetector, DetectsTagsOf12PixelsInSmallImage) {
  const fs::path rig = VLP_SOURCE_DIR "/datasets/paper-rig/rendered";
  cv::Mat small;
  cv::resize(read_image(rig / "sample-boards/0000.png"), small, {}, 0.35, 0.35, cv::INTER_AREA);
  const Board board = read_board(rig / "board.yaml");
  const BoardDetection seen = BoardDetector(board).detect_board(small);
  EXPECT_EQ(seen.tags.size(), list_board_tags(board).size());
}

TEST(BoardDetector, ConstructorThrowsForTagFamilyMissingInAruco) {
  Board board = read_board(VLP_SOURCE_DIR "/datasets/paper-rig-faulty/rendered/board.yaml");
  board.family = "tagStandard41h12";
  EXPECT_THROW(BoardDetector{board}, std::invalid_argument);
}

/// Returns the number of images of a folder per number of detected tags.
std::map<std::size_t, int> images_by_tags(const fs::path& folder, const fs::path& board) {
  std::map<std::size_t, int> counts;
  const BoardDetector detector(read_board(board));
  for (const fs::path& image : list_images(folder)) {
    ++counts[detector.detect_board(read_image(image)).tags.size()];
  }
  return counts;
}

TEST(BoardDetector, DetectsAll40TagsInEachPhoneImage) {
  const auto folder = real_data("apriltag-lattice-phone");
  if (folder.empty()) GTEST_SKIP() << "no real captures here";
  EXPECT_EQ(images_by_tags(folder, folder / "board.yaml"), (std::map<std::size_t, int>{{40, 8}}));
}

TEST(BoardDetector, DetectsAllVisibleTagsInStereoImages) {
  const auto folder = real_data("kalibr-aprilgrid-stereo");
  if (folder.empty()) GTEST_SKIP() << "no real captures here";
  const std::map<std::size_t, int> expected{{15, 2}, {20, 14}};  // the rest is out of the image
  EXPECT_EQ(images_by_tags(folder / "cam0", folder / "board.yaml"), expected);
  EXPECT_EQ(images_by_tags(folder / "cam1", folder / "board.yaml"), expected);
}

/// Boards in the shadow, cut by the image circle, and with corners of acute angles.
TEST(BoardDetector, DetectsChessboardInEachFisheyeImage) {
  const auto folder = real_data("chessboard-fisheye");
  if (folder.empty()) GTEST_SKIP() << "no real captures here";
  const BoardDetector detector(read_board(folder / "board.yaml"));
  const auto images = list_images(folder);
  ASSERT_EQ(images.size(), 26U);
  for (const fs::path& image : images) {
    EXPECT_GE(detector.detect_board(read_image(image)).points.size(), 22U) << image;  // of 24
  }
}

/// White is clipped in most images, and markers cover the corners of five tags.
TEST(BoardDetector, DetectsTagsInOverexposedImages) {
  const auto folder = real_data("aprilgrid-mocap");
  if (folder.empty()) GTEST_SKIP() << "no real captures here";
  const BoardDetector detector(read_board(folder / "board.yaml"));
  const auto images = list_images(folder / "images");
  ASSERT_EQ(images.size(), 30U);
  std::size_t tags = 0;
  for (const fs::path& image : images) {
    const BoardDetection seen = detector.detect_board(read_image(image));
    EXPECT_GE(seen.tags.size(), 15U) << image;
    tags += seen.tags.size();
  }
  EXPECT_GE(tags, 850U);
}

}  // namespace
}  // namespace vlp
