// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Panes that reflect lamps.
#include "simulation/scene.h"

#include <gtest/gtest.h>

#include <cmath>

#include "simulation/plain_scene.h"
#include "simulation/truth.h"

namespace vlp {
namespace {

/// A level pinhole camera of f = 500 px, 1.5 m below the lamp: 1 cm is 3.33 px. A vertical pane 0.4
/// m from both towards x, high enough for the whole image, reflects a fifth.
class FrameRendererMirror : public testing::Test {
 protected:
  FrameRendererMirror() {
    scene_.camera = pinhole_camera();
    scene_.clutter.mirrors = {{{{0.4, -1, 0}, {0, 2, 0}, {0, 0, 1.7}, 0}, 0.2}};
  }

  Panel& pane() { return scene_.clutter.mirrors[0].pane; }
  cv::Mat1f rendered(double duty = 1, double phase = 0) const {
    const FrameRenderer renderer(scene_);
    LampShot shot = shot_at(scene_, {0, 0, 0.1}, 0);
    for (SquareWave& wave : shot.waves) wave = {wave.frequency_hz, duty, phase};
    return renderer.render_lamps(shot);
  }
  /// Returns the part of the image in which the pane appears.
  static cv::Mat1f behind_pane(const cv::Mat1f& image) {
    cv::Mat1f part = image.clone();
    part.colRange(0, 480) = 0;
    return part;
  }
  std::vector<TrueOtherLight> truth() const {
    const FrameRenderer renderer(scene_);
    return list_true_lights(scene_, renderer, shot_at(scene_, {0, 0, 0.1}, 0));
  }
  Scene scene_ = plain_scene();
};

TEST(MakeReflectionTransform, MovesPointByTwiceItsDistanceFromPanel) {
  const Eigen::Isometry3d reflection =
      make_reflection_transform({{0.4, 5, 0}, {0, 2, 0}, {0, 0, 3}, 0});
  EXPECT_LT((reflection * Eigen::Vector3d(0.1, 2, 3) - Eigen::Vector3d(0.7, 2, 3)).norm(), 1e-12);
  EXPECT_NEAR(reflection.linear().determinant(), -1, 1e-12);
  const Eigen::Isometry3d slanted =
      make_reflection_transform({{1, 0, 0}, {-1, 1, 0}, {0, 0, 1}, 0});
  EXPECT_LT((slanted * Eigen::Vector3d::Zero() - Eigen::Vector3d(1, 1, 0)).norm(), 1e-12);
}

TEST_F(FrameRendererMirror, MirrorImageHasMirroredPositionAndLightTimesReflectance) {
  // The mirror image of the lamp over the camera is 0.8 m aside: 266.7 px.
  const Brightness lamp = measure_brightness(cv::Mat1f(rendered().colRange(0, 480)));
  const Brightness image = measure_brightness(behind_pane(rendered()));
  ASSERT_GT(image.sum, 0);
  EXPECT_NEAR(image.centroid_px.x(), 399.5 + 500 * 0.8 / 1.5, 0.01);
  EXPECT_NEAR(image.centroid_px.y(), 299.5, 0.001);
  EXPECT_NEAR(image.sum / lamp.sum, 0.2, 1e-4);
  EXPECT_NEAR(rendered()(299, 666), 0.2 * 5e4, 1);
}

TEST_F(FrameRendererMirror, MirrorImageFlickersInPhaseWithLamp) {
  const cv::Mat1f always = rendered(), switched = rendered(0.4, 0.3);
  bool dark = false, lit = false;
  for (int line = 280; line < 320; ++line) {
    const double fraction = switched(line, 399) / always(line, 399);
    EXPECT_NEAR(switched(line, 666) / always(line, 666), fraction, 1e-5);
    dark = dark || fraction < 0.1;
    lit = lit || fraction > 0.9;
  }
  EXPECT_TRUE(dark && lit);
}

TEST_F(FrameRendererMirror, MirrorImageIsCutAtBorderOfPane) {
  // The rays to the mirror image cross the plane of the pane half way up, at 0.85 m, from y = -4.5
  // to 4.5 cm: a pane from y = 0 reflects half of it.
  pane() = {{0.4, 0, 0}, {0, 1, 0}, {0, 0, 1.7}, 0};
  const Brightness half = measure_brightness(behind_pane(rendered()));
  const auto lights = truth();
  pane() = {{0.4, -1, 0}, {0, 2, 0}, {0, 0, 1.7}, 0};
  EXPECT_NEAR(half.sum / measure_brightness(behind_pane(rendered())).sum, 0.5, 0.002);
  EXPECT_NEAR(half.centroid_px.y() - 299.5, 4 * 30 / (3 * M_PI), 0.2);
  ASSERT_EQ(lights.size(), 1U);
  EXPECT_NEAR(lights[0].visible_fraction, 0.5, 0.02);
  pane() = {{0.4, -1, 0}, {0, 2, 0}, {0, 0, 0.7}, 0};
  EXPECT_EQ(measure_brightness(behind_pane(rendered())).sum, 0) << "below the rays";
  EXPECT_TRUE(truth().empty());
}

TEST_F(FrameRendererMirror, LampBehindPaneHasNoMirrorImage) {
  // Its mirror image would be before the pane, in line with the upper part of the pane.
  pane() = {{0.4, -1, 0}, {0, 2, 0}, {0, 0, 4}, 0};
  scene_.lamps[0].glow.position_m.x() = 0.6;
  const cv::Mat1f with = rendered();
  ASSERT_GT(measure_brightness(with).sum, 0);
  EXPECT_TRUE(truth().empty());
  scene_.clutter.mirrors.clear();
  EXPECT_EQ(cv::norm(with, rendered(), cv::NORM_INF), 0);
}

TEST_F(FrameRendererMirror, MirrorImageHasMirroredDarkSideOfRecess) {
  const double dark_azimuth_rad = 0.3;
  scene_.lamps[0].glow.recess = Recess{0.05, 0.04, 0.2, DarkSide{0.02, dark_azimuth_rad}};
  const cv::Mat1f image = behind_pane(rendered());
  // Equivalent to a lamp 0.8 m aside with the dark side mirrored.
  scene_.clutter.mirrors.clear();
  scene_.lamps[0].glow.position_m.x() = 0.8;
  scene_.lamps[0].glow.recess->dark_side->azimuth_rad = M_PI - dark_azimuth_rad;
  const cv::Mat1f moved = behind_pane(rendered());
  ASSERT_GT(measure_brightness(image).sum, 0);
  EXPECT_LT(cv::norm(image, cv::Mat1f(0.2 * moved), cv::NORM_INF), 0.01);
}

TEST_F(FrameRendererMirror, GlossyCeilingReflectsDiscButNotRecessedLamp) {
  // A glossy ceiling 20 cm above the lamp: its mirror image is at 1.8 + 0.2 m, 1.9 m above.
  scene_.clutter.mirrors = {{{{-1, -1, 1.8}, {2, 0, 0}, {0, 2, 0}, 0}, 0.2}};
  scene_.lamps[0].glow.position_m.x() = 0.5;
  const double u_px = 399.5 + 500 * 0.5 / 1.9;
  const auto lights = truth();
  ASSERT_EQ(lights.size(), 1U);
  EXPECT_NEAR(lights[0].pixel.x(), u_px, 1e-6);
  EXPECT_NEAR(rendered()(299, int(std::lround(u_px))), 0.2 * 5e4, 1);
  scene_.lamps[0].glow.recess = Recess{0.05, 0.04, 0.2, {}};
  EXPECT_EQ(rendered()(299, int(std::lround(u_px)) - 10), 0);
}

TEST_F(FrameRendererMirror, MirrorImageIsListedAsOtherLightNotAsLamp) {
  const auto lights = truth();
  ASSERT_EQ(lights.size(), 1U);
  EXPECT_EQ(lights[0].kind, "mirror_image");
  EXPECT_EQ(lights[0].lamp, 1);
  EXPECT_LT((lights[0].pixel - Eigen::Vector2d(399.5 + 500 * 0.8 / 1.5, 299.5)).norm(), 1e-6);
  EXPECT_EQ(lights[0].visible_fraction, 1);
  const FrameRenderer renderer(scene_);
  const auto lamps = list_true_lamps(scene_, renderer, shot_at(scene_, {0, 0, 0.1}, 0));
  ASSERT_EQ(lamps.size(), 1U);
  EXPECT_NEAR(lamps[0].pixel.x(), 399.5, 1e-6);
}

}  // namespace
}  // namespace vlp
