// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/unit_step.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "calibration/intrinsics/common_curve.h"
#include "detection/boards/detect_boards.h"
#include "detection/image_file.h"
#include "support/datasets.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

/// Images come one by one, and their curve is the camera's all the same.
TEST(UnitStep, HasCornersBehindTheCurveThatAllItsImagesCallFor) {
  const TemporaryFolder folder;
  const Board board = read_board(kRig + "/board.yaml");
  const cv::Mat seen = read_image(kRig + "/sample-boards/0000.png");
  cv::Mat table(1, 256, CV_8U);
  for (int i = 0; i < 256; ++i) {
    table.at<uchar>(i) = cv::saturate_cast<uchar>(255 * std::pow(i / 255.0, 1 / 1.8));
  }
  cv::Mat coded;
  cv::LUT(seen, table, coded);
  const BoardDetector detector(board);
  UnitStep step;
  std::vector<std::filesystem::path> files;
  for (const std::string name : {"a.png", "b.png"}) {
    cv::imwrite(folder / name, coded);
    files.push_back(folder / name);
    UnitImage image;
    image.view = BoardView{name, {coded.cols, coded.rows}, detector.detect(coded)};
    step.images[name] = image;
  }
  ImageSource source(files);
  auto together = detect_boards(detector, source, 1, {}, [](auto) {}).views;
  take_common_curve(together, board);
  for (int times = 0; times < 2; ++times) {
    const auto views = views_of(step, board);
    ASSERT_EQ(views.size(), 2U);
    for (std::size_t view = 0; view < 2; ++view) {
      ASSERT_EQ(views[view].seen.tags.size(), together[view].seen.tags.size());
      for (std::size_t i = 0; i < views[view].seen.tags.size(); ++i) {
        EXPECT_EQ(views[view].seen.tags[i].corners_px, together[view].seen.tags[i].corners_px);
      }
    }
    const auto& alone = step.images["a.png"].view->seen.tags[0].corners_px[0];
    EXPECT_GT((views[0].seen.tags[0].corners_px[0] - alone).norm(), 0.1);
  }
}

}  // namespace
}  // namespace vlp
