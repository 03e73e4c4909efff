// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Rendered panels and tubes against mrcal's projection of them.
#include <gtest/gtest.h>

#include <string>

#include "geometry/angles.h"
#include "simulation/exposure.h"
#include "simulation/plain_scene.h"
#include "simulation/truth.h"
#include "support/mrcal_oracle.h"

namespace vlp {
namespace {

/// Rotated panel and tube, with a camera tilted by two degrees.
class FrameRendererRectangle : public testing::TestWithParam<LampShape> {
 protected:
  FrameRendererRectangle() {
    scene_.mount.level_from_camera =
        level_rotation_from_inclination({rad_from_deg(2), rad_from_deg(-1)});
    scene_.lamps[0].glow.shape = GetParam();
  }
  std::vector<Eigen::Vector2d> projected(const LampShot& shot,
                                         const std::vector<Eigen::Vector3d>& points_m) const {
    const MrcalOracle mrcal(std::string(lens_model_name(scene_.camera.lens_model)),
                            scene_.camera.intrinsics);
    const Eigen::Isometry3d camera_from_world = shot.motion.world_from_camera(0).inverse();
    std::vector<Eigen::Vector3d> rays;
    for (const Eigen::Vector3d& point_m : points_m) rays.push_back(camera_from_world * point_m);
    return mrcal.project(rays);
  }

  Scene scene_ = plain_scene();
};

TEST_P(FrameRendererRectangle, RectangleCoversItsProjectedOutline) {
  constexpr int per_side = 4000;
  const FrameRenderer renderer(scene_);
  const Glow& glow = scene_.lamps[0].glow;
  // Computed independently of the renderer.
  const Eigen::Vector2d size_m = *GetParam().size_m;  // Clang 14 captures no binding
  const double yaw_rad = GetParam().yaw_rad;
  const Eigen::Vector3d along(std::cos(yaw_rad), std::sin(yaw_rad), 0);
  const Eigen::Vector3d across(-along.y(), along.x(), 0);
  const auto corner = [&](double a, double b) {
    return Eigen::Vector3d(glow.position_m + a * size_m.x() / 2 * along +
                           b * size_m.y() / 2 * across);
  };
  const std::vector<Eigen::Vector3d> corners_m = {corner(-1, -1), corner(1, -1), corner(1, 1),
                                                  corner(-1, 1)};
  for (const Eigen::Vector3d& eye_m :
       {Eigen::Vector3d(0, 0, 0), {0.35, -0.2, 0.1}, {-0.3, 0.25, -0.2}}) {
    const LampShot shot = shot_at(scene_, eye_m, 0.4);
    std::vector<Eigen::Vector3d> sides_m;
    for (std::size_t i = 0; i < 4; ++i) {
      for (int j = 0; j < per_side; ++j) {
        sides_m.push_back(corners_m[i] +
                          (corners_m[(i + 1) % 4] - corners_m[i]) * (double(j) / per_side));
      }
    }
    const auto outline = projected(shot, sides_m);
    double twice_area = 0;
    Eigen::Vector2d moment(0, 0);
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const Eigen::Vector2d &p = outline[i], &q = outline[(i + 1) % outline.size()];
      ASSERT_TRUE(p.minCoeff() > 0 && p.x() < 799 && p.y() < 599) << "wholly in the image";
      twice_area += cross_product_2d(p, q);
      moment += cross_product_2d(p, q) * (p + q) / 3;
    }
    const cv::Mat1f image(simulate_sensor_image(scene_.sensor, renderer.render_lamps(shot), 1));
    const Brightness rendered = measure_brightness(image);
    EXPECT_LT((rendered.centroid_px - moment / twice_area).norm(), 0.001);
    const double level = glow.electron_rate_e_per_s * shot.exposure_s;
    EXPECT_NEAR(rendered.sum / level / std::abs(twice_area / 2), 1, 1e-4);

    const auto corners_px = projected(shot, corners_m);
    for (std::size_t i = 0; i < 4; ++i) {
      // Two pixels from both sides, and as far beyond them.
      const auto towards = [&](std::size_t other) {
        return Eigen::Vector2d((corners_px[other % 4] - corners_px[i]).normalized());
      };
      const Eigen::Vector2d inwards = 2 * (towards(i + 1) + towards(i + 3));
      const auto level_at = [&](const Eigen::Vector2d& at) {
        return double(image(int(std::lround(at.y())), int(std::lround(at.x()))));
      };
      EXPECT_NEAR(level_at(corners_px[i] + inwards), level, 0.01 * level);
      EXPECT_EQ(level_at(corners_px[i] - inwards), 0);
    }
  }
}

TEST_P(FrameRendererRectangle, TrueLampPixelIsProjectedRectangleCenter) {
  const FrameRenderer renderer(scene_);
  const LampShot shot = shot_at(scene_, {0.35, -0.2, 0.1}, 0.4);
  const auto truth = list_true_lamps(scene_, renderer, shot);
  ASSERT_EQ(truth.size(), 1U);
  EXPECT_EQ(truth[0].visible_fraction, 1);
  const auto center = projected(shot, {scene_.lamps[0].glow.position_m})[0];
  EXPECT_LT((truth[0].pixel - center).norm(), 1e-6);
}

TEST_P(FrameRendererRectangle, VisibleFractionIsBetweenZeroAndOneAtImageEdge) {
  const FrameRenderer renderer(scene_);
  const LampShot shot = shot_at(scene_, {1.2, 0, 0.1}, 0);
  const auto truth = list_true_lamps(scene_, renderer, shot);
  ASSERT_EQ(truth.size(), 1U);
  EXPECT_GT(truth[0].visible_fraction, 0);
  EXPECT_LT(truth[0].visible_fraction, 1);
}

INSTANTIATE_TEST_SUITE_P(
    Shapes, FrameRendererRectangle,
    testing::Values(LampShape{ShapeKind::rectangle, Eigen::Vector2d(0.5, 0.4), 0.3},
                    LampShape{ShapeKind::rectangle, Eigen::Vector2d(0.7, 0.08), -0.6}),
    [](const auto& instance) { return instance.index == 0 ? "Panel" : "Tube"; });

}  // namespace
}  // namespace vlp
