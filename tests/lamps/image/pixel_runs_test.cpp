// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/image/pixel_runs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "frontend/mat_view.h"

namespace vlp {

bool operator==(const PixelRun& a, const PixelRun& b) {
  return a.row == b.row && a.begin == b.begin && a.end == b.end;
}
void PrintTo(const PixelRun& run, std::ostream* out) {
  *out << "row " << run.row << ": " << run.begin << " to " << run.end;
}

namespace {

using testing::ElementsAre;
using testing::IsEmpty;

/// A dark row of 200 pixels with lit ones from begins to before ends.
cv::Mat row_with(const std::vector<std::pair<int, int>>& lit, int depth = CV_8U, double dark = 10,
                 double bright = 200) {
  cv::Mat row(1, 200, depth, cv::Scalar(dark));
  for (const auto& [begin, end] : lit) row.colRange(begin, end) = bright;
  return row;
}

TEST(FindPixelRuns, ReturnsLitPixelsOfEachRowInOrder) {
  cv::Mat image;
  cv::vconcat(std::vector{row_with({{20, 30}, {50, 53}}), row_with({}), row_with({{5, 8}})}, image);
  EXPECT_THAT(
      find_pixel_runs(to_image_view(image), 100),
      ElementsAre(vlp::PixelRun{0, 20, 30}, vlp::PixelRun{0, 50, 53}, vlp::PixelRun{2, 5, 8}));
}

TEST(FindPixelRuns, BridgesGapsOfUpToTwoPixels) {
  EXPECT_THAT(find_pixel_runs(to_image_view(row_with({{20, 25}, {26, 30}})), 100),
              ElementsAre(vlp::PixelRun{0, 20, 30}));
  EXPECT_THAT(find_pixel_runs(to_image_view(row_with({{20, 25}, {27, 30}})), 100),
              ElementsAre(vlp::PixelRun{0, 20, 30}));
  EXPECT_THAT(find_pixel_runs(to_image_view(row_with({{20, 25}, {28, 31}})), 100),
              ElementsAre(vlp::PixelRun{0, 20, 25}, vlp::PixelRun{0, 28, 31}));
}

TEST(FindPixelRuns, RejectsRunsOfOneOrTwoPixels) {
  EXPECT_THAT(
      find_pixel_runs(to_image_view(row_with({{0, 1}, {20, 21}, {40, 42}, {198, 200}})), 100),
      IsEmpty());
  EXPECT_THAT(find_pixel_runs(to_image_view(row_with({{20, 23}, {40, 42}})), 100),
              ElementsAre(vlp::PixelRun{0, 20, 23}));
}

TEST(FindPixelRuns, DetectsRunsAtAllPositions) {
  // Blocks of 64 pixels begin and end among these.
  for (int begin = 0; begin < 197; ++begin) {
    for (const int width : {3, 64, 65, 130}) {
      const int end = std::min(begin + width, 200);
      EXPECT_THAT(find_pixel_runs(to_image_view(row_with({{begin, end}})), 100),
                  ElementsAre(vlp::PixelRun{0, begin, end}));
    }
  }
}

TEST(FindPixelRuns, BridgesGapsAtTileBorders) {
  for (int gap = 60; gap < 68; ++gap) {
    EXPECT_THAT(find_pixel_runs(to_image_view(row_with({{50, gap}, {gap + 2, 90}})), 100),
                ElementsAre(vlp::PixelRun{0, 50, 90}));
    EXPECT_THAT(find_pixel_runs(to_image_view(row_with({{50, gap}, {gap + 3, 90}})), 100),
                ElementsAre(vlp::PixelRun{0, 50, gap}, vlp::PixelRun{0, gap + 3, 90}));
  }
}

TEST(FindPixelRuns, SeparatesRunsWithDarkTileBetween) {
  EXPECT_THAT(find_pixel_runs(to_image_view(row_with({{60, 64}, {128, 131}})), 100),
              ElementsAre(vlp::PixelRun{0, 60, 64}, vlp::PixelRun{0, 128, 131}));
}

TEST(FindPixelRuns, RejectsPixelsAtThreshold) {
  const cv::Mat row = row_with({{20, 30}}, CV_8U, 10, 100);
  EXPECT_THAT(find_pixel_runs(to_image_view(row), 99.9), ElementsAre(vlp::PixelRun{0, 20, 30}));
  EXPECT_THAT(find_pixel_runs(to_image_view(row), 100), IsEmpty());
  EXPECT_THAT(find_pixel_runs(to_image_view(row), 100.1), IsEmpty());
}

TEST(FindPixelRuns, DetectsRunsIn16BitImages) {
  const cv::Mat row = row_with({{20, 30}}, CV_16U, 3000, 40000);
  EXPECT_THAT(find_pixel_runs(to_image_view(row), 39999.5), ElementsAre(vlp::PixelRun{0, 20, 30}));
  EXPECT_THAT(find_pixel_runs(to_image_view(row), 40000), IsEmpty());
  EXPECT_THAT(find_pixel_runs(to_image_view(row), 300), ElementsAre(vlp::PixelRun{0, 0, 200}));
}

TEST(FindPixelRuns, ReturnsNoRunsWhenThresholdIsWhiteOrHigher) {
  for (const double threshold : {255.0, 257.5, 1e9}) {
    EXPECT_THAT(find_pixel_runs(to_image_view(row_with({{20, 30}}, CV_8U, 10, 255)), threshold),
                IsEmpty());
  }
  EXPECT_THAT(find_pixel_runs(to_image_view(row_with({{20, 30}}, CV_8U, 10, 255)), 254.9),
              ElementsAre(vlp::PixelRun{0, 20, 30}));
  for (const double threshold : {65535.0, 65540.0, 1e9}) {
    EXPECT_THAT(find_pixel_runs(to_image_view(row_with({{20, 30}}, CV_16U, 10, 65535)), threshold),
                IsEmpty());
  }
}

}  // namespace
}  // namespace vlp
