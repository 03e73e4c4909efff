// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/signal/modulation_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>

#include "frontend/mat_view.h"
#include "lamps/drawn_lamp.h"
#include "support/random.h"

namespace vlp {
namespace {

constexpr std::array kMapPeriods_lines{12.0, 16.0};

ModulationMap make_map(const cv::Mat& image, int lines_per_bin = 1, double dark = 0) {
  const PixelBox box{0, 0, image.cols, image.rows};
  return compute_modulation_map(
      average_pixels_over_cells(to_image_view(image), box, dark, lines_per_bin), kMapPeriods_lines,
      true);
}

cv::Mat square_wave(double period_lines, double low, double high) {
  cv::Mat1b image(160, 64);
  for (int row = 0; row < image.rows; ++row) {
    const double phase = row / period_lines;
    image.row(row).setTo(phase - std::floor(phase) < 0.5 ? high : low);
  }
  return image;
}

TEST(AveragePixelsOverCells, ReturnsMeanMinusDarkPerCellAndScanlineBin) {
  cv::Mat1b image(4, 19, std::uint8_t(10));
  image(0, 0) = 26;
  image(3, 18) = 40;
  const CellLevels cells = average_pixels_over_cells(to_image_view(image), {0, 0, 19, 4}, 3, 2);
  ASSERT_EQ(cells.cells, 3);
  ASSERT_EQ(cells.bins, 2);
  EXPECT_FLOAT_EQ(cells.cell_levels_in_scanline_band(0)[0], 7 + 1);  // 16 more in 16 pixels
  EXPECT_FLOAT_EQ(cells.cell_levels_in_scanline_band(0)[1], 7);
  EXPECT_FLOAT_EQ(cells.cell_levels_in_scanline_band(1)[2],
                  7 + 5);  // 30 more in the 6 pixels that the last cell has
}

TEST(ComputeModulationMap, ReturnsMeanAndFundamentalAmplitudeOfSquareWave) {
  for (const int lines_per_bin : {1, 2}) {
    const ModulationMap map = make_map(square_wave(12, 20, 100), lines_per_bin);
    const std::size_t middle = map.modulation_cell_index(map.steps / 2, map.cells / 2);
    EXPECT_NEAR(map.mean[middle], 60, 0.5);
    EXPECT_NEAR(map.amplitude[middle], 40 * 4 / std::numbers::pi, 3);
  }
}

TEST(ComputeModulationMap, ReturnsNearlyZeroAmplitudeForSteadyLightAndLinearRamp) {
  const ModulationMap steady = make_map(cv::Mat1b(160, 64, std::uint8_t(200)));
  const std::size_t middle = steady.modulation_cell_index(steady.steps / 2, steady.cells / 2);
  EXPECT_LT(steady.amplitude[middle], 0.1);

  cv::Mat1b image(160, 64);
  for (int row = 0; row < image.rows; ++row) image.row(row).setTo(20 + row);
  const ModulationMap map = make_map(image);
  EXPECT_LT(map.amplitude[map.modulation_cell_index(map.steps / 2, map.cells / 2)], 0.5);
}

TEST(ComputeMinSignificantAmplitude, NoiseExceedsFractionOfThresholdAtExpectedRate) {
  // The squared amplitude is exponentially distributed: a threshold lower by a factor has the
  // probability 1e-9 to the power of its square.
  constexpr double noise = 3, fraction = 0.4;
  const double expected = std::pow(1e-9, fraction * fraction);
  Random random(1);
  double above = 0, count = 0;
  for (int image = 0; image < 20; ++image) {
    CellLevels cells{{0, 0, 512, 200}, 64, 200, 1, {}};
    for (int i = 0; i < 64 * 200; ++i) {
      cells.levels.push_back(float(noise / std::sqrt(double(kCellWidth_px)) * random.normal()));
    }
    const std::array period{12.0};
    const ModulationMap map = compute_modulation_map(cells, period, false);
    // Steps a window apart are independent; ends are not whole.
    for (int step = 12; step < map.steps - 12; step += 12) {
      for (int cell = 0; cell < map.cells; ++cell) {
        above += map.amplitude[map.modulation_cell_index(step, cell)] >
                 fraction * compute_min_significant_amplitude(noise, 12);
        ++count;
      }
    }
  }
  ASSERT_GT(count, 5000);
  EXPECT_NEAR(above / count / expected, 1, 0.2);
}

TEST(FindModulatedRegions, SeparatesLampsAndExcludesSteadyLight) {
  const cv::Size size(400, 200);
  const DrawnLamp one{.center = {90, 100}, .stripes = {.period_lines = 12}};
  const DrawnLamp other{.center = {300, 90}, .stripes = {.period_lines = 16}};
  const DrawnLamp steady{.center = {195, 100}, .radius_px = 30, .stripes = {.duty = 1}};
  const cv::Mat image = render_lamps({one, other, steady}, size, CV_8U, 1);
  const ModulationMap map = make_map(image, 1, 255 * kDark);
  auto regions = find_modulated_regions(map, compute_min_significant_amplitude(2, 12));
  std::erase_if(regions, [](const ModulatedRegion& region) { return region.cells < 100; });
  ASSERT_EQ(regions.size(), 2U);
  std::sort(regions.begin(), regions.end(), [](auto& a, auto& b) { return a.box.x < b.box.x; });
  EXPECT_NEAR(regions[0].box.x + regions[0].box.width / 2.0, 90, 8);
  EXPECT_NEAR(regions[1].box.x + regions[1].box.width / 2.0, 300, 8);
}

TEST(FindModulatedRegions, ReturnsNoneForNoise) {
  const cv::Mat image = render_lamps({}, {400, 300}, CV_8U, 3);
  EXPECT_TRUE(find_modulated_regions(make_map(image, 1, 255 * kDark),
                                     compute_min_significant_amplitude(3, 12))
                  .empty());
}

}  // namespace
}  // namespace vlp
