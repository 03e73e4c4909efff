// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Stripes of switched lamps: period, duty cycle and contrast against theory.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "simulation/plain_scene.h"

namespace vlp {
namespace {

/// Returns the lit fraction of each line that crosses a large lamp: switched / always on, along the
/// middle.
std::vector<double> lit_lines(Scene scene, double frequency_hz, double duty, double exposure_s) {
  scene.camera = pinhole_camera();
  scene.lamps[0].glow.shape = make_disc_lamp_shape(1.2);
  LampShot shot = shot_at(scene, {0, 0, 0.1}, 0);
  shot.exposure_s = exposure_s;
  const FrameRenderer renderer(scene);
  const cv::Mat1f always = renderer.render_lamps(shot);
  shot.waves[0] = {frequency_hz, duty, 0.123};
  const cv::Mat1f switched = renderer.render_lamps(shot);
  const int middle = always.cols / 2;
  std::vector<double> lit;
  for (int line = 110; line < 490; ++line) {
    lit.push_back(switched(line, middle) / always(line, middle));
  }
  return lit;
}

/// Returns the positions at which the lit fraction rises through one half.
std::vector<double> find_rises(const std::vector<double>& lit) {
  std::vector<double> rises;
  for (std::size_t i = 1; i < lit.size(); ++i) {
    if (lit[i - 1] < 0.5 && lit[i] >= 0.5) {
      rises.push_back(double(i) - (lit[i] - 0.5) / (lit[i] - lit[i - 1]));
    }
  }
  return rises;
}

struct Wave {
  double frequency_hz, duty;
};

class FrameRendererStripes : public testing::TestWithParam<Wave> {};

TEST_P(FrameRendererStripes, StripePeriodAndDutyMatchLamp) {
  const auto [frequency_hz, duty] = GetParam();
  const auto lit = lit_lines(plain_scene(), frequency_hz, duty, 2e-5);
  const auto rises = find_rises(lit);
  ASSERT_GE(rises.size(), 5);
  const double period = (rises.back() - rises.front()) / double(rises.size() - 1);
  const double expected = 1 / (frequency_hz * 3e-5);
  EXPECT_NEAR(period / expected, 1, 0.01);

  // Lines between the first and the last rise; those at the ends by their fraction.
  double sum = 0;
  for (std::size_t i = 0; i < lit.size(); ++i) {
    const double inside =
        std::min(double(i) + 0.5, rises.back()) - std::max(double(i) - 0.5, rises.front());
    sum += lit[i] * std::clamp(inside, 0.0, 1.0);
  }
  EXPECT_NEAR(sum / (rises.back() - rises.front()) / duty, 1, 0.01);
}

INSTANTIATE_TEST_SUITE_P(Waves, FrameRendererStripes,
                         testing::Values(Wave{1000, 0.5}, Wave{1600, 0.3}, Wave{2500, 0.5},
                                         Wave{3100, 0.7}, Wave{4700, 0.5}),
                         [](const auto& instance) {
                           return std::to_string(int(instance.param.frequency_hz)) + "Hz";
                         });

TEST(FrameRenderer, StripeContrastIsSincOfExposure) {
  const double frequency_hz = 2500;
  const auto amplitude = [&](double exposure_s) {
    const auto lit = lit_lines(plain_scene(), frequency_hz, 0.5, exposure_s);
    // Fundamental of the wave over whole periods: 380 lines contain 28.5 periods of 13.33; 360
    // contain 27.
    double re = 0, im = 0;
    for (int i = 0; i < 360; ++i) {
      const double angle = 2 * std::numbers::pi * frequency_hz * 3e-5 * i;
      re += lit[std::size_t(i)] * std::cos(angle);
      im += lit[std::size_t(i)] * std::sin(angle);
    }
    return std::hypot(re, im);
  };
  const auto sinc = [&](double exposure_s) {
    const double x = std::numbers::pi * frequency_hz * exposure_s;
    return std::sin(x) / x;
  };
  for (const double exposure_s : {5e-5, 1e-4, 2e-4}) {
    EXPECT_NEAR(amplitude(exposure_s) / amplitude(1e-6), sinc(exposure_s), 0.01);
  }
}

TEST(FrameRenderer, RowBrightnessIsLitFractionOfRowExposure) {
  // At 1 kHz half a period is 16.67 lines; the middle line's exposure is centered at time 0.
  Scene scene = plain_scene();
  scene.camera = pinhole_camera();
  scene.lamps[0].glow.shape = make_disc_lamp_shape(1.2);
  LampShot shot = shot_at(scene, {0, 0, 0.1}, 0);
  const FrameRenderer renderer(scene);
  const cv::Mat1f always = renderer.render_lamps(shot);
  shot.waves[0] = {1000, 0.5, 0};
  const cv::Mat1f switched = renderer.render_lamps(shot);
  for (int line = 200; line < 400; ++line) {
    const double middle_s = (line - 299.5) * 3e-5;
    constexpr int steps = 5000;
    int lit = 0;
    for (int i = 0; i < steps; ++i) {
      const double periods = 1000 * (middle_s + ((i + 0.5) / steps - 0.5) * 5e-5);
      lit += periods - std::floor(periods) < 0.5;
    }
    EXPECT_NEAR(switched(line, 400) / always(line, 400), double(lit) / steps, 1e-3) << line;
  }
}

TEST(FrameRenderer, ElectronImageIsTransposedForColumnReadout) {
  Scene scene = plain_scene();
  scene.camera.readout = Readout::columns;
  scene.lamps[0].duty = 0.5;
  scene.lamps[0].frequency_hz = 3000;
  const FrameRenderer renderer(scene);
  // Lines of the electrons are columns of the image.
  const cv::Mat1f electrons = renderer.render_lamps(shot_at(scene, {0, 0, 0.1}, 0));
  EXPECT_EQ(electrons.size(), cv::Size(600, 800));
  const Brightness brightness = measure_brightness(electrons);
  EXPECT_NEAR(brightness.centroid_px.y(), 402.3, 6);
  EXPECT_NEAR(brightness.centroid_px.x(), 297.4, 0.5);
}

}  // namespace
}  // namespace vlp
