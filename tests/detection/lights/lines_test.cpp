// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/lights/lines.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "detection/rendered_captures.h"
#include "support/random.h"

namespace vlp {
namespace {

constexpr int kAround_px = 64;

/// Dark, with noise, and some spots of light.
cv::Mat spots_on_dark(const cv::Size& size, int depth, int spots) {
  Random random(static_cast<std::uint64_t>(size.width));
  cv::Mat1d image(size);
  for (double& level : image) level = random.uniform(0, 40);
  for (int i = 0; i < spots; ++i) {
    const cv::Point at(int(random.index(std::size_t(size.width))),
                       int(random.index(std::size_t(size.height))));
    image(cv::Rect(at, cv::Size(3, 5)) & cv::Rect({0, 0}, size)) = 200;
  }
  cv::Mat result;
  image.convertTo(result, depth, depth == CV_8U ? 1 : 257);
  return result;
}

void expect_turned(const cv::Mat& image, double threshold) {
  const cv::Mat lines = lines_of(image, Readout::columns, {0, 1, threshold}), all = image.t();
  ASSERT_EQ(lines.size(), all.size());
  ASSERT_EQ(lines.type(), all.type());
  const cv::Mat bright = all > threshold;
  for (int row = 0; row < all.rows; ++row) {
    for (int column = 0; column < all.cols; ++column) {
      if (!bright.at<std::uint8_t>(row, column)) continue;
      const cv::Rect around =
          cv::Rect(column - kAround_px, row - kAround_px, 2 * kAround_px + 1, 2 * kAround_px + 1) &
          cv::Rect({0, 0}, all.size());
      ASSERT_EQ(cv::countNonZero(lines(around) != all(around)), 0) << row << ", " << column;
    }
  }
  // What is not turned is black and was dark.
  const cv::Mat differs = lines != all;
  EXPECT_EQ(cv::countNonZero(differs & (lines != 0)), 0);
  EXPECT_EQ(cv::countNonZero(differs & bright), 0);
}

TEST(Lines, AreTheImageWhenRowsAreRead) {
  const cv::Mat image = spots_on_dark({100, 70}, CV_8U, 3);
  EXPECT_EQ(lines_of(image, Readout::rows, {0, 1, 100}).data, image.data);
}

TEST(Lines, AreTheImageTurnedAroundAllThatIsBright) {
  for (const cv::Size& size : {cv::Size(640, 448), cv::Size(601, 333), cv::Size(64, 64),
                               cv::Size(63, 65), cv::Size(1000, 7), cv::Size(1, 500)}) {
    for (const int spots : {1, 4, 20}) {
      SCOPED_TRACE(testing::Message() << size << ", " << spots << " spots");
      expect_turned(spots_on_dark(size, CV_8U, spots), 100);
      expect_turned(spots_on_dark(size, CV_16U, spots), 100 * 257);
    }
  }
}

TEST(Lines, AreAsDarkAsTheBackgroundWhereNothingIsBright) {
  for (const int depth : {CV_8U, CV_16U}) {
    const cv::Mat dark = spots_on_dark({601, 333}, depth, 0);
    const cv::Mat lines = lines_of(dark, Readout::columns, {7.4, 1, 100 * 257});
    EXPECT_EQ(lines.size(), cv::Size(333, 601));
    EXPECT_EQ(lines.type(), dark.type());
    EXPECT_EQ(cv::countNonZero(lines != 7), 0);
  }
}

/// The first of two places by row, then by column of the lines.
bool before(const Light& a, const Light& b) {
  return a.pixel.x() != b.pixel.x() ? a.pixel.x() < b.pixel.x() : a.pixel.y() < b.pixel.y();
}

TEST(Lines, OfAFrameAndOfTheTurnedFrameShowTheSameLights) {
  Scene scene = read_scene(VLP_SOURCE_DIR "/datasets/paper-rig/scene.yaml");
  // The sample for the background takes other pixels of a turned image: they must be alike.
  scene.ambient_e_per_s = 0;
  scene.sensor.shot_noise = false;
  scene.sensor.read_noise_e = 0;
  const FrameRenderer renderer(scene);
  const LampMap map = lamp_map_of(scene, false);
  const double row_time_s = *scene.camera.row_time_s;
  const LampDetector by_rows(map, {Readout::rows, row_time_s, std::nullopt});
  const LampDetector by_columns(map, {Readout::columns, row_time_s, std::nullopt});
  const CaptureSet& set =
      *std::find_if(scene.sets.begin(), scene.sets.end(),
                    [](const CaptureSet& any) { return any.folder == "check"; });
  for (std::size_t i = 0; i < 3; ++i) {
    const LampShot shot = lamp_shot(scene, set, i * 7);
    const cv::Mat image = expose(scene.sensor, renderer.lamp_electrons(shot), shot.noise_seed);
    const auto upright = by_rows.detect(image);
    auto turned = by_columns.detect(image.t());
    std::sort(turned.begin(), turned.end(), before);
    EXPECT_GE(upright.size(), 4U);
    ASSERT_EQ(upright.size(), turned.size());
    for (std::size_t j = 0; j < upright.size(); ++j) {
      EXPECT_LT((upright[j].pixel - turned[j].pixel.reverse()).norm(), 1e-12);
      EXPECT_NEAR(upright[j].sigma_px, turned[j].sigma_px, 1e-12);
      EXPECT_EQ(upright[j].lamp, turned[j].lamp);
      EXPECT_EQ(upright[j].kind, turned[j].kind);
      EXPECT_EQ(upright[j].stripes.period_lines, turned[j].stripes.period_lines);
    }
  }
}

}  // namespace
}  // namespace vlp
