// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Panels and tubes among discs, in images of a tilted camera.
#include <algorithm>
#include <utility>

#include "frontend/mat_view.h"
#include "lamps/rendered_captures.h"
#include "positioning/positioner.h"
#include "rig/find_lamp.h"

namespace vlp {
namespace {

constexpr std::size_t kStep = 11;  // of 144 captures, through all yaws

bool is_panel_or_tube(int lamp) { return lamp <= 4; }

TEST(LightDetector, LocatesAllPanelsAndTubesAccuratelyWithKnownTilt) {
  const Score score = Captures("panels", "check").score(kStep, is_panel_or_tube);
  EXPECT_EQ(score.wrong, 0);
  EXPECT_GE(score.lamps, 50);
  EXPECT_EQ(score.missed, 0);
  EXPECT_LT(score.rms_px(), 0.25) << "a dark stripe hides an edge along the lines";
  EXPECT_GT(score.chi_square / score.lamps, 0.7);
  EXPECT_LT(score.chi_square / score.lamps, 1.5);
}

TEST(LightDetector, LocatesPanelsAndTubesAccuratelyWithUncalibratedTilt) {
  const Captures captures("panels", "check");
  DetectorCamera camera = make_detector_camera(captures.calibration());
  camera.level_from_camera.setIdentity();
  const Score score =
      captures.score(kStep, LightDetector(captures.lamps(), camera), is_panel_or_tube);
  EXPECT_EQ(score.wrong, 0);
  EXPECT_GE(score.lamps, 50);
  EXPECT_LE(score.missed, 1);
  EXPECT_LT(score.rms_px(), 0.35);
  EXPECT_GT(score.chi_square / score.lamps, 0.7);
  EXPECT_LT(score.chi_square / score.lamps, 2);
}

TEST(LightDetector, LocatesDiscsWithAndWithoutRectanglesInMap) {
  const Captures captures("panels", "check");
  LampMap discs = captures.lamps();
  for (Lamp& lamp : discs.lamps) {
    if (lamp.shape.kind == ShapeKind::rectangle) lamp.shape = {};
  }
  const LightDetector without(discs, make_detector_camera(captures.calibration()));
  int compared = 0;
  for (std::size_t i = 0; i < captures.size(); i += 4 * kStep) {
    const cv::Mat image = captures.image(captures.shot(i));
    const auto lights = captures.detector().detect_lights(to_image_view(image)),
               others = without.detect_lights(to_image_view(image));
    for (const Light& light : lights) {
      if (!light.lamp || is_panel_or_tube(*light.lamp)) continue;
      const auto same = std::find_if(others.begin(), others.end(), [&](const Light& other) {
        return other.lamp == light.lamp && (other.pixel - light.pixel).norm() < light.sigma_px;
      });
      EXPECT_NE(same, others.end()) << "lamp " << *light.lamp << " in image " << i;
      ++compared;
    }
  }
  EXPECT_GT(compared, 8);
}

TEST(LightDetector, IdentifiesNoPanelsWhoseAspectRatioContradictsMap) {
  const Captures captures("panels", "check");
  LampMap swapped = captures.lamps();
  for (Lamp& lamp : swapped.lamps) {
    if (lamp.shape.kind == ShapeKind::rectangle) lamp.shape.size_m = Eigen::Vector2d(0.6, 0.2);
  }
  const LightDetector detector(swapped, make_detector_camera(captures.calibration()));
  int refused = 0;
  for (std::size_t i = 0; i < captures.size(); i += 4 * kStep) {
    for (const Light& light :
         detector.detect_lights(to_image_view(captures.image(captures.shot(i))))) {
      if (light.outline_kind != LightOutline::rectangle) continue;
      EXPECT_FALSE(light.lamp);
      EXPECT_EQ(light.kind, LightKind::unknown);
      refused += light.reason == LightReason::wrong_shape;
    }
  }
  EXPECT_GT(refused, 6);
}

TEST(LightDetector, PanelCenterErrorsStayWithinFourSigmaForUnknownLens) {
  const Captures captures("panels", "check");
  const LightDetector detector(captures.lamps(), {Readout::rows, 3e-5, std::nullopt});
  double squares = 0;
  int found = 0, tubes = 0;
  for (std::size_t i = 0; i < captures.size(); i += 3 * kStep) {
    const LampShot shot = captures.shot(i);
    const auto truth = captures.truth(shot);
    for (const Light& light : detector.detect_lights(to_image_view(captures.image(shot)))) {
      if (light.kind != LightKind::lamp || light.outline_kind != LightOutline::rectangle) continue;
      const auto lamp = std::find_if(truth.begin(), truth.end(), [&](const TrueLamp& candidate) {
        return candidate.id == light.lamp;
      });
      ASSERT_NE(lamp, truth.end());
      const double error_px = (light.pixel - lamp->pixel).norm();
      EXPECT_LT(error_px, 4 * light.sigma_px) << "lamp " << lamp->id;
      squares += error_px * error_px;
      tubes += lamp->id >= 3;
      ++found;
    }
  }
  EXPECT_GT(found, 9);
  EXPECT_GT(tubes, 4);
  EXPECT_LT(std::sqrt(squares / found), 0.4);
}

Scene panels_scene() { return read_scene_file(VLP_SOURCE_DIR "/datasets/panels/scene.yaml"); }

TEST(LightDetector, LocatesAllSmallDiscsAmongPanelsAndTubes) {
  Scene scene = panels_scene();
  for (SceneLamp& lamp : scene.lamps) {
    if (lamp.glow.shape.kind == ShapeKind::rectangle) continue;
    lamp.glow.shape = make_disc_lamp_shape(0.095);  // 10 to 12 px
    lamp.frequency_hz = 6100 + 1200 * (lamp.id - 5);
  }
  const Captures captures(std::move(scene), "check");
  const Score score = captures.score(kStep, [](int lamp) { return !is_panel_or_tube(lamp); });
  EXPECT_GT(score.lamps, 35);
  EXPECT_EQ(score.missed, 0);
  EXPECT_EQ(score.wrong, 0);
  EXPECT_LT(score.rms_px(), 0.04);
  EXPECT_LT(score.chi_square / score.lamps, 1.5);
}

/// Returns a bar along y, at 2.2 m, between camera and ceiling.
Panel bar(double x_m, double width_m) {
  return {{x_m, -1.5, 2.2}, {width_m, 0, 0}, {0, 3, 0}, 1e6};
}

TEST(LightDetector, SigmaCoversErrorsOfPartlyHiddenPanels) {
  Scene scene = panels_scene();
  // Along edges of panels and across a tube's end: the visible part is also a rectangle.
  scene.clutter.occluders = {bar(-1.2, 0.08), bar(0.6, 0.3)};
  const Captures captures(std::move(scene), "check");
  int found = 0, far = 0;
  for (std::size_t i = 0; i < captures.size(); i += 5) {
    const LampShot shot = captures.shot(i);
    const auto truth = captures.truth(shot);
    for (const Light& light :
         captures.detector().detect_lights(to_image_view(captures.image(shot)))) {
      if (light.kind != LightKind::lamp || light.outline_kind != LightOutline::rectangle) continue;
      const auto lamp = std::find_if(truth.begin(), truth.end(), [&](const TrueLamp& candidate) {
        return candidate.id == light.lamp;
      });
      ASSERT_NE(lamp, truth.end());
      const double off_px = (light.pixel - lamp->pixel).norm();
      // For a tube of 20 px width, less than 3 px of hidden end are not detectable.
      if (off_px > 3) {
        EXPECT_LT(off_px, 3 * light.sigma_px) << "lamp " << lamp->id << " in image " << i;
        ++far;
      }
      ++found;
    }
  }
  EXPECT_GT(found, 10);
  EXPECT_GT(far, 5) << "there is something to state";
}

TEST(LightDetector, ReportsNoLampForPanelsCutByImageBorder) {
  const Captures captures("panels", "check");
  int cut = 0, identified = 0;
  for (std::size_t i = 0; i < captures.size(); i += 5) {
    const LampShot shot = captures.shot(i);
    const auto lights = captures.detector().detect_lights(to_image_view(captures.image(shot)));
    identified += static_cast<int>(std::count_if(
        lights.begin(), lights.end(), [](const Light& light) { return light.lamp.has_value(); }));
    for (const TrueLamp& lamp : captures.truth(shot)) {
      if (!is_panel_or_tube(lamp.id) || lamp.visible_fraction >= 1) continue;
      ++cut;
      for (const Light& light : lights) {
        EXPECT_FALSE(light.lamp == lamp.id && light.kind == LightKind::lamp)
            << "lamp " << lamp.id << " in image " << i;
      }
    }
  }
  EXPECT_GT(cut, 10);
  EXPECT_GT(identified, 0);
}

TEST(LightDetector, IdentifiesNoReflectionsOfPanelsAsLamps) {
  Scene scene = panels_scene();
  for (const std::size_t lamp : {1U, 2U}) {
    scene.clutter.reflections.push_back({scene.lamps[lamp].glow, lamp});
    Glow& reflection = scene.clutter.reflections.back().glow;
    reflection.position_m.head<2>() += Eigen::Vector2d(0.1, lamp == 1 ? -0.75 : 0.75);
    reflection.electron_rate_e_per_s /= 4;
    reflection.rim_to_center_ratio = 0;
  }
  const Score score = Captures(std::move(scene), "check").score(2 * kStep, is_panel_or_tube);
  EXPECT_EQ(score.wrong, 0);
  EXPECT_GE(score.lamps, 12);
  EXPECT_LT(score.rms_px(), 0.45);
}

TEST(Positioner, ComputesFixWithinTwoMillimetersFromPanels) {
  const Captures captures("panels", "check");
  const Positioner positioner(captures.lamps(), captures.calibration());
  int fixes = 0;
  for (std::size_t i = 0; i < captures.size(); i += 2 * kStep) {
    const LampShot shot = captures.shot(i);
    std::vector<Detection> detections;
    for (const Light& light :
         captures.detector().detect_lights(to_image_view(captures.image(shot)))) {
      if (light.kind != LightKind::lamp || light.outline_kind != LightOutline::rectangle) continue;
      detections.push_back({*light.lamp, light.pixel, light.sigma_px});
    }
    if (detections.size() < 3) continue;
    const Fix fix = positioner.compute_position_fix(detections);
    ASSERT_EQ(fix.status, FixStatus::ok) << i;
    EXPECT_LT((fix.state.pose.position_m - shot.motion.camera_pose_at(0).position_m).norm(), 0.002)
        << i;
    ++fixes;
  }
  EXPECT_GE(fixes, 3);
}

}  // namespace
}  // namespace vlp
