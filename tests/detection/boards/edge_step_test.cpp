// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Steps across edges of rendered tags: their MTF50 against that of the rendered optics.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "calibration/intrinsics/lens_sharpness.h"
#include "detection/boards/tone_curve.h"
#include "geometry/median.h"
#include "simulation/exposure.h"
#include "simulation/frame_renderer.h"
#include "simulation/scene.h"
#include "simulation/shot.h"

namespace vlp {
namespace {

/// Returns the frequency, in cycles per pixel, at which a decreasing transfer is 0.5.
template <typename Transfer>
double solve_mtf50(const Transfer& transfer) {
  double low = 0, high = 2;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (transfer(middle) > 0.5 ? low : high) = middle;
  }
  return low;
}

/// Returns the transfer of a pixel along one of its axes.
double pixel_transfer(double f) {
  const double x = std::numbers::pi * f;
  return x == 0 ? 1 : std::sin(x) / x;
}

double gaussian_transfer(double sigma_px, double f) {
  return std::exp(-2 * std::pow(std::numbers::pi * sigma_px * f, 2));
}

/// Width of a tag of the family tag36h11 with its black stripe, in bits.
constexpr double kTagBits = 8;

struct Found {
  std::size_t edges = 0;
  double mtf50 = 0, black_to_white = 0;
};

/// Returns the medians over the edges, of at least `min_side_px`, of `count` rendered views, rolled
/// by up to 180 degrees.
Found measure(const Scene& scene, std::size_t count, double min_side_px = 0) {
  const CaptureSet set = *std::ranges::find(scene.sets, "boards", &CaptureSet::folder);
  const FrameRenderer renderer(scene);
  const BoardDetector detector(scene.board->pattern);
  std::vector<BoardView> views;
  views.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const BoardShot shot = make_board_shot(scene, set, i);
    const cv::Mat image =
        simulate_sensor_image(scene.sensor, renderer.render_board(shot), i, scene.processing);
    views.push_back({shot.image, scene.camera.imager_px, detector.detect_board(image)});
  }
  correct_views_for_tone_curve(views, sum_tone_curve_costs(views));
  std::vector<double> blurs_px, ratios;
  for (const BoardView& view : views) {
    for (const TagDetection& tag : view.detection.tags) {
      for (std::size_t k = 0; k < tag.steps.size(); ++k) {
        const EdgeStep& step = tag.steps[k];
        const double side_px = (tag.corners_px[(k + 1) % 4] - tag.corners_px[k]).norm();
        if (!(step.blur_px > 0) || side_px < min_side_px) continue;
        blurs_px.push_back(step.blur_px);
        ratios.push_back(step.dark / step.bright);
      }
    }
  }
  if (blurs_px.empty()) return {};
  const std::size_t edges = blurs_px.size();
  return {edges, compute_mtf50_of_blur(upper_median(blurs_px)), upper_median(ratios)};
}

Scene station_scene() { return read_scene_file(VLP_SOURCE_DIR "/datasets/station/scene.yaml"); }

TEST(EdgeSteps, MedianMtf50MatchesRenderedGaussianBlur) {
  for (const double sigma_px : {0.5, 0.7, 1.0, 1.5, 2.0}) {
    Scene scene = station_scene();
    scene.optics.blur_px = sigma_px;
    const Found found = measure(scene, 4, 3 * kTagBits * sigma_px);
    ASSERT_GT(found.edges, 50U) << sigma_px;
    const double truth =
        solve_mtf50([&](double f) { return gaussian_transfer(sigma_px, f) * pixel_transfer(f); });
    EXPECT_NEAR(found.mtf50 / truth, 1, 0.03) << sigma_px;
    RecordProperty("mtf50_ratio_" + std::to_string(int(10 * sigma_px)),
                   std::to_string(found.mtf50 / truth));
  }
}

TEST(EdgeSteps, MedianMtf50MatchesRenderedDefocus) {
  for (const auto& optics :
       {std::pair(0.3, 0.8), {0.3, 1.75}, {0.3, 2.5}, {0.7, 1.6}, {0.7, 2.0}, {0.7, 2.5}}) {
    const double blur_px = optics.first, radius_px = optics.second;
    Scene scene = station_scene();
    scene.optics.blur_px = blur_px;
    scene.optics.defocus = Defocus{radius_px};
    const Found found = measure(scene, 4);
    ASSERT_GT(found.edges, 100U) << radius_px;
    const double truth = solve_mtf50([&](double f) {
      const double x = 2 * std::numbers::pi * radius_px * f;
      const double disc = x < 1e-9 ? 1 : 2 * std::cyl_bessel_j(1.0, x) / x;
      return gaussian_transfer(blur_px, f) * pixel_transfer(f) * disc;
    });
    EXPECT_NEAR(found.mtf50 / truth, 1, 0.035) << blur_px << " " << radius_px;
    RecordProperty("mtf50_ratio_" + std::to_string(int(100 * radius_px)),
                   std::to_string(found.mtf50 / truth));
  }
}

TEST(EdgeSteps, MedianMtf50MatchesRenderedBlurWithToneCurve) {
  for (const double sigma_px : {0.7, 1.4}) {
    Scene scene = station_scene();
    scene.optics.blur_px = sigma_px;
    scene.processing.emplace().gamma = 2.2;
    const Found found = measure(scene, 6);
    ASSERT_GT(found.edges, 100U) << sigma_px;
    const double truth =
        solve_mtf50([&](double f) { return gaussian_transfer(sigma_px, f) * pixel_transfer(f); });
    EXPECT_NEAR(found.mtf50 / truth, 1, 0.03) << sigma_px;
    RecordProperty("mtf50_ratio_" + std::to_string(int(10 * sigma_px)),
                   std::to_string(found.mtf50 / truth));
  }
}

TEST(EdgeSteps, BlackToWhiteRatioMoreThanDoublesUnderVeil) {
  const double clean = measure(station_scene(), 3).black_to_white;
  Scene veiled = station_scene();
  veiled.optics.veiling_glare = 0.25;
  const Found found = measure(veiled, 3);
  ASSERT_GT(found.edges, 100U);
  EXPECT_NEAR(clean, 0.08, 0.02);  // 1.5e5 / 2.4e6, and the black level of the sensor
  EXPECT_GT(found.black_to_white, 2 * clean);
}

}  // namespace
}  // namespace vlp
