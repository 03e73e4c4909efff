// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/lights_table.h"

#include <gmock/gmock.h>

#include <opencv2/imgproc.hpp>
#include <set>
#include <utility>
#include <vector>

#include "captures/csv_reader.h"
#include "frontend/mat_view.h"
#include "lamps/drawn_lamp.h"
#include "rig/input_error.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;

Light light_of_kind(LightKind kind, LightReason reason) {
  Light light{};
  light.kind = kind;
  light.reason = reason;
  light.pixel = {101.25, 79.5};
  light.sigma_px = 0.02;
  light.radius_px = 38;
  light.inlier_fraction = 0.97;
  light.stripes.contrast = 0.9;
  light.stripes.period_lines = 11.25;
  light.stripes.periods = 6.1;
  return light;
}

Observation image_with(const char* name, std::vector<Light> lights) {
  Observation image{name};
  image.lights = std::move(lights);
  return image;
}

TEST(WriteLightsTable, WritesOneRowPerLight) {
  Light lamp = light_of_kind(LightKind::lamp, LightReason::identified);
  lamp.lamp = 4;
  lamp.outline_kind = LightOutline::edge;
  Light steady = light_of_kind(LightKind::unmodulated, LightReason::overexposed);
  steady.stripes = {};
  const Light formless = light_of_kind(LightKind::no_outline, LightReason::incomplete);
  const TemporaryFolder folder;
  write_lights_table(folder / "lights.csv",
                     std::vector{image_with("a, b.png", {lamp, steady}), image_with("none.png", {}),
                                 image_with("c.png", {formless})});
  const CsvTable table(folder / "lights.csv");
  ASSERT_EQ(table.num_rows(), 3U);
  const auto text = [&](std::size_t row, const char* column) {
    return std::string(table.get_cell_text(row, table.require_column(column)));
  };
  EXPECT_EQ(text(0, "image"), "a, b.png");
  EXPECT_EQ(text(0, "kind"), "lamp");
  EXPECT_EQ(text(0, "reason"), "identified");
  EXPECT_EQ(text(0, "lamp"), "4");
  EXPECT_EQ(text(0, "u_px"), "101.2500");
  EXPECT_EQ(text(0, "v_px"), "79.5000");
  EXPECT_EQ(text(0, "outline"), "edge");
  EXPECT_EQ(text(0, "period_lines"), "11.2500");
  EXPECT_EQ(text(1, "reason"), "overexposed");
  EXPECT_EQ(text(1, "contrast"), "0.0000") << "measured, and none";
  for (const char* column :
       {"lamp", "period_lines", "periods", "periodicity_r2", "coherence", "duty"}) {
    EXPECT_EQ(text(1, column), "") << column;
  }
  EXPECT_EQ(text(2, "image"), "c.png");
  EXPECT_EQ(text(2, "radius_px"), "38.0000");
  for (const char* column :
       {"sigma_px", "outline", "edge_rise_px", "inlier_fraction", "contrast"}) {
    EXPECT_EQ(text(2, column), "") << column;
  }
  EXPECT_THROW(write_lights_table(folder / "no" / "lights.csv", {}), InputError);
}

TEST(CountRejectedLights, SortsByCountButListsLightsWithoutOutlineLast) {
  Light lamp = light_of_kind(LightKind::lamp, LightReason::identified);
  lamp.lamp = 4;
  const Light soft = light_of_kind(LightKind::unknown, LightReason::reflection);
  const Light even = light_of_kind(LightKind::unmodulated, LightReason::unmodulated);
  const Light small = light_of_kind(LightKind::no_outline, LightReason::incomplete);
  const std::vector images{image_with("a.png", {small, small, lamp, soft, even}),
                           image_with("b.png", {small, even, lamp})};
  const auto reasons = count_rejected_lights(images);
  ASSERT_EQ(reasons.size(), 3U);
  EXPECT_EQ(reasons[0].reason, LightReason::unmodulated);
  EXPECT_EQ(reasons[0].lights, 2);
  EXPECT_EQ(reasons[1].reason, LightReason::reflection);
  EXPECT_EQ(reasons[1].kind, LightKind::unknown);
  EXPECT_EQ(reasons[2].reason, LightReason::incomplete) << "though it is the most frequent";
  EXPECT_EQ(reasons[2].lights, 3);
  EXPECT_EQ(count_lights(images, LightKind::lamp), 2);
  EXPECT_EQ(count_lights(images, LightKind::truncated), 0);
}

TEST(LightReasonText, NameAndDescriptionAreUniqueForEachReason) {
  std::set<std::string> names, explanations;
  int reasons = 0;
  for (int i = 0; i <= static_cast<int>(LightReason::incomplete); ++i, ++reasons) {
    names.emplace(light_reason_name(static_cast<LightReason>(i)));
    explanations.insert(describe_light_reason(static_cast<LightReason>(i)));
  }
  EXPECT_EQ(names.size(), std::size_t(reasons));
  EXPECT_EQ(explanations.size(), std::size_t(reasons));
  EXPECT_FALSE(names.contains("") || explanations.contains(""));
  EXPECT_THAT(describe_light(light_of_kind(LightKind::unknown, LightReason::too_few_periods)),
              HasSubstr("(101.2, 79.5) unknown: it shows less than 1.3 periods"));
}

constexpr int kReasonPeriod_lines = 11;
const cv::Size kReasonSize(300, 200);

/// Detects the lights in a drawing by a detector whose map contains its lamp.
std::vector<Light> lights_in_drawing(const cv::Mat& image) {
  return LightDetector({{drawn_lamp(1, kReasonPeriod_lines)}}, drawn_camera(kReasonSize))
      .detect_lights(to_image_view(image));
}

cv::Mat drawn_lamp_at(const Eigen::Vector2d& center, double radius_px, double level = 0.7,
                      DrawnStripes stripes = {.period_lines = kReasonPeriod_lines}) {
  return render_lamps(
      {{.center = center, .radius_px = radius_px, .level = level, .stripes = stripes}}, kReasonSize,
      CV_8U, 0.5);
}

TEST(LightDetector, ReportsOverexposedForClippedAndSteadyForUnmodulatedLamp) {
  const DrawnStripes steady{.period_lines = kReasonPeriod_lines, .duty = 1};
  for (const auto& [level, reason] :
       {std::pair(0.7, LightReason::unmodulated), {1.5, LightReason::overexposed}}) {
    const auto lights = lights_in_drawing(drawn_lamp_at({150.3, 99.6}, 38, level, steady));
    ASSERT_EQ(lights.size(), 1U);
    EXPECT_EQ(lights[0].kind, LightKind::unmodulated);
    EXPECT_EQ(lights[0].reason, reason) << level;
  }
}

TEST(LightDetector, ReportsIncompleteForSmallLightAndTooFewPeriodsForCutOne) {
  const auto small = lights_in_drawing(drawn_lamp_at({150.3, 99.6}, 4, 0.7, {.period_lines = 4}));
  ASSERT_EQ(small.size(), 1U);
  EXPECT_EQ(small[0].kind, LightKind::no_outline);
  EXPECT_EQ(light_reason_name(small[0].reason), light_reason_name(LightReason::incomplete));
  const auto cut = lights_in_drawing(drawn_lamp_at({150.3, -30.6}, 38));
  ASSERT_EQ(cut.size(), 1U);
  EXPECT_EQ(light_reason_name(cut[0].reason), light_reason_name(LightReason::too_few_periods));
  for (const Light& light : {small[0], cut[0]}) {
    EXPECT_FALSE(light.lamp);
    EXPECT_FALSE(is_light_modulated(light));
  }
}

TEST(LightDetector, ReportsCrossAsSteady) {
  cv::Mat cross(kReasonSize, CV_8U, cv::Scalar(10));
  cv::rectangle(cross, {50, 95, 200, 8}, 200, cv::FILLED);
  cv::rectangle(cross, {146, 20, 8, 160}, 200, cv::FILLED);
  const auto lights = lights_in_drawing(cross);
  ASSERT_EQ(lights.size(), 1U);
  EXPECT_EQ(lights[0].kind, LightKind::unmodulated);
}

}  // namespace
}  // namespace vlp
