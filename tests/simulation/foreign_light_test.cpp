// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Flickering lights other than lamps, blinds and signs.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "simulation/plain_scene.h"
#include "simulation/truth.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

/// A level pinhole camera of f = 500 px, 1.5 m below the ceiling: 1 cm is 3.33 px, a row 30 us.
class FrameRendererForeignLight : public testing::Test {
 protected:
  FrameRendererForeignLight() {
    scene_.camera = pinhole_camera();
    scene_.lamps[0].glow.electron_rate_e_per_s = 0;
  }

  LampShot shot() const { return shot_at(scene_, {0, 0, 0.1}, 0); }
  cv::Mat1f rendered(const LampShot& shot) const {
    return FrameRenderer(scene_).render_lamps(shot);
  }
  cv::Mat1f rendered() const { return rendered(shot()); }
  Scene scene_ = plain_scene();
};

/// Returns the mean of a function of time over the exposure of a line, by dense sampling.
template <typename Function>
double mean_over_line(int line, double exposure_s, const Function& function) {
  constexpr int samples = 2000;
  double sum = 0;
  for (int i = 0; i < samples; ++i) {
    const double fraction = (i + 0.5) / samples - 0.5;
    sum += function((line - 299.5) * 3e-5 + fraction * exposure_s);
  }
  return sum / samples;
}

TEST(RectifiedSine, MeanLightFractionMatchesNumericalMean) {
  const RectifiedSine wave{100, 0.4, 0.3};
  const auto mean_until = [&](double end_s) {
    constexpr int samples = 100000;
    double sum = 0;
    for (int i = 0; i < samples; ++i) {
      const double t_s = -0.004 + (end_s + 0.004) * (i + 0.5) / samples;
      sum += 0.6 + 0.4 * std::abs(std::sin(M_PI * (100 * t_s + 0.3)));
    }
    return sum / samples;
  };
  for (const double end_s : {-0.0039, 0.002, 0.013, 0.1}) {
    EXPECT_NEAR(wave.compute_mean_light_fraction(-0.004, end_s), mean_until(end_s), 1e-7);
  }
}

TEST_F(FrameRendererForeignLight, PwmStripesMatchFrequencyDutyAndPhase) {
  // 500 Hz are 66.7 rows; the light is 400 rows high.
  scene_.clutter.foreign_lights = {
      {{{0, 0, 1.6}, make_disc_lamp_shape(1.2), 1e9, 1}, SquareWave{500, 0.3, 0}, 0.25}};
  const cv::Mat1f image = rendered();
  std::vector<double> rises;
  double lit = 0;
  for (int line = 110; line < 490; ++line) {
    const double before = image(line - 1, 399) / 5e4, now = image(line, 399) / 5e4;
    if (before < 0.5 && now >= 0.5) rises.push_back(line - (now - 0.5) / (now - before));
  }
  ASSERT_GE(rises.size(), 4U);
  const double period = (rises.back() - rises.front()) / double(rises.size() - 1);
  EXPECT_NEAR(period, 1 / (500 * 3e-5), 0.02);
  EXPECT_NEAR(rises[0], 299.5 + (std::round((rises[0] - 299.5) * 0.015) + 0 - 0.25) / 0.015, 0.9)
      << "lit from the phase 0 on, which is 0.25 at the middle row";
  for (int line = 200; line < 400; ++line) lit += image(line, 399) / 5e4 / 200;
  EXPECT_NEAR(lit, 0.3, 0.001) << "three periods";
}

TEST_F(FrameRendererForeignLight, RowBrightnessMatchesRectifiedSineOfMainsLight) {
  scene_.clutter.foreign_lights = {
      {{{0, 0, 1.6}, make_disc_lamp_shape(1.2), 1e9, 1}, RectifiedSine{100, 0.6, 0}, 0.2}};
  LampShot long_shot = shot();
  long_shot.exposure_s = 5e-4;
  const cv::Mat1f image = rendered(long_shot);
  for (int line = 120; line < 480; line += 45) {
    const double expected = mean_over_line(line, 5e-4, [](double t_s) {
      return 0.4 + 0.6 * std::abs(std::sin(M_PI * (100 * t_s + 0.2)));
    });
    EXPECT_NEAR(image(line, 399) / 5e5, expected, 1e-5) << line;
  }
}

TEST_F(FrameRendererForeignLight, RectangularForeignLightCoversItsProjectedArea) {
  const Glow tube{{0.1, 0, 1.6}, {ShapeKind::rectangle, Eigen::Vector2d(0.9, 0.06)}, 1e9, 1};
  scene_.clutter.foreign_lights = {{tube, RectifiedSine{120, 0, 0}, {}}};
  EXPECT_NEAR(measure_brightness(rendered()).sum, 300 * 20 * 5e4, 1e-4 * 300 * 20 * 5e4);
}

TEST_F(FrameRendererForeignLight, AmbientFlickerVariesByRowButNotAlongRow) {
  scene_.ambient_e_per_s = 2e7;
  scene_.clutter.ambient_flicker = RectifiedSine{100, 0.5, 0};
  scene_.clutter.windows = {{{0.3, 0.1, 1.6}, {0, 0.3, 0}, {0.15, 0, 0}, 5e7}};
  LampShot with_phase = shot();
  with_phase.ambient_phase = 0.4;
  const cv::Mat1f image = rendered(with_phase);
  for (int line = 0; line < 600; line += 60) {
    const double expected = mean_over_line(line, 5e-5, [](double t_s) {
      return 0.5 + 0.5 * std::abs(std::sin(M_PI * (100 * t_s + 0.4)));
    });
    EXPECT_NEAR(image(line, 100) / 1000, expected, 1e-5) << line;
    EXPECT_EQ(image(line, 700), image(line, 100)) << "the same along a row";
  }
  EXPECT_NEAR(image(370, 520), 2500, 1e-2) << "daylight does not flicker";
}

TEST_F(FrameRendererForeignLight, BlindRendersAlternateBrightAndDarkBars) {
  // 80 px along x, 100 px along y: ten bars of 5 px along x.
  scene_.ambient_e_per_s = 1e6;
  scene_.clutter.blinds = {{{{0.1, 0.1, 1.6}, {0.24, 0, 0}, {0, 0.3, 0}, 6e7}, 10, 0.5}};
  const cv::Mat1f image = rendered();
  const int u = 470, first = 333;
  for (int slat = 0; slat < 10; ++slat) {
    EXPECT_NEAR(image(first + 10 * slat + 2, u), 3000, 0.1);
    EXPECT_NEAR(image(first + 10 * slat + 7, u), 50, 0.1);
  }
  EXPECT_NEAR(measure_brightness(cv::Mat1f(image - 50)).sum, 4000 * 2950, 4000 * 2950 * 1e-4);
}

TEST_F(FrameRendererForeignLight, SlantedBlindRendersBarsAlongFirstEdge) {
  const double c = std::cos(0.5), s = std::sin(0.5);
  scene_.clutter.blinds = {
      {{{0, 0, 1.6}, {0.3 * c, 0.3 * s, 0}, {-0.3 * s, 0.3 * c, 0}, 6e7}, 3, 0.5}};
  const cv::Mat1f image = rendered();
  const auto level = [&](double along, double across) {  // fractions of the edges
    const double x_m = 0.3 * (along * c - across * s), y_m = 0.3 * (along * s + across * c);
    return image(int(std::lround(299.5 + y_m / 1.5 * 500)),
                 int(std::lround(399.5 + x_m / 1.5 * 500)));
  };
  for (const double along : {0.1, 0.5, 0.9}) {
    for (const int slat : {0, 1, 2}) {
      EXPECT_NEAR(level(along, (slat + 0.25) / 3), 3000, 0.1);
      EXPECT_NEAR(level(along, (slat + 0.75) / 3), 0, 0.1);
    }
  }
}

TEST_F(FrameRendererForeignLight, SignRendersRandomStrokesOfItsRadianceBySeed) {
  scene_.ambient_e_per_s = 1e6;
  scene_.clutter.signs = {{{{-0.3, -0.15, 1.6}, {0.6, 0, 0}, {0, 0.3, 0}, 6e7}, 2, 5, {}}};
  draw_random_parts(scene_);
  const auto& strokes = scene_.clutter.signs[0].strokes;
  ASSERT_GE(strokes.size(), 10U) << "each of ten letters has one or more";
  const cv::Mat1f image = rendered();
  for (const auto& stroke : strokes) {
    const Eigen::Vector2d middle = stroke.center();
    const int u = int(std::lround(399.5 + (middle.x() - 0.5) * 200));
    const int v = int(std::lround(299.5 + (middle.y() - 0.5) * 100));
    EXPECT_NEAR(image(v, u), 3000, 0.1);
  }
  const double lit = measure_brightness(cv::Mat1f(image - 50)).sum / 2950 / (200 * 100);
  EXPECT_GT(lit, 0.05);
  EXPECT_LT(lit, 0.6) << "dark between the strokes";
  const auto first = strokes;
  draw_random_parts(scene_);
  ASSERT_EQ(strokes.size(), first.size());
  EXPECT_EQ(strokes.back().min(), first.back().min());
  scene_.seed = 2;
  draw_random_parts(scene_);
  const bool same = strokes.size() == first.size() && strokes.back().min() == first.back().min() &&
                    strokes.front().min() == first.front().min();
  EXPECT_FALSE(same) << "another seed";
}

TEST_F(FrameRendererForeignLight, ForeignLightsInViewAreListedAsOtherLightsNotLamps) {
  scene_.clutter.foreign_lights = {
      {{{0.3, 0, 1.6}, make_disc_lamp_shape(0.12), 1e9, 1}, SquareWave{500, 0.3, 0}, {}},
      {{{-0.3, 0, 1.6}, make_disc_lamp_shape(0.12), 1e9, 1}, RectifiedSine{100, 1, 0}, {}},
      {{{5, 0, 1.6}, make_disc_lamp_shape(0.12), 1e9, 1}, RectifiedSine{100, 1, 0}, {}}};
  const FrameRenderer renderer(scene_);
  const auto lights = list_true_lights(scene_, renderer, shot());
  ASSERT_EQ(lights.size(), 2U) << "the third is out of view";
  EXPECT_EQ(lights[0].kind, "pwm");
  EXPECT_EQ(lights[1].kind, "mains");
  EXPECT_FALSE(lights[0].lamp);
  EXPECT_NEAR(lights[0].pixel.x(), 499.5, 1e-6);
  EXPECT_EQ(lights[0].visible_fraction, 1);
  EXPECT_EQ(list_true_lamps(scene_, renderer, shot()).size(), 1U);
  EXPECT_EQ(make_lamp_map(scene_, true).lamps.size(), 1U);
}

TEST_F(FrameRendererForeignLight, WriteTruthTablesListsForeignLightAndMirrorImage) {
  CaptureSet set{"check", 5e-5, LampShots{}, {}};
  set.lamps->heights_m = {0.1};
  set.lamps->pivots_m = {Eigen::Vector2d::Zero()};
  set.lamps->yaws_rad = {0};
  set.lamps->yaw_jitter_rad = set.lamps->turn_rate_rad_per_s = 0;
  set.lamps->repeat = 1;
  set.lamps->interval_s = 1;
  set.lamps->has_known_positions = false;
  const TemporaryFolder folder;
  write_truth_tables(scene_, FrameRenderer(scene_), set, folder / "");
  EXPECT_FALSE(std::filesystem::exists(folder / "true_other_lights.csv")) << "there are none";
  scene_.clutter.foreign_lights = {
      {{{0.3, 0, 1.6}, make_disc_lamp_shape(0.12), 1e9, 1}, SquareWave{500, 0.3, 0}, {}}};
  scene_.clutter.mirrors = {{{{0.4, -1, 0}, {0, 2, 0}, {0, 0, 1.7}, 0}, 0.2}};
  write_truth_tables(scene_, FrameRenderer(scene_), set, folder / "");
  const std::string table = TemporaryFolder::read_content(folder / "true_other_lights.csv");
  EXPECT_EQ(table,
            "image,kind,lamp,u_px,v_px,in_view\n"
            "0000.png,mirror_image,1,666.166667,299.500000,1\n"
            "0000.png,pwm,,499.500000,299.500000,1\n");
}

TEST(MakeLampShot, ForeignLightPhasesDoNotChangeOtherRandomValues) {
  Scene scene = plain_scene();
  scene.lamps[0].phase.reset();
  CaptureSet set{"check", 5e-5, LampShots{}, {}};
  set.lamps->heights_m = {0.1};
  set.lamps->pivots_m = {Eigen::Vector2d::Zero()};
  set.lamps->yaws_rad = {0};
  set.lamps->yaw_jitter_rad = set.lamps->turn_rate_rad_per_s = 0;
  set.lamps->repeat = 3;
  set.lamps->interval_s = 0.25;
  const LampShot without = make_lamp_shot(scene, set, 1);
  scene.clutter.foreign_lights = {
      {{{0.3, 0, 1.6}, make_disc_lamp_shape(0.12), 1e9, 1}, SquareWave{500, 0.3, 0}, {}},
      {{{0, 0.3, 1.6}, make_disc_lamp_shape(0.12), 1e9, 1}, RectifiedSine{101, 1, 0}, 0.5}};
  scene.clutter.ambient_flicker = RectifiedSine{100, 0.5, 0};
  const LampShot with = make_lamp_shot(scene, set, 1), next = make_lamp_shot(scene, set, 2);
  EXPECT_EQ(with.waves.at(0).phase, without.waves.at(0).phase);
  EXPECT_EQ(with.noise_seed, without.noise_seed);
  ASSERT_EQ(with.foreign_waves.size(), 2U);
  const auto phase = [](const LightWave& wave) {
    return std::visit([](const auto& each) { return each.phase; }, wave);
  };
  EXPECT_NE(phase(with.foreign_waves[0]), phase(next.foreign_waves.at(0)));
  EXPECT_NE(with.ambient_phase, next.ambient_phase);
  EXPECT_NEAR(phase(with.foreign_waves[1]), 0.75, 1e-9) << "0.5 + 101 Hz of 0.25 s";
}

}  // namespace
}  // namespace vlp
