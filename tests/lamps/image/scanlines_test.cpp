// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/image/scanlines.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "frontend/mat_view.h"
#include "lamps/image/pixel_runs.h"
#include "lamps/rendered_captures.h"
#include "support/random.h"

namespace vlp {
namespace {

constexpr int kAround_px = 64;

/// Returns the pixels of a view as an image of OpenCV.
cv::Mat to_mat(const ImageView& view) {
  return {view.height, view.width, view.bits == 8 ? CV_8U : CV_16U, const_cast<void*>(view.data),
          std::size_t(view.stride)};
}

/// Returns a dark image with noise and some spots of light.
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
  const ScanlineImage found =
      make_scanline_image(to_image_view(image), Readout::columns, {0, 1, threshold});
  const cv::Mat lines = to_mat(found.pixels), all = image.t();
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
  // Pixels that are not transposed are black and were dark.
  const cv::Mat differs = lines != all;
  EXPECT_EQ(cv::countNonZero(differs & (lines != 0)), 0);
  EXPECT_EQ(cv::countNonZero(differs & bright), 0);
  // Only lit tiles are searched, and no run is missed.
  const auto runs_in_lit_tiles = find_pixel_runs(found.pixels, threshold, found.lit);
  const auto all_runs = find_pixel_runs(to_image_view(all), threshold);
  EXPECT_TRUE(std::equal(runs_in_lit_tiles.begin(), runs_in_lit_tiles.end(), all_runs.begin(),
                         all_runs.end(), [](const PixelRun& a, const PixelRun& b) {
                           return a.row == b.row && a.begin == b.begin && a.end == b.end;
                         }));
}

TEST(MakeScanlineImage, ReturnsSameImageForRowReadout) {
  const cv::Mat image = spots_on_dark({100, 70}, CV_8U, 3);
  EXPECT_EQ(make_scanline_image(to_image_view(image), Readout::rows, {0, 1, 100}).pixels.data,
            image.data);
}

TEST(MakeScanlineImage, TransposesTilesAroundLitPixelsForColumnReadout) {
  for (const cv::Size& size : {cv::Size(640, 448), cv::Size(601, 333), cv::Size(64, 64),
                               cv::Size(63, 65), cv::Size(1000, 7), cv::Size(1, 500)}) {
    for (const int spots : {1, 4, 20}) {
      SCOPED_TRACE(testing::Message() << size << ", " << spots << " spots");
      expect_turned(spots_on_dark(size, CV_8U, spots), 100);
      expect_turned(spots_on_dark(size, CV_16U, spots), 100 * 257);
    }
  }
}

TEST(MakeScanlineImage, FillsSurroundingsOfLightsWithBackgroundLevel) {
  for (const int depth : {CV_8U, CV_16U}) {
    const double white = depth == CV_8U ? 255 : 65535;
    cv::Mat image = spots_on_dark({2000, 1500}, depth, 0);
    const cv::Rect light(900, 700, 200, 150);
    image(light).setTo(white);
    const ScanlineImage found =
        make_scanline_image(to_image_view(image), Readout::columns, {7.4, 1, white - 1});
    const cv::Mat lines = to_mat(found.pixels);
    EXPECT_EQ(lines.size(), cv::Size(1500, 2000));
    EXPECT_EQ(lines.type(), image.type());
    // The margin is the size of the light: at least 200 px.
    const cv::Rect around(light.y - 200, light.x - 200, light.height + 400, light.width + 400);
    const cv::Mat turned = image.t();
    const cv::Mat differs = lines(around) != turned(around), at_level = lines(around) == 7;
    EXPECT_EQ(cv::countNonZero(differs & ~at_level), 0);
    EXPECT_GT(cv::countNonZero(differs), 100'000) << "beside the tiles that are turned";
    EXPECT_EQ(cv::countNonZero(lines(cv::Rect(0, 0, 300, 300))), 0) << "far from it";
  }
}

TEST(MakeScanlineImage, ReturnsBlackImageWhenNoTileIsLit) {
  cv::Mat dark = spots_on_dark({601, 333}, CV_8U, 0);
  dark.at<std::uint8_t>(100, 200) = dark.at<std::uint8_t>(300, 500) = 200;  // no run of three
  const ScanlineImage lines =
      make_scanline_image(to_image_view(dark), Readout::columns, {7.4, 1, 100});
  EXPECT_EQ(lines.pixels.size(), (ImageSize{333, 601}));
  EXPECT_EQ(cv::countNonZero(to_mat(lines.pixels)), 0);
  EXPECT_TRUE(find_pixel_runs(lines.pixels, 100, lines.lit).empty());
}

TEST(MakeScanlineImage, KeepsRunAcrossTileBorder) {
  cv::Mat image(200, 200, CV_8U, cv::Scalar(0));
  image.at<std::uint8_t>(63, 10) = image.at<std::uint8_t>(65, 10) = 200;
  const ScanlineImage lines =
      make_scanline_image(to_image_view(image), Readout::columns, {0, 1, 100});
  const auto runs = find_pixel_runs(lines.pixels, 100, lines.lit);
  ASSERT_EQ(runs.size(), 1U);
  EXPECT_EQ(runs[0].row, 10);
  EXPECT_EQ(runs[0].begin, 63);
  EXPECT_EQ(runs[0].end, 66);
}

/// Compares positions by row, then by column of the scanlines.
bool before(const Light& a, const Light& b) {
  return a.pixel.x() != b.pixel.x() ? a.pixel.x() < b.pixel.x() : a.pixel.y() < b.pixel.y();
}

TEST(LightDetector, DetectsSameLightsInTransposedImageWithColumnReadout) {
  Scene scene = read_scene_file(VLP_SOURCE_DIR "/datasets/paper-rig/scene.yaml");
  // The sample for the background uses other pixels of a transposed image; they must have the same
  // levels.
  scene.ambient_e_per_s = 0;
  scene.sensor.shot_noise = false;
  scene.sensor.read_noise_e = 0;
  const FrameRenderer renderer(scene);
  const LampMap map = make_scene_lamp_map(scene, false);
  const double row_time_s = *scene.camera.row_time_s;
  const LightDetector by_rows(map, {Readout::rows, row_time_s, std::nullopt});
  const LightDetector by_columns(map, {Readout::columns, row_time_s, std::nullopt});
  const CaptureSet& set =
      *std::find_if(scene.sets.begin(), scene.sets.end(),
                    [](const CaptureSet& any) { return any.folder == "check"; });
  for (std::size_t i = 0; i < 3; ++i) {
    const LampShot shot = make_lamp_capture_parameters(scene, set, i * 7);
    const cv::Mat image = simulate_sensor_image(
        scene.sensor, renderer.render_lamps_in_electrons(shot), shot.noise_seed);
    const auto upright = by_rows.detect_lights(to_image_view(image));
    auto turned = by_columns.detect_lights(to_image_view(image.t()));
    std::sort(turned.begin(), turned.end(), before);
    EXPECT_GE(upright.size(), 4U);
    ASSERT_EQ(upright.size(), turned.size());
    for (std::size_t j = 0; j < upright.size(); ++j) {
      EXPECT_LT((upright[j].pixel - turned[j].pixel.reverse()).norm(), 1e-5);
      EXPECT_NEAR(upright[j].sigma_px, turned[j].sigma_px, 1e-6);
      EXPECT_EQ(upright[j].lamp, turned[j].lamp);
      EXPECT_EQ(upright[j].kind, turned[j].kind);
      EXPECT_EQ(upright[j].stripes.period_lines, turned[j].stripes.period_lines);
    }
  }
}

}  // namespace
}  // namespace vlp
