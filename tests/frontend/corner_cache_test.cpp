// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/corner_cache.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "frontend/board_intake.h"
#include "frontend/image_file.h"
#include "rig/board.h"
#include "support/datasets.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

/// Files of the cache are not synchronized: a power failure may truncate a file.
TEST(CornerCache, TruncatedFileYieldsSameDetectionAndIsRewritten) {
  const fs::path rig = kRig;
  const TemporaryFolder folder;
  const Board board = read_board(rig / "board.yaml");
  FrontendOptions options;
  options.corner_cache = folder / "cache";
  const auto view = [&] {
    const fs::path image = rig / "sample-boards/0000.png";
    return BoardIntake(board, options).detect_board(SourceImage(image)).board.value();
  };
  const BoardView whole = view();
  ASSERT_GE(whole.detection.tags.size(), 20U);
  const fs::path kept = fs::directory_iterator(folder / "cache")->path();
  const std::string text = TemporaryFolder::read_content(kept);
  std::size_t ends = 0;
  for (std::size_t end = text.find('\n'); end != std::string::npos;
       end = text.find('\n', end + 1)) {
    if (++ends % 9 != 1) continue;
    fs::resize_file(kept, end + 1);
    const BoardView again = view();
    ASSERT_EQ(again.detection.tags.size(), whole.detection.tags.size()) << ends << " lines";
    EXPECT_EQ(again.detection.tags.back().corners_px, whole.detection.tags.back().corners_px);
    EXPECT_EQ(TemporaryFolder::read_content(kept), text);
  }
  EXPECT_GT(ends, 0U);
}

/// The tone curve is estimated from all images of a camera, so that fits for all curves are stored.
TEST(CornerCache, FindReturnsStoredFitsForAllToneCurves) {
  const fs::path rig = kRig;
  const TemporaryFolder folder;
  const Board board = read_board(rig / "board.yaml");
  cv::Mat coded = read_image(rig / "sample-boards/0000.png");
  cv::Mat table(1, 256, CV_8U);
  for (int i = 0; i < 256; ++i) {
    table.at<uchar>(i) = cv::saturate_cast<uchar>(255 * std::pow(i / 255.0, 1 / 1.8));
  }
  cv::LUT(coded, table, coded);
  // One tag, of which an edge looks otherwise, keeps libapriltag's corners.
  const TagDetection whole = BoardDetector(board).detect_board(coded).tags.at(7);
  const Eigen::Vector2d from = whole.corners_px[0], to = whole.corners_px[1];
  const Eigen::Vector2d outwards = 4 * (from - whole.corners_px[3]).normalized();
  for (const double fraction : {0.1, 0.25, 0.4, 0.55, 0.7, 0.85}) {
    const Eigen::Vector2d at = from + fraction * (to - from) + outwards;
    cv::circle(coded, cv::Point2d(at.x(), at.y()), 1, cv::Scalar(0), -1);
  }
  const BoardView view{
      "coded.png", {coded.cols, coded.rows}, BoardDetector(board).detect_board(coded)};
  ASSERT_EQ(view.detection.curve_costs.size(), 5U);
  const auto spoilt = std::ranges::find(view.detection.tags, whole.id, &TagDetection::id);
  ASSERT_NE(spoilt, view.detection.tags.end());
  ASSERT_EQ(spoilt->tone_curve_fits,
            std::vector<TagDetection::Outline>(
                4, {spoilt->corners_px, spoilt->curvatures, spoilt->corner_sds_px}));
  cv::imwrite(folder / "coded.png", coded);
  const SourceImage image(folder / "coded.png");
  const CornerCache cache(folder / "cache", board);
  cache.store_cached_view(image, {view, 0.8, 0.9, 0.05});
  const auto kept = cache.find_cached_view(image);
  ASSERT_TRUE(kept);
  EXPECT_EQ(kept->blur_px, 0.8);
  EXPECT_EQ(kept->bright_fraction, 0.9);
  EXPECT_EQ(kept->white_fraction, 0.05);
  EXPECT_EQ(kept->view.detection.curve_costs, view.detection.curve_costs);
  ASSERT_EQ(kept->view.detection.tags.size(), view.detection.tags.size());
  for (std::size_t i = 0; i < view.detection.tags.size(); ++i) {
    EXPECT_EQ(kept->view.detection.tags[i].corners_px, view.detection.tags[i].corners_px);
    EXPECT_EQ(kept->view.detection.tags[i].curvatures, view.detection.tags[i].curvatures);
    EXPECT_EQ(kept->view.detection.tags[i].corner_sds_px, view.detection.tags[i].corner_sds_px);
    EXPECT_EQ(kept->view.detection.tags[i].tone_curve_fits, view.detection.tags[i].tone_curve_fits);
    EXPECT_EQ(kept->view.detection.tags[i].steps, view.detection.tags[i].steps);
  }
}

}  // namespace
}  // namespace vlp
