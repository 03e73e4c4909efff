// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Rendered lamps against mrcal's projection of them.
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "geometry/angles.h"
#include "rig/calibration.h"
#include "simulation/exposure.h"
#include "simulation/plain_scene.h"
#include "simulation/truth.h"
#include "support/mrcal_oracle.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

Camera splined() {
  Camera camera = splined_camera();
  camera.row_time_s = 3e-5;
  camera.readout = Readout::rows;
  return camera;
}

struct LensCase {
  Camera camera;
  double tilt_rad, blur_px;
  const char* name;

  friend void PrintTo(const LensCase& lens_case, std::ostream* out) { *out << lens_case.name; }
};

class FrameRendererDisc : public testing::TestWithParam<LensCase> {
 protected:
  FrameRendererDisc() {
    scene_.camera = GetParam().camera;
    scene_.mount.level_from_camera =
        level_rotation_from_inclination({GetParam().tilt_rad, -GetParam().tilt_rad / 2});
    scene_.optics.blur_px = GetParam().blur_px;
  }

  /// Returns the image of a capture, with blur and quantization.
  cv::Mat1f render_image(const FrameRenderer& renderer, const LampShot& shot) const {
    const cv::Mat image = simulate_sensor_image(scene_.sensor, renderer.render_lamps(shot), 1);
    return cv::Mat1f(image);
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

  /// Returns captures with the lamp in all parts of the image, with its blur.
  std::vector<LampShot> shots(const FrameRenderer& renderer) const {
    std::vector<LampShot> shots;
    for (const double x_m : {-0.7, -0.31, 0.003, 0.45, 0.8}) {
      for (const double y_m : {-0.6, 0.0, 0.37}) {
        const LampShot shot = shot_at(scene_, {x_m, y_m, 0.1}, 0.3 + x_m);
        const auto lamps = list_true_lamps(scene_, renderer, shot);
        constexpr double radius_px = 40;
        const Eigen::AlignedBox2d inside(Eigen::Vector2d(radius_px, radius_px),
                                         Eigen::Vector2d(800 - radius_px, 600 - radius_px));
        if (!lamps.empty() && inside.contains(lamps[0].pixel)) shots.push_back(shot);
      }
    }
    EXPECT_GE(shots.size(), 9);
    return shots;
  }

  Scene scene_ = plain_scene();
};

TEST_P(FrameRendererDisc, CentroidAndTotalLightMatchProjectedOutline) {
  constexpr int rim_points = 20000;
  const FrameRenderer renderer(scene_);
  const Glow& glow = scene_.lamps[0].glow;
  for (const LampShot& shot : shots(renderer)) {
    std::vector<Eigen::Vector3d> rim_m;
    for (int i = 0; i < rim_points; ++i) {
      const double angle = 2 * std::numbers::pi * i / rim_points;
      rim_m.push_back(glow.position_m +
                      glow.glow_radius_m() * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0));
    }
    const auto outline = projected(shot, rim_m);
    // The centroid of a polygon.
    double twice_area = 0;
    Eigen::Vector2d moment(0, 0);
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const Eigen::Vector2d &p = outline[i], &q = outline[(i + 1) % outline.size()];
      twice_area += cross_product_2d(p, q);
      moment += cross_product_2d(p, q) * (p + q) / 3;
    }
    const Brightness rendered = measure_brightness(render_image(renderer, shot));
    EXPECT_LT((rendered.centroid_px - moment / twice_area).norm(), 0.001);
    const double level = glow.electron_rate_e_per_s * shot.exposure_s;
    EXPECT_NEAR(rendered.sum / level / std::abs(twice_area / 2), 1, 1e-4);
  }
}

TEST_P(FrameRendererDisc, CentroidBackProjectedToCeilingMatchesLampPosition) {
  const FrameRenderer renderer(scene_);
  const Eigen::Vector3d lamp_m = scene_.lamps[0].glow.position_m;
  for (const LampShot& shot : shots(renderer)) {
    const Eigen::Vector2d truth = projected(shot, {lamp_m})[0];
    EXPECT_LT((list_true_lamps(scene_, renderer, shot)[0].pixel - truth).norm(), 1e-6);

    // The weight of a pixel is the area of the ceiling that it covers.
    const cv::Mat1f image = render_image(renderer, shot);
    const Eigen::Isometry3d world_from_camera = shot.motion.world_from_camera(0);
    const auto ceiling_m = [&](double u, double v) {
      const Eigen::Vector3d ray =
          world_from_camera.linear() *
          renderer.pixel_rays().camera_lens().unproject_pixel({u, v}).value().direction;
      return Eigen::Vector2d(world_from_camera.translation().head<2>() +
                             (lamp_m.z() - world_from_camera.translation().z()) / ray.z() *
                                 ray.head<2>());
    };
    double sum = 0;
    Eigen::Vector2d moment_m(0, 0);
    for (int v = 0; v < image.rows; ++v) {
      for (int u = 0; u < image.cols; ++u) {
        if (image(v, u) == 0) continue;
        const Eigen::Vector2d du = ceiling_m(u + 0.5, v) - ceiling_m(u - 0.5, v);
        const Eigen::Vector2d dv = ceiling_m(u, v + 0.5) - ceiling_m(u, v - 0.5);
        const double light = image(v, u) * std::abs(cross_product_2d(du, dv));
        sum += light;
        moment_m += light * ceiling_m(u, v);
      }
    }
    const Eigen::Vector3d found_m(moment_m.x() / sum, moment_m.y() / sum, lamp_m.z());
    EXPECT_LT((projected(shot, {found_m})[0] - truth).norm(), 0.003);
  }
}

INSTANTIATE_TEST_SUITE_P(Lenses, FrameRendererDisc,
                         testing::Values(LensCase{paper_rig_camera(), 0, 0, "PaperRig"},
                                         LensCase{paper_rig_camera(), 0.03, 0.7, "PaperRigTilted"},
                                         LensCase{wide_camera(), 0.05, 0, "Wide"},
                                         LensCase{stereographic_camera(), 0.1, 0.5,
                                                  "Stereographic"},
                                         LensCase{splined(), 0.05, 0.5, "Splined"}),
                         [](const auto& instance) { return std::string(instance.param.name); });

}  // namespace
}  // namespace vlp
