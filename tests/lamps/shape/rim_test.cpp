// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/rim.h"
#include "lamps/signal/frequency_identification.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "frontend/mat_view.h"
#include "lamps/drawn_lamp.h"
#include "lamps/light_detector.h"

namespace vlp {
namespace {

using Eigen::Vector2d;

const cv::Size kSize(300, 280);

Blob largest_blob(const ImageView& image, const Background& background) {
  const auto blobs = group_into_blobs(list_pixel_runs(image, background.threshold), 24);
  if (blobs.empty()) throw std::runtime_error("the image has no blob");
  return *std::max_element(blobs.begin(), blobs.end(), [](const Blob& a, const Blob& b) {
    return a.blob_bounding_box().area_px() < b.blob_bounding_box().area_px();
  });
}

/// Fits the rim of the largest light of an image.
std::optional<MeasuredLight> rim_in(const cv::Mat& pixels, double period_lines,
                                    const std::optional<KnownRadius>& radius = {}) {
  const ImageView image = to_image_view(pixels);
  const Background background = estimate_background_of(image);
  return fit_rim_of_light(image, largest_blob(image, background), period_lines, background,
                          LightShape(drawn_camera(pixels.size())), radius);
}

/// Returns a downlight with a core off the middle in this direction.
DrawnLamp downlight(double angle_rad, double period_lines) {
  DrawnRecess recess;
  recess.core_off_px = 16 * Vector2d(std::cos(angle_rad), std::sin(angle_rad));
  return {.center = {151.3, 139.6},
          .radius_px = 50.7,
          .blur_px = 1.2,
          .level = 0.8,
          .stripes = {.period_lines = period_lines},
          .recess = recess};
}

template <typename Test>
void for_each_downlight(const Test& test) {
  std::uint64_t seed = 0;
  for (const double period : {12.0, 17.0, 26.0, 33.0}) {
    for (const double noise : {0.5, 1.0, 2.0}) {
      for (int i = 0; i < 8; ++i) {
        SCOPED_TRACE(testing::Message() << period << " lines, noise " << noise << ", " << i);
        const DrawnLamp lamp = downlight(i * std::numbers::pi / 4 + 0.2, period);
        for (const int depth : {CV_8U, CV_16U}) test(lamp, depth, noise, ++seed);
      }
    }
  }
}

TEST(FitRimOfLight, CenterAndRadiusMatchDownlightForAllCorePositions) {
  double chi_square = 0, worst_px = 0, count = 0;
  for_each_downlight([&](const DrawnLamp& lamp, int depth, double noise, std::uint64_t seed) {
    const auto rim =
        rim_in(render_lamps({lamp}, kSize, depth, noise, seed), lamp.stripes.period_lines);
    ASSERT_TRUE(rim);
    EXPECT_NEAR(rim->radius_px, lamp.radius_px, 1);
    const double error_px = (rim->pixel - lamp.center).norm();
    worst_px = std::max(worst_px, error_px);
    chi_square += std::pow(error_px / rim->sigma_px, 2) / 2;
    ++count;
  });
  EXPECT_LT(worst_px, 0.5) << "the core is 16 px off";
  EXPECT_LT(chi_square / count, 1.5);
  EXPECT_GT(chi_square / count, 0.1);
}

/// Applies the tone curve of a consumer camera.
cv::Mat coded(const cv::Mat& image) {
  cv::Mat1b curve(1, 256);
  for (int i = 0; i < 256; ++i) {
    curve(i) = cv::saturate_cast<std::uint8_t>(255 * std::pow(i / 255.0, 1 / 2.2));
  }
  cv::Mat result;
  cv::LUT(image, curve, result);
  return result;
}

TEST(FitRimOfLight, CenterIsUnbiasedUnderToneCurve) {
  double towards_px = 0, squares = 0, chi_square = 0, worst = 0;
  int count = 0;
  for (const double period : {12.0, 17.0, 26.0, 33.0}) {
    for (int i = 0; i < 12; ++i) {
      const double angle = i * std::numbers::pi / 6 + 0.2;
      const DrawnLamp lamp = downlight(angle, period);
      const auto rim =
          rim_in(coded(render_lamps({lamp}, kSize, CV_8U, 1, std::uint64_t(++count))), period);
      ASSERT_TRUE(rim);
      const Vector2d error = rim->pixel - lamp.center;
      towards_px += error.dot(Vector2d(std::cos(angle), std::sin(angle)));
      squares += error.squaredNorm();
      chi_square += error.squaredNorm() / 2 / std::pow(rim->sigma_px, 2);
      worst = std::max(worst, error.norm() / rim->sigma_px);
    }
  }
  EXPECT_NEAR(towards_px / count, 0, 0.03);
  EXPECT_LT(std::sqrt(squares / count), 0.1);
  EXPECT_LT(chi_square / count, 1.5);
  EXPECT_LT(worst, 6);
}

/// Renders a lamp with the tone curve of a consumer camera; levels above white are clipped.
cv::Mat1b coded_and_clipped(const DrawnLamp& lamp, double noise, Random& random) {
  cv::Mat1b image(kSize);
  for (int row = 0; row < image.rows; ++row) {
    for (int column = 0; column < image.cols; ++column) {
      const double light = 0.002 + lamp.light(Vector2d(column, row));
      image(row, column) =
          cv::saturate_cast<std::uint8_t>(255 * std::pow(light, 1 / 2.2) + noise * random.normal());
    }
  }
  return image;
}

TEST(FitRimOfLight, CenterIsUnbiasedNextToSaturatedWalls) {
  Random random(1);
  for (const double white : {0.8, 1.5, 2.0, 4.0}) {
    double towards_px = 0, chi_square = 0, worst = 0;
    int count = 0;
    for (const double period : {17.0, 26.0}) {
      for (int i = 0; i < 8; ++i) {
        const double angle = i * std::numbers::pi / 4 + 0.2;
        const Vector2d towards(std::cos(angle), std::sin(angle));
        DrawnLamp lamp = downlight(angle, period);
        lamp.level = white;
        lamp.recess->core_off_px = 36 * towards;
        lamp.recess->core_px = 24;
        const auto rim = rim_in(coded_and_clipped(lamp, 1, random), period);
        ASSERT_TRUE(rim);
        const Vector2d error = rim->pixel - lamp.center;
        towards_px += error.dot(towards);
        chi_square += error.squaredNorm() / 2 / std::pow(rim->sigma_px, 2);
        worst = std::max(worst, error.norm() / rim->sigma_px);
        ++count;
      }
    }
    EXPECT_NEAR(towards_px / count, 0, 0.06) << white;
    EXPECT_LT(chi_square / count, 1.5) << white;
    EXPECT_LT(worst, 6) << white;
  }
}

TEST(LightDetector, IdentifiesDownlightsOnlyWithReliableNumberOfPeriods) {
  int identified = 0;
  for_each_downlight([&](const DrawnLamp& lamp, int depth, double noise, std::uint64_t seed) {
    const LampMap map{{drawn_lamp(7, lamp.stripes.period_lines), drawn_lamp(8, 14.5)}};
    const auto lights =
        LightDetector(map, drawn_camera(kSize))
            .detect_lights(to_image_view(render_lamps({lamp}, kSize, depth, noise, seed)));
    ASSERT_EQ(lights.size(), 1U);
    if (lights[0].stripes.periods < kMinReliablePeriods) {
      EXPECT_EQ(lights[0].reason, LightReason::too_few_periods);
    } else {
      EXPECT_EQ(lights[0].kind, LightKind::lamp);
      EXPECT_EQ(lights[0].lamp, 7);
      ++identified;
    }
    // The period is measured with an envelope that decreases to a tenth within two periods.
    EXPECT_NEAR(lights[0].stripes.period_lines / lamp.stripes.period_lines, 1, 2 * kLampDrift);
    EXPECT_LT((lights[0].pixel - lamp.center).norm(), 1);
  });
  EXPECT_GT(identified, 0);
}

}  // namespace
}  // namespace vlp
