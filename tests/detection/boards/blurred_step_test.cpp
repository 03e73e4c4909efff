// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/blurred_step.h"

#include <gtest/gtest.h>

#include <limits>

namespace vlp {
namespace {

TEST(ErrorFunction, ValueAndSlopeMatchStandardLibrary) {
  for (double x = -7; x < 7; x += 0.0007) {
    const ErrorFunction erf(x);
    EXPECT_NEAR(erf.value, std::erf(x), 1e-13) << x;
    EXPECT_NEAR(erf.slope, 2 * std::numbers::inv_sqrtpi * std::exp(-x * x), 1e-11) << x;
  }
}

TEST(ErrorFunction, HasMagnitudeOneForLargeInfiniteAndNanArguments) {
  EXPECT_EQ(ErrorFunction(1e9).value, 1);
  EXPECT_EQ(ErrorFunction(-std::numeric_limits<double>::infinity()).value, -1);
  EXPECT_EQ(std::abs(ErrorFunction(std::numeric_limits<double>::quiet_NaN()).value), 1);
}

TEST(BlurredStep, DerivativesByDistanceAndBlurMatchDifferenceQuotients) {
  constexpr double h = 1e-5;
  for (const double distance_px : {-2.0, -0.3, 0.0, 0.7, 3.0}) {
    for (const double blur_px : {0.3, 0.8, 2.0}) {
      const BlurredStep step(distance_px, Blur(blur_px));
      const double by_distance = BlurredStep(distance_px + h, Blur(blur_px)).value -
                                 BlurredStep(distance_px - h, Blur(blur_px)).value;
      const double d_value_d_blur = BlurredStep(distance_px, Blur(blur_px + h)).value -
                                    BlurredStep(distance_px, Blur(blur_px - h)).value;
      EXPECT_NEAR(step.slope, by_distance / (2 * h), 1e-8);
      EXPECT_NEAR(step.d_value_d_blur, d_value_d_blur / (2 * h), 1e-8);
    }
  }
}

/// The integral of the term of the Gram-Charlier series, by the midpoint rule.
TEST(BlurredStep, KurtosisDerivativeMatchesIntegralOfGramCharlierTerm) {
  constexpr int intervals = 4000;
  for (const double distance_px : {-2.0, -0.3, 0.7, 3.0}) {
    for (const double blur_px : {0.3, 0.8, 2.0}) {
      const double end = distance_px / blur_px;
      double integral = 0;
      for (int i = 0; i < intervals; ++i) {
        const double u = end * (i + 0.5) / intervals;
        integral += std::exp(-u * u / 2) * (std::pow(u, 4) - 6 * u * u + 3) / 24;
      }
      integral *= end / intervals / std::sqrt(2 * std::numbers::pi);
      const BlurredStep step(distance_px, Blur(blur_px));
      EXPECT_NEAR(step.d_value_d_kurtosis, 2 * integral, 1e-6) << distance_px << ", " << blur_px;
    }
  }
}

}  // namespace
}  // namespace vlp
