// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Lights other than lamps, and occluders.
#include <gtest/gtest.h>

#include <numbers>

#include "simulation/plain_scene.h"
#include "simulation/truth.h"

namespace vlp {
namespace {

/// A level pinhole camera of f = 500 px, 1.5 m below the lamp: 1 cm is 3.33 px.
class FrameRendererClutter : public testing::Test {
 protected:
  FrameRendererClutter() { scene_.camera = pinhole_camera(); }

  cv::Mat1f rendered(double duty = 1) {
    const FrameRenderer renderer(scene_);
    LampShot shot = shot_at(scene_, {0, 0, 0.1}, 0);
    for (SquareWave& wave : shot.waves) wave.duty = duty;
    return renderer.render_lamps(shot);
  }
  double in_view() {
    const FrameRenderer renderer(scene_);
    return list_true_lamps(scene_, renderer, shot_at(scene_, {0, 0, 0.1}, 0))
        .at(0)
        .visible_fraction;
  }
  Scene scene_ = plain_scene();
};

TEST_F(FrameRendererClutter, AmbientLightIsUniformOverImage) {
  scene_.lamps.clear();
  scene_.ambient_e_per_s = 2e7;
  const cv::Mat1f image = rendered();
  double darkest = 0, brightest = 0;
  cv::minMaxLoc(image, &darkest, &brightest);
  EXPECT_NEAR(darkest, 1000, 1e-2);
  EXPECT_NEAR(brightest, 1000, 1e-2);
}

TEST_F(FrameRendererClutter, VignettingIsGivenPowerOfCosineOfAngle) {
  scene_.lamps.clear();
  scene_.ambient_e_per_s = 2e7;
  scene_.optics.vignetting_power = 4;
  const cv::Mat1f image = rendered();
  for (const cv::Point& at : {cv::Point(0, 0), cv::Point(400, 300), cv::Point(799, 300)}) {
    const double tangent = std::hypot(at.x - 399.5, at.y - 299.5) / 500;
    EXPECT_NEAR(image(at) / 1000, 1 / std::pow(1 + tangent * tangent, 2), 1e-4);
  }
}

TEST_F(FrameRendererClutter, WindowIsRenderedAsRectangleOfItsRadiance) {
  scene_.lamps.clear();
  scene_.ambient_e_per_s = 1e6;
  scene_.clutter.windows = {{{0.3, 0.1, 1.6}, {0, 0.3, 0}, {0.15, 0, 0}, 5e7}};
  const cv::Mat1f image = rendered();
  EXPECT_NEAR(image(370, 520), 2500, 1e-2);
  EXPECT_NEAR(image(250, 520), 50, 1e-3);
  // 50 x 100 px of 2450 electrons more than the ceiling.
  EXPECT_NEAR(measure_brightness(cv::Mat1f(image - 50)).sum, 5000 * 2450, 5000 * 2450 * 1e-4);
}

TEST_F(FrameRendererClutter, ReflectionFlickersWithItsLampAndSteadyLampDoesNot) {
  scene_.clutter.steady_lamps = {{{-0.3, 0, 1.6}, make_disc_lamp_shape(0.12), 3e7, 1}};
  scene_.clutter.reflections = {{{{0.3, 0, 1.6}, make_disc_lamp_shape(0.12), 2e7, 0}, 0}};
  const cv::Mat1f always = rendered(), switched = rendered(0.5);
  for (int line = 285; line < 315; ++line) {
    EXPECT_EQ(switched(line, 300), always(line, 300));
    EXPECT_NEAR(switched(line, 500) / always(line, 500), switched(line, 400) / always(line, 400),
                1e-5);
  }
  EXPECT_NEAR(always(300, 300), 1500, 0.01);
  EXPECT_NEAR(always(300, 500), 1000, 2);
  EXPECT_LT(always(300, 517), 250) << "a reflection fades";
}

TEST_F(FrameRendererClutter, RectangularReflectionFadesParabolicallyTowardsItsSides) {
  const LampShape shape{ShapeKind::rectangle, Eigen::Vector2d(0.12, 0.06), std::numbers::pi / 2};
  const Glow glow{{0.3, 0, 1.6}, shape, 2e7, 0};
  scene_.lamps[0].glow.electron_rate_e_per_s = 0;
  scene_.clutter.reflections = {{glow, 0}};
  const cv::Mat1f image = rendered();
  // 20 px wide and 40 px high; a parabola keeps two thirds along each axis.
  EXPECT_NEAR(measure_brightness(image).sum, 800 * 1000 * 4 / 9.0, 1500);
  EXPECT_NEAR(image(299, 499), 1000, 4);
  EXPECT_NEAR(image(299, 504) / image(299, 499), 0.75, 0.06) << "half way to a long side";
  EXPECT_NEAR(image(309, 499) / image(299, 499), 0.75, 0.03) << "half way to a short side";
  EXPECT_LT(image(299, 508), 300);
  EXPECT_EQ(image(299, 512), 0);
  EXPECT_EQ(image(322, 499), 0);
}

TEST_F(FrameRendererClutter, OccluderHidesCoveredHalfOfLamp) {
  const double whole = measure_brightness(rendered()).sum;
  // From the lamp's middle to the left, half way up.
  scene_.clutter.occluders = {{{-0.2, -0.2, 0.85}, {0.2, 0, 0}, {0, 0.4, 0}, 0}};
  const Brightness half = measure_brightness(rendered());
  EXPECT_NEAR(half.sum / whole, 0.5, 0.002);
  // The centroid of half a disc of 30 px.
  EXPECT_NEAR(half.centroid_px.x() - 399.5, 4 * 30 / (3 * M_PI), 0.1);
  EXPECT_NEAR(in_view(), 0.5, 0.02);
}

TEST_F(FrameRendererClutter, OccluderReplacesCeilingRadiance) {
  scene_.lamps.clear();
  scene_.ambient_e_per_s = 1e7;
  scene_.clutter.occluders = {{{0.1, 0.1, 0.85}, {0.1, 0, 0}, {0, 0.1, 0}, 2e6}};
  const cv::Mat1f image = rendered();
  EXPECT_NEAR(image(400, 500), 100, 1e-3);
  EXPECT_NEAR(image(200, 500), 500, 1e-3);
}

TEST_F(FrameRendererClutter, VisibleFractionIsHalfForLampAtImageEdge) {
  scene_.lamps[0].glow.position_m.x() = 1.2;  // 400 px to the right
  EXPECT_NEAR(in_view(), 0.5, 0.02);
  scene_.lamps[0].glow.position_m.x() = 0;
  EXPECT_EQ(in_view(), 1);
}

}  // namespace
}  // namespace vlp
