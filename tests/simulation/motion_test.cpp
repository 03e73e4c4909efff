// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Lamps and boards that move during the readout.
#include <gtest/gtest.h>

#include "geometry/angles.h"
#include "simulation/plain_scene.h"
#include "simulation/truth.h"

namespace vlp {
namespace {

/// Returns the centroid of each line, beginning with `first`.
std::vector<double> middles(const cv::Mat1f& image, int first, int count) {
  std::vector<double> middles;
  for (int line = first; line < first + count; ++line) {
    const Brightness row = measure_brightness(image.row(line));
    middles.push_back(row.centroid_px.x());
  }
  return middles;
}

double fit_slope(const std::vector<double>& values) {
  const auto count = static_cast<double>(values.size());
  double moment = 0, square = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double at = double(i) - (count - 1) / 2;
    moment += at * values[i];
    square += at * at;
  }
  return moment / square;
}

TEST(FrameRendererMotion, DiscSkewIsRowTimeTimesImageSpeed) {
  Scene scene = plain_scene();
  scene.camera = pinhole_camera();
  scene.lamps[0].glow.shape = make_disc_lamp_shape(0.3);  // 100 px
  const FrameRenderer renderer(scene);
  LampShot shot = shot_at(scene, {0, 0, 0.1}, 0);
  ASSERT_NEAR(fit_slope(middles(renderer.render_lamps(shot), 260, 80)), 0, 1e-6);
  for (const double speed_m_per_s : {0.04, 1.0, -3.0}) {
    shot.motion.velocity_m_per_s = {speed_m_per_s, 0};
    // The lamp moves in the opposite direction, by f / H = 500 / 1.5 pixels per meter.
    const double expected = -speed_m_per_s * 3e-5 * 500 / 1.5;
    EXPECT_NEAR(fit_slope(middles(renderer.render_lamps(shot), 260, 80)) / expected, 1, 0.01);
  }
}

TEST(FrameRendererMotion, DiscSkewMatchesRowTimeTimesYawRate) {
  Scene scene = plain_scene();
  scene.camera = pinhole_camera();
  scene.lamps[0].glow.shape = make_disc_lamp_shape(0.3);
  scene.lamps[0].glow.position_m = {0, 0.3, 1.6};  // 100 px below the middle
  const FrameRenderer renderer(scene);
  LampShot shot = shot_at(scene, {0, 0, 0.1}, 0);
  shot.motion.turn_rate_rad_per_s = rad_from_deg(90);
  // In the level camera the lamp turns clockwise: at 100 px below the middle it moves by + 100 px
  // a radian along x; the lines between 60 and 140 below differ in both, to first order by
  // (row - 0) rate (time of the row).
  const auto at = middles(renderer.render_lamps(shot), 360, 80);
  double expected = 0;
  {
    std::vector<double> theory;
    for (int line = 360; line < 440; ++line) {
      const double turned = rad_from_deg(90) * (line - 299.5) * 3e-5;
      theory.push_back(100 * std::sin(turned));
    }
    expected = fit_slope(theory);
  }
  EXPECT_NEAR(fit_slope(at) / expected, 1, 0.01);
}

TEST(FrameRendererMotion, TrueLampCenterMovesLikeRenderedCentroid) {
  Scene scene = plain_scene();
  scene.lamps[0].glow.shape = make_disc_lamp_shape(0.1);
  const FrameRenderer renderer(scene);
  for (const Eigen::Vector2d& velocity : {Eigen::Vector2d(2, 0), Eigen::Vector2d(-1, 2)}) {
    LampShot shot = shot_at(scene, {0.05, -0.4, 0.1}, 0.2);
    const auto offset = [&] {
      const Brightness brightness = measure_brightness(renderer.render_lamps(shot));
      return Eigen::Vector2d(brightness.centroid_px -
                             list_true_lamps(scene, renderer, shot).at(0).pixel);
    };
    const Eigen::Vector2d at_rest = offset();
    const Eigen::Vector2d center = list_true_lamps(scene, renderer, shot)[0].pixel;
    shot.motion.velocity_m_per_s = velocity;
    EXPECT_GT((list_true_lamps(scene, renderer, shot)[0].pixel - center).norm(), 1);
    EXPECT_LT((offset() - at_rest).norm(), 0.01);
  }
}

TEST(FrameRendererMotion, TotalLightIsProportionalToExposureWhileRotating) {
  Scene scene = plain_scene();
  scene.camera = pinhole_camera();
  scene.lamps[0].glow.position_m = {0.55, 0, 1.6};  // 183 px from the middle
  const FrameRenderer renderer(scene);
  LampShot shot = shot_at(scene, {0, 0, 0.1}, 0.33);
  const double at_rest = measure_brightness(renderer.render_lamps(shot)).sum;
  // Full rotation: lines are lit longer where the lamp moves with the readout, shorter where it
  // moves against it.
  shot.motion.turn_rate_rad_per_s = rad_from_deg(720);
  shot.exposure_s = 0.5;
  const double smeared = measure_brightness(renderer.render_lamps(shot)).sum;
  EXPECT_NEAR(smeared / at_rest, 0.5 / 5e-5, 0.5 / 5e-5 * 3e-3);
}

TEST(FrameRendererMotion, LampIsSmearedUniformlyOverFullRotation) {
  Scene scene = plain_scene();
  scene.camera = pinhole_camera();
  scene.lamps[0].glow.position_m = {0.5, 0, 1.6};
  const FrameRenderer renderer(scene);
  LampShot shot = shot_at(scene, {0, 0, 0.1}, 0);
  shot.exposure_s = 1;
  shot.motion.turn_rate_rad_per_s = rad_from_deg(360);
  const cv::Mat1f ring = renderer.render_lamps(shot);
  // The same light on all sides of the middle, 500 / 3 px from it.
  for (const cv::Point& at : {cv::Point(566, 300), cv::Point(233, 300), cv::Point(400, 133)}) {
    EXPECT_NEAR(ring(at) / ring(466, 400), 1, 0.02);
  }
}

TEST(FrameRendererMotion, SmearVarianceMatchesDisplacementDuringExposure) {
  Scene scene = plain_scene();
  scene.camera = pinhole_camera();
  LampShot shot = shot_at(scene, {0, 0, 0.1}, 0);
  shot.exposure_s = 0.01;
  const FrameRenderer renderer(scene);
  const auto variance = [&] {
    const cv::Mat1f image = renderer.render_lamps(shot);
    const Brightness brightness = measure_brightness(image);
    double sum = 0;
    for (int v = 0; v < image.rows; ++v) {
      for (int u = 0; u < image.cols; ++u) {
        sum += image(v, u) * std::pow(u - brightness.centroid_px.x(), 2);
      }
    }
    return sum / brightness.sum;
  };
  const double at_rest = variance();
  shot.motion.velocity_m_per_s = {3, 0};
  // 10 px in an exposure: a box adds 10^2 / 12. The skew of 0.03 px a row adds 0.03^2 times the
  // variance of the rows of a disc, radius^2 / 4, and the radius is 30 px.
  EXPECT_NEAR(variance() - at_rest, 100.0 / 12 + 0.0009 * 900 / 4, 0.03);
}

TEST(FrameRendererMotion, TotalLightAndCentroidOfBoardAreUnchangedByMotion) {
  Scene scene = plain_scene();
  scene.board = plain_board();
  scene.board->surround_e_per_s = 0;
  const FrameRenderer renderer(scene);
  BoardShot shot = make_board_shot(scene, board_views(1, 0.5, 0, 0, 0), 0);
  shot.exposure_s = 0.01;
  const Brightness at_rest = measure_brightness(renderer.render_board(shot));
  shot.velocity_in_camera_m_per_s = {0.01, 0, 0};
  const Brightness moving = measure_brightness(renderer.render_board(shot));
  EXPECT_NEAR(moving.sum / at_rest.sum, 1, 1e-4);
  EXPECT_LT((moving.centroid_px - at_rest.centroid_px).norm(), 0.02);
}

}  // namespace
}  // namespace vlp
