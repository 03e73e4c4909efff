// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/glow.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "detection/mat_view.h"
#include "lamps/drawn_lamp.h"
#include "lamps/light_detector.h"
#include "lamps/shape/glow_envelope.h"
#include "support/near.h"

namespace vlp {
namespace {

using Eigen::Vector2d;

const cv::Size kGlowSize(400, 360);

DrawnLamp glow(double level, const DrawnStripes& stripes = {}) {
  return {.center = {198.7, 181.2}, .level = level, .stripes = stripes, .glow = DrawnGlow()};
}

std::optional<Light> glow_in(const ImageView& image) {
  const Background background = background_of(image);
  const auto blobs = group_runs(find_runs(image, background.threshold), 20);
  const auto size = [](const Blob& blob) { return blob.bottom() - blob.top(); };
  const auto largest = std::max_element(blobs.begin(), blobs.end(),
                                        [&](auto& a, auto& b) { return size(a) < size(b); });
  if (largest == blobs.end()) return std::nullopt;
  return glow_of(image, *largest, background, LightShape(drawn_camera(kGlowSize)));
}

/// Glows not as bright as white, and up to five times too bright, with several stripes.
template <typename Test>
void for_each_case(const std::vector<double>& noises_of_255, const Test& test) {
  for (const double level : {0.5, 0.95, 2.0, 5.0}) {
    for (const double noise : noises_of_255) {
      for (const double period : {9.0, 14.5, 22.0}) {
        for (const double duty : {0.4, 0.5, 0.7}) {
          SCOPED_TRACE(testing::Message() << level << " of white, noise " << noise << ", period "
                                          << period << ", duty " << duty);
          test(glow(level, {.period_lines = period, .duty = duty}), noise);
        }
      }
    }
  }
}

TEST(Glow, IsFoundWithItsCentreAndItsStripes) {
  double chi_square = 0, worst_px = 0, count = 0;
  for (const int depth : {CV_8U, CV_16U}) {
    for_each_case({0, 0.5, 1.5}, [&](const DrawnLamp& lamp, double noise) {
      const cv::Mat pixels = drawn({lamp}, kGlowSize, depth, noise);
      const ImageView image = image_view(pixels);
      const auto light = glow_in(image);
      ASSERT_TRUE(light);
      EXPECT_TRUE(light->glows);
      EXPECT_LT(light->sigma_px, 1);
      const double error_px = (light->pixel - lamp.center).norm();
      worst_px = std::max(worst_px, error_px);
      chi_square += error_px * error_px / 2 / std::pow(light->sigma_px, 2);
      ++count;
      const Vector2d beyond(0, light->radius_px);
      const auto signal =
          line_signal(image, chords_of(light->low - beyond, light->high + beyond, image.size()),
                      background_of(image).level);
      const Stripes seen = stripes_of(striped_part(without_glow(signal)));
      EXPECT_NEAR(seen.period_lines / lamp.stripes.period_lines, 1, 0.02);
    });
  }
  EXPECT_LT(worst_px, 1) << "of a radius of 45 and more";
  EXPECT_LT(chi_square / count, 3) << "sigma_px may be too small, but not by far";
}

TEST(Glow, IsIdentified) {
  for_each_case({0, 0.5}, [](const DrawnLamp& lamp, double noise) {
    const LampMap map{{drawn_lamp(7, lamp.stripes.period_lines), drawn_lamp(8, 17.5)}};
    const auto lights = LightDetector(map, drawn_camera(kGlowSize))
                            .detect(image_view(drawn({lamp}, kGlowSize, CV_8U, noise)));
    ASSERT_EQ(lights.size(), 1U);
    EXPECT_TRUE(lights[0].glows);
    EXPECT_NEAR(lights[0].stripes.period_lines / lamp.stripes.period_lines, 1, 0.02);
    EXPECT_EQ(lights[0].lamp, 7);
    EXPECT_EQ(lights[0].kind, LightKind::lamp);
  });
}

TEST(Glow, HasNoEdge) {
  for (const int depth : {CV_8U, CV_16U}) {
    for (const double blur_px : {0.6, 1.0}) {
      const DrawnLamp disc{.center = {198.7, 181.2}, .blur_px = blur_px};
      EXPECT_FALSE(glow_in(image_view(drawn({disc}, kGlowSize, depth))));
      for (const Light& light : LightDetector({}, drawn_camera(kGlowSize))
                                    .detect(image_view(drawn({disc}, kGlowSize, depth)))) {
        EXPECT_FALSE(light.glows);
      }
    }
  }
}

TEST(WithoutGlow, IsTheStripesUnderAGaussian) {
  for (const double period : {9.0, 14.5, 22.0}) {
    const DrawnStripes stripes{.period_lines = period};
    std::vector<double> signal, truth;
    for (int line = -50; line <= 50; ++line) {
      const double envelope = 200 * std::exp(-line * line / (2 * 24.0 * 24.0));
      signal.push_back(envelope * stripes.lit(line));
      truth.push_back(stripes.lit(line));
    }
    const auto flat = without_glow(signal);
    // Down to 0.08 of 200: 2.2 sigma to both sides. At the ends the last stripe is the measure.
    const auto lost = (truth.size() - flat.size()) / 2;
    EXPECT_LE(flat.size(), truth.size());
    EXPECT_GE(flat.size(), 95U);
    const auto inside = static_cast<std::size_t>(period) + lost;
    for (std::size_t i = inside; i + inside < truth.size(); ++i) {
      EXPECT_NEAR(flat[i - lost], truth[i], 0.15) << period << ", line " << i;
    }
    const Stripes seen = stripes_of(flat);
    EXPECT_NEAR(seen.period_lines / period, 1, 0.02);
    EXPECT_GT(seen.contrast, 0.9);
  }
}

TEST(WithoutGlow, OfStripesWithoutGlowIsTheStripes) {
  const DrawnStripes stripes{.period_lines = 12};
  std::vector<double> signal, truth;
  for (int line = 0; line < 80; ++line) {
    truth.push_back(stripes.lit(line));
    signal.push_back(90 * truth.back());
  }
  const auto flat = without_glow(signal);
  ASSERT_EQ(flat.size(), truth.size());
  for (std::size_t i = 0; i < flat.size(); ++i) EXPECT_NEAR(flat[i], truth[i], 1e-9);
}

TEST(StripedPart, LeavesOutWhatIsDarkBeyondTheStripes) {
  const std::vector<double> dark(5, 0.1), lit(3, 0.9);
  const auto stripes = [&](int count) {
    std::vector<double> lines = dark;
    for (int i = 0; i < count; ++i) {
      lines.insert(lines.end(), lit.begin(), lit.end());
      lines.insert(lines.end(), dark.begin(), dark.end());
    }
    return lines;
  };
  EXPECT_EQ(striped_part(stripes(4)).size(), 4 * 3 + 3 * 5);
  EXPECT_EQ(striped_part(stripes(4)).front(), 0.9);
  EXPECT_EQ(striped_part(stripes(4)).back(), 0.9);
  EXPECT_EQ(striped_part(stripes(3)).size(), 3 * 3 + 2 * 5 + 2 + 2) << "needs its ends";
  EXPECT_EQ(striped_part(lit), lit);
  EXPECT_TRUE(striped_part(dark).empty());
  EXPECT_TRUE(striped_part({}).empty());
}

TEST(WithoutGlow, OfNothingIsNothing) {
  EXPECT_TRUE(without_glow({}).empty());
  EXPECT_TRUE(without_glow(std::vector<double>(20, 0)).empty());
}

}  // namespace
}  // namespace vlp
