// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Lamps deep in a reflector, and the ceiling around them.
#include "simulation/downlight.h"

#include <gtest/gtest.h>

#include <cmath>

#include "simulation/plain_scene.h"
#include "simulation/truth.h"

namespace vlp {
namespace {

/// A level pinhole camera of f = 500 px, 1.5 m below the lamp, whose rim has a radius of 9 cm:
/// 1 cm is 3.33 px, and a lit pixel 50,000 electrons.
class FrameRendererDownlight : public testing::Test {
 protected:
  FrameRendererDownlight() { scene_.camera = pinhole_camera(); }

  Glow& glow() { return scene_.lamps[0].glow; }
  cv::Mat1f rendered(const Eigen::Vector3d& eye_m = {0, 0, 0.1}, double duty = 1) const {
    const FrameRenderer renderer(scene_);
    LampShot shot = shot_at(scene_, eye_m, 0);
    shot.waves[0].duty = duty;
    return renderer.render_lamps(shot);
  }
  /// Returns the intersection of a pixel's ray with the rim's plane, from the lamp, for a camera
  /// straight below.
  static Eigen::Vector2d at_m(int u, int v) {
    return Eigen::Vector2d(u - 399.5, v - 299.5) / 500 * 1.5;
  }
  Eigen::Vector2d projected(const Eigen::Vector3d& point_m, const LampShot& shot) const {
    const Lens lens(scene_.camera.lens_model, scene_.camera.intrinsics);
    return lens.project_point(shot.motion.world_from_camera(0).inverse() * point_m).value();
  }

  static constexpr double kRadiusM = 0.09, kFull = 5e4;
  Scene scene_ = plain_scene();
};

TEST_F(FrameRendererDownlight, RecessRendersAsDiscWhenWallsEqualSource) {
  const Eigen::Vector3d eye_m(0.21, -0.4, 0.1);
  const cv::Mat1f disc = rendered(eye_m);
  ASSERT_GT(measure_brightness(disc).sum, 0);
  glow().recess = Recess{0.05, 0.03, 1, {}};
  EXPECT_LT(cv::norm(rendered(eye_m), disc, cv::NORM_INF), 1e-6 * kFull) << "rim and all";
}

TEST_F(FrameRendererDownlight, SourceIsShiftedByRecessDepthTimesRaySlope) {
  glow().recess = Recess{0.05, 0.02, 0, {}};
  const Eigen::Vector3d eye_m(0.31, -0.155, 0.1);
  const Eigen::Vector3d slope(-0.2, 0.1, 0);  // of the ray to the source, 1.55 m above
  const LampShot shot = shot_at(scene_, eye_m, 0);
  const Eigen::Vector2d core_px = measure_brightness(rendered(eye_m)).centroid_px;
  const Eigen::Vector2d rim_px = projected(glow().position_m, shot);
  EXPECT_LT((core_px - projected(glow().position_m - 0.05 * slope, shot)).norm(), 0.002);
  EXPECT_NEAR((core_px - rim_px).norm(), 0.05 * slope.norm() / 1.5 * 500, 0.002);
  const FrameRenderer renderer(scene_);
  EXPECT_LT((list_true_lamps(scene_, renderer, shot).at(0).pixel - rim_px).norm(), 1e-6)
      << "the truth is the rim's center";
}

TEST_F(FrameRendererDownlight, BrightnessIsHalfAtEdgeOfSourceDiameter) {
  glow().recess = Recess{0, 0.06, 0, {}};
  const cv::Mat1f image = rendered({0.0015, 0.0015, 0.1});  // the lamp is at (399, 299)
  EXPECT_NEAR(image(299, 399) / kFull, 1, 1e-6);
  EXPECT_NEAR(image(299, 409) / kFull, 0.5, 1e-6) << "3 cm are 10 px";
}

TEST_F(FrameRendererDownlight, BrightnessMatchesRecessEquationSeenFromBelow) {
  glow().recess = Recess{0.06, 0.05, 0.1, DarkSide{0.02, M_PI}};
  const cv::Mat1f image = rendered();
  for (const cv::Point& at : {cv::Point(399, 299), cv::Point(405, 310), cv::Point(375, 299),
                              cv::Point(424, 299), cv::Point(400, 272)}) {
    const Eigen::Vector2d p = at_m(at.x, at.y);
    const Eigen::Vector2d q = p * (1 + 0.06 / 1.5);
    const double wall = 0.1 + (0.02 - 0.1) * (1 - p.x() / kRadiusM) / 2;
    const double ratio = q.norm() / 0.025;
    const double expected = wall + (1 - wall) * std::pow(2, -ratio * ratio);
    EXPECT_NEAR(image(at) / kFull, expected, 1e-4) << at;
  }
  EXPECT_LT(image(299, 373), 0.3 * image(299, 426)) << "dark towards -x";
}

TEST_F(FrameRendererDownlight, HaloDecaysExponentiallyOutsideRim) {
  const cv::Mat1f without = rendered();
  glow().halo = Halo{0.02, 0.03};
  const cv::Mat1f image = rendered();
  for (const cv::Point& at : {cv::Point(432, 299), cv::Point(399, 345), cv::Point(340, 260)}) {
    const double lengths = (at_m(at.x, at.y).norm() - kRadiusM) / 0.03;
    EXPECT_NEAR(image(at) / kFull, 0.02 * std::exp(-lengths), 1e-6) << at;
  }
  EXPECT_EQ(image(299, 399), without(299, 399)) << "not inside the rim";
  EXPECT_EQ(image(299, 399 + 30 + 82), 0) << "8 lengths are 80 px";
  EXPECT_GT(image(299, 399 + 30 + 78), 0);
  EXPECT_NEAR(compute_source_radius_m(glow()), 0.09 + 0.24, 1e-12);
}

TEST_F(FrameRendererDownlight, HaloAndRecessFlickerInPhaseWithLamp) {
  glow().recess = Recess{0.05, 0.04, 0.1, {}};
  glow().halo = Halo{0.02, 0.03};
  const cv::Mat1f always = rendered(), switched = rendered({0, 0, 0.1}, 0.5);
  bool dark = false, lit = false;
  for (int line = 285; line < 315; ++line) {
    const double fraction = switched(line, 399) / always(line, 399);
    EXPECT_NEAR(switched(line, 380) / always(line, 380), fraction, 1e-5);
    EXPECT_NEAR(switched(line, 440) / always(line, 440), fraction, 1e-5) << "on the ceiling";
    dark = dark || fraction < 0.1;
    lit = lit || fraction > 0.9;
  }
  EXPECT_TRUE(dark && lit);
}

TEST_F(FrameRendererDownlight, LedChipsAddGaussianBrightnessAtGivenPitchInsideRim) {
  const Eigen::Vector3d eye_m(0.0015, 0.0015, 0.1);  // the lamp is at (399, 299)
  const cv::Mat1f even = rendered(eye_m);
  glow().chips = Chips{0.4, 0.03, 0.015};
  const cv::Mat1f image = rendered(eye_m);
  const auto more = [&](int u, int v) { return (image(v, u) - even(v, u)) / kFull; };
  EXPECT_NEAR(more(399, 299), 0.4, 1e-4);
  EXPECT_NEAR(more(409, 299), 0.4, 1e-4) << "the next one, 3 cm aside";
  EXPECT_NEAR(more(399, 279), 0.4, 1e-4);
  EXPECT_NEAR(more(404, 299), 0.4 * 2 * std::pow(2, -4), 1e-4) << "between two";
  EXPECT_NEAR(more(404, 304), 0.4 * 4 * std::pow(2, -8), 1e-4) << "between four";
  EXPECT_NEAR(more(439, 299), 0, 1e-6) << "no chip beyond the rim";
  for (int v = 0; v < image.rows; v += 3) {
    for (int u = 0; u < image.cols; u += 3) {
      if (even(v, u) == 0) {
        EXPECT_EQ(image(v, u), 0);
      }
    }
  }
}

TEST_F(FrameRendererDownlight, BrightnessMatchesRecessEquationInObliqueView) {
  Recess recess{0.06, 0.03, 0.1, {}};
  recess.source_power = 1.5;
  recess.rim_power = 3;
  recess.beam_power = 4;
  recess.far_side_slope = 0.2;
  glow().recess = recess;
  const Eigen::Vector3d eye_m(0.9, 0.3, 0.1);
  const cv::Mat1f image = rendered(eye_m);
  int inside = 0;
  for (double x_m = -0.06; x_m < 0.09; x_m += 0.03) {
    for (const double y_m : {-0.04, 0.0, 0.05}) {
      const Eigen::Vector2d pixel =
          projected(glow().position_m + Eigen::Vector3d(x_m, y_m, 0), shot_at(scene_, eye_m, 0));
      const cv::Point at(int(std::lround(pixel.x())), int(std::lround(pixel.y())));
      // Intersection of that pixel's ray with the rim's plane, from the lamp.
      const Eigen::Vector2d p = at_m(at.x, at.y) + eye_m.head<2>();
      const Eigen::Vector2d s = at_m(at.x, at.y) / 1.5;
      if (p.norm() > kRadiusM - 0.006) continue;
      const double cos_b = p.dot(s) / (p.norm() * s.norm());
      const double w = 0.1 * std::pow(p.norm() / kRadiusM, 3) *
                       std::exp2(-(1 + cos_b * p.norm() / kRadiusM) * s.norm() / (2 * 0.2));
      const double ratio = (p + 0.06 * s).norm() / 0.015;
      const double source =
          std::pow(std::cos(std::atan(s.norm())), 4) * std::exp2(-std::pow(ratio, 1.5));
      EXPECT_NEAR(image(at) / kFull, w + (1 - w) * source, 2e-5) << at;
      ++inside;
    }
  }
  EXPECT_GE(inside, 8);
}

TEST_F(FrameRendererDownlight, RendersCrescentAtNearRimWhenRimHidesSource) {
  glow().recess = Recess{0.2, 0.05, 0, {}};
  const Eigen::Vector3d eye_m(0.75, 0, 0.1);  // the source is 0.1 m beyond the rim's center
  const Eigen::Vector2d rim_px = projected(glow().position_m, shot_at(scene_, eye_m, 0));
  const Brightness crescent = measure_brightness(rendered(eye_m));
  ASSERT_GT(crescent.sum, 0);
  EXPECT_GT(crescent.centroid_px.x() - rim_px.x(), 0.75 * 30) << "at the near rim, 30 px away";
  EXPECT_LT(crescent.centroid_px.x() - rim_px.x(), 30);
  EXPECT_NEAR(crescent.centroid_px.y(), rim_px.y(), 0.01);
  const FrameRenderer renderer(scene_);
  const auto lamps = list_true_lamps(scene_, renderer, shot_at(scene_, eye_m, 0));
  ASSERT_EQ(lamps.size(), 1U);
  EXPECT_LT((lamps[0].pixel - rim_px).norm(), 1e-6) << "the truth is the rim's center";
}

TEST_F(FrameRendererDownlight, HotSpotsAddGaussianBrightnessInsideRim) {
  const Eigen::Vector3d eye_m(0.0015, 0.0015, 0.1);  // the lamp is at (399, 299)
  const cv::Mat1f even = rendered(eye_m);
  glow().hot_spots = {{{0.03, 0}, 0.012, 0.5}, {{-0.03, 0.03}, 0.009, 0.8}};
  const cv::Mat1f image = rendered(eye_m);
  const auto more = [&](int u, int v) { return (image(v, u) - even(v, u)) / kFull; };
  EXPECT_NEAR(more(409, 299), 0.5, 1e-5);
  EXPECT_NEAR(more(389, 309), 0.8, 1e-5);
  EXPECT_NEAR(more(413, 299), 0.5 * std::exp(-0.5), 1e-5) << "sigma is 4 px";
  EXPECT_NEAR(more(389, 315), 0.8 * std::exp(-2.0), 1e-5) << "twice 3 px";
  EXPECT_EQ(more(435, 299), 0) << "beyond the rim";
}

TEST(DrawRandomParts, DrawsHotSpotsWithinBoundsBySeedAndLampId) {
  Scene scene = plain_scene();
  scene.lamps.push_back(scene.lamps[0]);
  scene.lamps[1].id = 2;
  for (SceneLamp& lamp : scene.lamps) lamp.glow.random_chips = RandomChips{7, 0.12, 0.75, 0.3, 0.8};
  draw_random_parts(scene);
  const auto spots = scene.lamps[0].glow.hot_spots;
  ASSERT_EQ(spots.size(), 7U);
  for (const HotSpot& spot : spots) {
    EXPECT_LE(spot.center_m.norm(), 0.75 * 0.09);
    EXPECT_NEAR(spot.sigma_m, 0.12 * 0.09, 1e-12);
    EXPECT_GE(spot.excess, 0.3);
    EXPECT_LE(spot.excess, 0.8);
  }
  EXPECT_NE(scene.lamps[1].glow.hot_spots.at(0).center_m, spots[0].center_m) << "another lamp";
  Scene again = scene;
  draw_random_parts(again);
  EXPECT_EQ(again.lamps[0].glow.hot_spots.at(6).center_m, spots[6].center_m) << "the same seed";
  again.lamps = {scene.lamps[1], scene.lamps[0]};
  draw_random_parts(again);
  EXPECT_EQ(again.lamps[1].glow.hot_spots.at(0).center_m, spots[0].center_m) << "by its id";
  again.seed = 2;
  draw_random_parts(again);
  ASSERT_EQ(again.lamps[1].glow.hot_spots.size(), 7U);
  EXPECT_NE(again.lamps[1].glow.hot_spots[0].center_m, spots[0].center_m) << "another seed";
}

TEST_F(FrameRendererDownlight, OccluderHidesSteadyDownlight) {
  scene_.lamps[0].glow.electron_rate_e_per_s = 0;
  scene_.clutter.steady_lamps = {{{0, 0, 1.6},
                                  make_disc_lamp_shape(0.18),
                                  1e9,
                                  0,
                                  Recess{0.05, 0.04, 0.2, {}},
                                  Halo{0.1, 0.02}}};
  const cv::Mat1f open = rendered();
  scene_.clutter.occluders = {{{-0.2, -0.2, 0.85}, {0.2, 0, 0}, {0, 0.4, 0}, 0}};
  const cv::Mat1f image = rendered();
  for (const int v : {270, 299, 335}) {
    EXPECT_EQ(image(v, 390), 0);
    EXPECT_GT(open(v, 390), 0);
    EXPECT_FLOAT_EQ(image(v, 410), open(v, 410));
  }
}

}  // namespace
}  // namespace vlp
