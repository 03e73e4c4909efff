// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// The detector on rendered captures, whose truth is known.
#include "lamps/light_detector.h"
#include "frontend/mat_view.h"
#include "lamps/drawn_lamp.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "lamps/rendered_captures.h"

namespace vlp {
namespace {

TEST(LightDetector, IdentifiesAndLocatesAllLampsOfPaperRig) {
  const Score score = Captures("paper-rig", "check").score(12);
  EXPECT_GT(score.lamps, 180);
  EXPECT_EQ(score.missed, 0);
  EXPECT_EQ(score.wrong, 0);
  EXPECT_LT(score.rms_px(), 0.02);
  EXPECT_LT(score.worst_px, 0.08);
}

TEST(LightDetector, SigmaMatchesErrorsOfLampCenters) {
  const Score score = Captures("paper-rig", "check").score(12);
  ASSERT_GT(score.lamps, 180);
  EXPECT_GT(score.chi_square / score.lamps, 0.7);
  EXPECT_LT(score.chi_square / score.lamps, 2);
}

TEST(LightDetector, LocatesAllLampsAccuratelyWithTiltAndDecenteredLens) {
  const Score score = Captures("paper-rig-faulty", "check").score(24);
  ASSERT_GT(score.lamps, 0);
  EXPECT_EQ(score.missed, 0);
  EXPECT_EQ(score.wrong, 0);
  EXPECT_LT(score.rms_px(), 0.02);
}

TEST(LightDetector, LocatesLampsAccuratelyWithWideLensAndColumnReadout) {
  const Score score = Captures("wide", "check").score(8);
  EXPECT_GT(score.lamps, 150);
  EXPECT_LE(score.missed, 4);  // too few stripes for identification
  EXPECT_EQ(score.wrong, 0);
  EXPECT_LT(score.rms_px(), 0.03);
}

TEST(LightDetector, ClassifiesSteadyLightsAsSteadyAndReflectionAsUnknown) {
  const Captures captures("clutter", "sample");
  const LampShot shot = captures.shot(0);
  std::map<LightKind, int> kinds;
  for (const Light& light : captures.detector().detect_lights(to_image_view(captures.image(shot))))
    ++kinds[light.kind];
  EXPECT_GE(kinds[LightKind::lamp], 3);
  EXPECT_LE(kinds[LightKind::lamp], 6) << "and three of them partly hidden";
  EXPECT_GE(kinds[LightKind::unknown], 1) << "the reflection of lamp 5";
  EXPECT_EQ(kinds[LightKind::unmodulated], 2) << "the steady lamp and the window";
}

TEST(LightDetector, ReportsCutForLampsAtImageBorder) {
  const Captures captures("paper-rig", "check");
  int cut = 0;
  for (std::size_t i = 0; i < 432; i += 8) {
    const LampShot shot = captures.shot(i);
    const auto lights = captures.detector().detect_lights(to_image_view(captures.image(shot)));
    for (const auto& [id, pixel, in_view] : captures.truth(shot)) {
      if (in_view > 0.9) continue;
      for (const Light& light : lights) {
        if (light.lamp != id) continue;
        EXPECT_EQ(light.kind, LightKind::truncated) << id << " in image " << i;
        ++cut;
      }
    }
  }
  EXPECT_GT(cut, 5);
}

TEST(LightDetector, ReportsUnknownForLampsMissingInMap) {
  const Captures captures("paper-rig", "sample");
  const LightDetector detector(LampMap{{Lamp{7, {0, 0, 1.6}, {}, 6000, 0.5}}},
                               {Readout::rows, 3e-5, {}});
  const auto lights = detector.detect_lights(to_image_view(captures.image(captures.shot(0))));
  ASSERT_FALSE(lights.empty());
  for (const Light& light : lights) {
    EXPECT_EQ(light.kind, LightKind::unknown);
    EXPECT_FALSE(light.lamp);
  }
}

TEST(LightDetector, IdentifiesNoLampWhenTwoMapFrequenciesAreNearlyEqual) {
  const Captures captures("paper-rig", "sample");
  LampMap map{{Lamp{3, {0, 0, 1.6}, {}, 2500, 0.5}, Lamp{7, {1, 0, 1.6}, {}, 2520, 0.5}}};
  const auto identified = [&] {
    const LightDetector detector(map, {Readout::rows, 3e-5, {}});
    const auto lights = detector.detect_lights(to_image_view(captures.image(captures.shot(0))));
    return std::count_if(lights.begin(), lights.end(),
                         [](const Light& light) { return light.lamp.has_value(); });
  };
  EXPECT_EQ(identified(), 0);
  map.lamps.pop_back();
  EXPECT_EQ(identified(), 1);
}

TEST(LightDetector, IdentifiesLampOfFewPeriodsOnlyNextToReliableLamp) {
  const cv::Size size(300, 160);
  const LightDetector detector(LampMap{{drawn_lamp(1, 36), drawn_lamp(2, 11)}}, drawn_camera(size));
  const DrawnLamp few{.center = {81.3, 79.6}, .stripes = {.period_lines = 36}};
  const DrawnLamp more{.center = {210.3, 79.6}, .stripes = {.period_lines = 11}};
  const auto alone = detector.detect_lights(to_image_view(render_lamps({few}, size, CV_8U, 0.5)));
  ASSERT_EQ(alone.size(), 1U);
  EXPECT_LT(alone[0].stripes.periods, kMinReliablePeriods);
  EXPECT_EQ(alone[0].kind, LightKind::unknown);
  EXPECT_EQ(alone[0].reason, LightReason::too_few_periods);
  const auto two_lights =
      detector.detect_lights(to_image_view(render_lamps({few, more}, size, CV_8U, 0.5)));
  ASSERT_EQ(two_lights.size(), 2U);
  for (const Light& light : two_lights) EXPECT_EQ(light.kind, LightKind::lamp);
}

/// Returns the kinds of the lights of an image, from left to right.
std::vector<std::pair<LightKind, LightReason>> list_kinds(std::vector<Light> lights) {
  std::sort(lights.begin(), lights.end(),
            [](const Light& a, const Light& b) { return a.pixel.x() < b.pixel.x(); });
  std::vector<std::pair<LightKind, LightReason>> kinds;
  for (const Light& light : lights) kinds.emplace_back(light.kind, light.reason);
  return kinds;
}

TEST(LightDetector, IdentifiesLampOnlyIfMirrorImageIsMuchDarker) {
  const cv::Size size(300, 160);
  const LightDetector detector(LampMap{{drawn_lamp(1, 11)}}, drawn_camera(size));
  const DrawnLamp lamp{.center = {81.3, 79.6}};
  DrawnLamp mirror_image{.center = {210.3, 79.6}};
  const auto kinds_beside = [&](double fraction) {
    mirror_image.level = fraction * lamp.level;
    return list_kinds(detector.detect_lights(
        to_image_view(render_lamps({lamp, mirror_image}, size, CV_8U, 0.5))));
  };
  const std::pair lamp_kind(LightKind::lamp, LightReason::identified);
  const std::pair reflection(LightKind::unknown, LightReason::reflection);
  EXPECT_EQ(kinds_beside(0.4), (std::vector{lamp_kind, reflection}));
  EXPECT_EQ(kinds_beside(0.8), (std::vector{reflection, reflection}));
}

TEST(LightDetector, RejectsLampWhosePeriodAloneDeviatesFromMap) {
  const cv::Size size(520, 160);
  const LightDetector detector(
      LampMap{{drawn_lamp(1, 9), drawn_lamp(2, 11), drawn_lamp(3, 14), drawn_lamp(4, 18)}},
      drawn_camera(size));
  const auto kinds_with = [&](double first, double others) {
    std::vector<DrawnLamp> lamps;
    for (const double period : {first * 9, others * 11, others * 14, others * 18}) {
      lamps.push_back({.center = {70.3 + 120 * double(lamps.size()), 79.6},
                       .stripes = {.period_lines = period}});
    }
    return list_kinds(detector.detect_lights(to_image_view(render_lamps(lamps, size, CV_8U, 0.5))));
  };
  const std::pair lamp(LightKind::lamp, LightReason::identified);
  const std::pair other_period(LightKind::unknown, LightReason::unknown_period);
  EXPECT_EQ(kinds_with(1.05, 1), (std::vector{other_period, lamp, lamp, lamp}));
  EXPECT_EQ(kinds_with(1.05, 1.04), (std::vector{lamp, lamp, lamp, lamp}))
      << "the row time is wrong";
}

TEST(LightDetector, IdentifiesLampsByClassifierDespiteWrongMapFrequency) {
  const cv::Size size(520, 160);
  const std::vector<double> periods{9, 11, 14, 18};
  LampMap map;
  for (std::size_t i = 0; i < periods.size(); ++i) {
    map.lamps.push_back(drawn_lamp(static_cast<int>(i) + 1, periods[i]));
  }
  const auto draw = [&](double phase) {
    std::vector<DrawnLamp> lamps;
    for (const double period : periods) {
      lamps.push_back({.center = {70.3 + 120 * double(lamps.size()), 79.6},
                       .stripes = {.period_lines = period, .phase = phase}});
    }
    return render_lamps(lamps, size, CV_8U, 0.5);
  };
  std::vector<LabeledLight> training;
  const LightDetector by_map(map, drawn_camera(size));
  for (std::size_t i = 0; i < 10; ++i) {
    for (const Light& light : by_map.detect_lights(to_image_view(draw(double(i) / 10)))) {
      if (light.lamp) training.push_back({*light.lamp, light.stripes, i});
    }
  }
  ASSERT_EQ(training.size(), 40U);
  *map.lamps[0].frequency_hz *= 1.05;
  const LightDetector by_classifier(map, drawn_camera(size), fit_classifier(training));
  const std::pair lamp(LightKind::lamp, LightReason::identified);
  EXPECT_EQ(list_kinds(by_classifier.detect_lights(to_image_view(draw(0.33)))),
            std::vector(4, lamp));
}

/// Expects one light that the image border cuts, identified as lamp 1, with this period.
void expect_one_cut_lamp(const std::vector<Light>& lights, double period_lines) {
  ASSERT_EQ(lights.size(), 1);
  EXPECT_EQ(lights[0].kind, LightKind::truncated);
  EXPECT_EQ(lights[0].lamp, 1);
  EXPECT_NEAR(lights[0].stripes.period_lines / period_lines, 1, 0.003);
}

TEST(LightDetector, ReportsCutForLampThatFillsImage) {
  const cv::Size size(640, 480);
  for (const double period : {9.0, 25.0, 68.6}) {
    for (const double duty : {0.3, 0.5}) {
      for (const double exposure_lines : {1.0, 0.25 * period}) {
        for (const double radius_px : {500.0, 2000.0}) {
          SCOPED_TRACE(testing::Message()
                       << period << ", " << duty << ", " << exposure_lines << ", " << radius_px);
          DrawnLamp lamp{.center = {300, 250}, .radius_px = radius_px};
          lamp.stripes = {period, duty, 0.3, exposure_lines};
          const cv::Mat image = render_lamps({lamp}, size, CV_8U, 1.5);
          const LightDetector detector({{drawn_lamp(1, period)}}, drawn_camera(size));
          expect_one_cut_lamp(detector.detect_lights(to_image_view(image)), period);
        }
      }
    }
  }
}

TEST(LightDetector, ReportsCutForUnevenLampThatFillsImageReadByColumns) {
  const cv::Size size(640, 480);
  DrawnLamp lamp{.center = {100, 100}, .level = 0.9, .stripes = {.period_lines = 40}};
  lamp.glow = DrawnGlow{.fall_px = 500, .core_px = 300};
  const cv::Mat image = render_lamps({lamp}, size, CV_16U, 1).t();
  DetectorCamera camera = drawn_camera(size);
  camera.readout = Readout::columns;
  expect_one_cut_lamp(
      LightDetector({{drawn_lamp(1, 40)}}, camera).detect_lights(to_image_view(image)), 40);
}

TEST(LightDetector, ReportsCutForGlowThatContinuesToBorder) {
  const cv::Size size(300, 160);
  const LightDetector detector({{drawn_lamp(1, 16)}}, drawn_camera(size));
  for (const double to_border_px : {40.0, 45.0, 50.0, 55.0}) {
    for (const double phase : {0.0, 0.25, 0.5, 0.75}) {
      SCOPED_TRACE(testing::Message() << to_border_px << ", " << phase);
      DrawnLamp lamp{.center = {150, size.height - 1 - to_border_px}};
      lamp.stripes = {.period_lines = 16, .phase = phase};
      lamp.glow = DrawnGlow{.fall_px = 22, .core_px = 20};
      const auto lights =
          detector.detect_lights(to_image_view(render_lamps({lamp}, size, CV_8U, 0.5)));
      ASSERT_EQ(lights.size(), 1);
      EXPECT_EQ(lights[0].kind, LightKind::truncated);
    }
  }
}

/// The lamps and a steady panel between them form one blob, whose clearest rim is that of lamp 2.
TEST(LightDetector, ReportsCutForFragmentInBlobOfOtherLamps) {
  const cv::Size size(460, 300);
  const LightDetector detector({{drawn_lamp(1, 16.7), drawn_lamp(2, 13.3), drawn_lamp(3, 10.8)}},
                               drawn_camera(size));
  int num_cut = 0;
  for (const double phase : {0.0, 0.1, 0.2}) {
    for (const double x : {292.0, 296.0, 300.0, 304.0}) {
      DrawnLamp cut{.center = {x, 40.4}, .radius_px = 75, .blur_px = 1};
      cut.stripes = {.period_lines = 16.7, .phase = phase};
      cut.recess = DrawnRecess{.core_off_px = {16, 0}, .core_px = 28, .walls = 0.15, .halo = 0};
      DrawnLamp other = cut;
      other.center = {174, 105}, other.radius_px = 58, other.level = 0.9;
      other.stripes = {.period_lines = 10.8, .phase = phase};
      other.recess->core_off_px = {12, 0}, other.recess->core_px = 20;
      const DrawnLamp sharp{
          .center = {159, 56}, .radius_px = 41, .stripes = {.period_lines = 13.3}};
      cv::Mat image = render_lamps({cut}, size, CV_8U, 1);
      for (const DrawnLamp& lamp : {other, sharp}) {
        image = cv::max(image, render_lamps({lamp}, size, CV_8U, 1));
      }
      cv::Mat panel = image.clone();
      panel(cv::Rect(200, 37, 120, 110)) = 40;
      for (const DrawnLamp& lamp : {cut, other, sharp}) {
        cv::circle(panel, cv::Point2d(lamp.center.x(), lamp.center.y()), int(lamp.radius_px), 0,
                   cv::FILLED);
      }
      image = cv::max(image, panel);
      for (const Light& light : detector.detect_lights(to_image_view(image))) {
        if (light.lamp != 1) continue;
        EXPECT_EQ(light.kind, LightKind::truncated) << light.pixel.transpose();
        num_cut += light.kind == LightKind::truncated ? 1 : 0;
      }
    }
  }
  EXPECT_GE(num_cut, 8);
}

TEST(LightDetector, ReturnsPeriodOfLampThatFillsImageWithoutRowTime) {
  const cv::Size size(640, 480);
  const DrawnLamp lamp{.radius_px = 2000, .stripes = {.period_lines = 68.6}};
  const auto lights = LightDetector({}, {Readout::rows, {}, {}})
                          .detect_lights(to_image_view(render_lamps({lamp}, size, CV_8U, 1)));
  ASSERT_EQ(lights.size(), 1);
  EXPECT_TRUE(are_stripes_reliable(lights[0].stripes));
  EXPECT_NEAR(lights[0].stripes.period_lines / 68.6, 1, 0.003);
}

TEST(LightDetector, ReturnsSamePeriodOfStripsWithAndWithoutRowTime) {
  const cv::Size size(16, 855);  // 39 periods
  const double period = size.height / 39.0;
  for (int i = 0; i < 12; ++i) {
    for (const double exposure_lines : {2.0, 8.0}) {
      DrawnLamp strip{.center = {8, 427}, .level = 0.7};
      strip.stripes = {period, 0.5, i / 12.0, exposure_lines};
      strip.glow = DrawnGlow{.fall_px = 900, .core_px = 300};
      const cv::Mat image = render_lamps({strip}, size, CV_8U, 4, std::uint64_t(i));
      for (const bool has_row_time : {true, false}) {
        DetectorCamera camera{Readout::rows, {}, {}};
        if (has_row_time) camera.row_time_s = kDrawnRowTime_s;
        const auto lights =
            LightDetector({{drawn_lamp(1, period)}}, camera).detect_lights(to_image_view(image));
        ASSERT_EQ(lights.size(), 1) << i << ", " << exposure_lines << ", " << has_row_time;
        EXPECT_TRUE(are_stripes_reliable(lights[0].stripes));
        EXPECT_NEAR(lights[0].stripes.period_lines / period, 1, 5e-4);
      }
    }
  }
}

TEST(LightDetector, LocatesLampHalfAsWideAsImage) {
  const cv::Size size(640, 480);
  const DrawnLamp lamp{.center = {300.3, 240.6}, .radius_px = 160, .stripes = {.period_lines = 25}};
  const LightDetector detector({{drawn_lamp(1, 25)}}, drawn_camera(size));
  const auto lights = detector.detect_lights(to_image_view(render_lamps({lamp}, size, CV_8U, 1.5)));
  ASSERT_EQ(lights.size(), 1);
  EXPECT_EQ(lights[0].kind, LightKind::lamp);
  EXPECT_LT((lights[0].pixel - lamp.center).norm(), 0.1);
}

TEST(LightDetector, ReturnsNoLightsForNoise) {
  const LightDetector detector({{drawn_lamp(1, 11)}}, drawn_camera({640, 480}));
  for (const double noise : {0.3, 2.0, 8.0, 15.0}) {
    const cv::Mat image = render_lamps({}, {640, 480}, CV_8U, noise);
    EXPECT_TRUE(detector.detect_lights(to_image_view(image)).empty()) << noise;
  }
}

TEST(LightDetector, ReturnsNoLightsForUniformImages) {
  const LightDetector detector = Captures("paper-rig", "sample").detector();
  for (const int type : {CV_8U, CV_16U}) {
    for (const double level : {0.0, 100.0, 255.0, 65535.0}) {
      EXPECT_TRUE(detector.detect_lights(to_image_view(cv::Mat(600, 800, type, cv::Scalar(level))))
                      .empty());
    }
    EXPECT_TRUE(detector.detect_lights(to_image_view(cv::Mat(1, 1, type, cv::Scalar(9)))).empty());
  }
}

}  // namespace
}  // namespace vlp
