// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/edge_fit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <tuple>

namespace vlp {
namespace {

/// Edge of 40 px with a tone curve and a black stripe of 3 px, which white bits adjoin along one
/// half of the edge.
struct Step {
  double off_px = 0.31, slope_px = 0.2, bow_px = -0.15, blur_px = 0.8;
  double black = 16, white = 200, gamma = 1;
  double stripe_px = 3, clipped_at = 255, noise = 0;
  double glow_fraction = 0, glow_blur_px = 1;  // light with another blur

  double level(double w, double v, double white_behind) const {
    const double e = v - off_px - slope_px * w - bow_px * w * w;
    const auto blurred_step = [&](double x) {
      const double scaled = -x / std::numbers::sqrt2;
      return (1 - glow_fraction) * std::erfc(scaled / blur_px) / 2 +
             glow_fraction * std::erfc(scaled / glow_blur_px) / 2;
    };
    const double light =
        black + (white - black) * (blurred_step(e) + white_behind * blurred_step(-e - stripe_px));
    return 255 * std::pow(light / 255, 1 / gamma);
  }

  std::vector<EdgePixel> pixels(unsigned seed = 1) const {
    std::mt19937 generator(seed);
    std::normal_distribution<double> normal;
    std::vector<EdgePixel> all;
    for (double x = -19.5; x < 20; ++x) {
      for (double v = -1.3; v < 4; ++v) {
        const double behind = x > 0 ? 1 : 0;
        const double seen = level(x / 20, v, behind) + noise * normal(generator);
        all.push_back({x / 20, v, std::min(seen, clipped_at), stripe_px, behind});
      }
    }
    return all;
  }

  EdgeCurve start() const {
    EdgeCurve edge;
    edge.middle = {100, 100};
    edge.along = {1, 0};
    edge.across = {0, 1};
    edge.half_length_px = 20;
    return edge;
  }

  void expect_found(const EdgeCurve& edge, double tolerance_px) const {
    EXPECT_NEAR(edge.coefficients[0], off_px, tolerance_px);
    EXPECT_NEAR(edge.coefficients[1], slope_px, tolerance_px);
    EXPECT_NEAR(edge.coefficients[2], bow_px, tolerance_px);
    EXPECT_NEAR(edge.blur_px, blur_px, tolerance_px);
  }
};

TEST(FitEdgeCurveAndBlur, RecoversEdgeExactlyWithoutNoise) {
  const Step step;
  EdgeCurve edge = step.start();
  const auto fit = fit_edge_curve_and_blur(edge, step.pixels(), {});
  ASSERT_TRUE(fit);
  step.expect_found(edge, 1e-3);
  EXPECT_LT(fit->sum_of_squares, 1e-3);
  EXPECT_FALSE(fit->is_saturated);
}

TEST(FitEdgeCurveAndBlur, RecoversEdgeExactlyWithGivenToneCurve) {
  for (const double gamma : {1.3, 2.4}) {
    const Step step{.gamma = gamma};
    EdgeCurve edge = step.start();
    ASSERT_TRUE(fit_edge_curve_and_blur(edge, step.pixels(), {gamma}));
    step.expect_found(edge, 1e-3);
    EdgeCurve without = step.start();
    const auto wrong = fit_edge_curve_and_blur(without, step.pixels(), {});
    ASSERT_TRUE(wrong);
    EXPECT_GT(wrong->sum_of_squares, 100);
  }
}

TEST(FitEdgeCurveAndBlur, MovesEdgeOutwardsWhenWhiteBitsAreNotModeled) {
  const Step step;
  auto pixels = step.pixels();
  for (EdgePixel& pixel : pixels) pixel.white_behind = 0;
  EdgeCurve edge = step.start();
  ASSERT_TRUE(fit_edge_curve_and_blur(edge, pixels, {}));
  EXPECT_GT(edge.coefficients[0], step.off_px + 0.02);
}

TEST(FitEdgeCurveAndBlur, RecoversEdgeWithSaturatedOuterSide) {
  for (const double gamma : {1.0, 2.2}) {
    const Step step{.white = 380, .gamma = gamma, .clipped_at = 255};
    EdgeCurve edge = step.start();
    const auto fit = fit_edge_curve_and_blur(edge, step.pixels(), {gamma});
    ASSERT_TRUE(fit);
    EXPECT_TRUE(fit->is_saturated);
    EXPECT_GT(fit->blur_variance, 0);
    step.expect_found(edge, 2e-3);
  }
}

/// Tags of some families are white inside.
TEST(FitEdgeCurveAndBlur, RecoversEdgeWithSaturatedInnerSide) {
  const Step step{.black = 380, .white = 16, .stripe_px = 100};
  auto pixels = step.pixels();
  for (EdgePixel& pixel : pixels) pixel.white_behind = 0;
  EdgeCurve edge = step.start();
  const auto fit = fit_edge_curve_and_blur(edge, pixels, {});
  ASSERT_TRUE(fit);
  EXPECT_TRUE(fit->is_saturated);
  step.expect_found(edge, 2e-3);
}

/// Returns the RMS error of the position of an edge over several realizations of the noise.
double scatter_px(const Step& step, const EdgePrior& prior) {
  constexpr unsigned sets = 60;
  double squares = 0;
  for (unsigned seed = 1; seed <= sets; ++seed) {
    EdgeCurve edge = step.start();
    const auto fit = fit_edge_curve_and_blur(edge, step.pixels(seed), prior);
    EXPECT_TRUE(fit);
    squares += std::pow(edge.coefficients[0] - step.off_px, 2) / sets;
  }
  return std::sqrt(squares);
}

TEST(FitEdgeCurveAndBlur, PositionScatterHardlyIncreasesForNearlySaturatedPaper) {
  const double other_px = scatter_px({.white = 240, .noise = 1.5}, {});
  const double bright_px = scatter_px({.white = 252, .noise = 1.5}, {});
  EXPECT_LT(bright_px, 1.2 * other_px);
}

TEST(FitEdgeCurveAndBlur, BlurAndLightPriorsReduceScatterOfSaturatedEdge) {
  const Step step{.white = 380, .gamma = 2.2, .noise = 1};
  const double alone_px = scatter_px(step, {step.gamma});
  const double held_px = scatter_px(step, {step.gamma, step.blur_px, 60});
  EXPECT_LT(held_px, 0.5 * alone_px);
  // With the light, too.
  const double lit_px = scatter_px(step, {step.gamma, step.blur_px, 60, step.white, 1});
  EXPECT_LT(lit_px, 0.6 * held_px);
}

TEST(FitEdgeCurveAndBlur, ReportedVariancesOfLightAndBlurMatchErrors) {
  const Step step{.white = 380, .gamma = 2.2, .noise = 1}, seen{.gamma = 2.2, .noise = 1};
  constexpr unsigned sets = 100;
  double lights = 0, blurs = 0;
  for (unsigned seed = 1; seed <= sets; ++seed) {
    EdgeCurve edge = step.start();
    // Together they are known too badly for a linear theory.
    const auto lit =
        fit_edge_curve_and_blur(edge, step.pixels(seed), {step.gamma, step.blur_px, 100});
    ASSERT_TRUE(lit);
    lights += std::pow(lit->bright_light - step.white, 2) / lit->bright_variance / sets;
    edge = seen.start();
    const auto blurred = fit_edge_curve_and_blur(edge, seen.pixels(seed), {seen.gamma});
    ASSERT_TRUE(blurred);
    blurs += std::pow(edge.blur_px - seen.blur_px, 2) / blurred->blur_variance / sets;
  }
  EXPECT_NEAR(lights, 1, 0.35);
  EXPECT_NEAR(blurs, 1, 0.35);
}

TEST(FitEdgeCurveAndBlur, RecoversDimEdgeWithSteepestToneCurve) {
  const Step step{.black = 0.3, .white = 5, .gamma = 2.4};  // levels of 15 and 49
  EdgeCurve edge = step.start();
  ASSERT_TRUE(fit_edge_curve_and_blur(edge, step.pixels(), {step.gamma}));
  step.expect_found(edge, 5e-3);
}

TEST(FitEdgeCurveAndBlur, EquivalentBlurOfGaussianIsItsSigma) {
  for (const double blur_px : {0.5, 0.8, 1.2}) {
    const Step step{.blur_px = blur_px, .stripe_px = 10};
    EdgeCurve edge = step.start();
    const auto fit = fit_edge_curve_and_blur(edge, step.pixels(), {});
    ASSERT_TRUE(fit);
    EXPECT_NEAR(fit->equivalent_blur_px, blur_px, 1e-3);
  }
}

/// The line spread is far from Gaussian, so that the change of the blur is not linear.
TEST(FitEdgeCurveAndBlur, EquivalentBlurIsFittedBlurForNarrowCoreInWideGlow) {
  const Step step{.blur_px = 0.5, .stripe_px = 10, .glow_fraction = 0.7, .glow_blur_px = 1.5};
  EdgeCurve edge = step.start();
  const auto fit = fit_edge_curve_and_blur(edge, step.pixels(), {});
  ASSERT_TRUE(fit);
  EXPECT_NEAR(edge.blur_px, 0.8, 0.05);
  EXPECT_EQ(fit->equivalent_blur_px, edge.blur_px);
}

TEST(FitEdgeCurveAndBlur, RequiresSixGrayLevelsAcrossEdge) {
  for (const auto& [black, white, is_accepted] :
       {std::tuple{100., 107., true}, {100., 105., false}}) {
    const Step step{.black = black, .white = white};
    EdgeCurve edge = step.start();
    EXPECT_EQ(fit_edge_curve_and_blur(edge, step.pixels(), {}).has_value(), is_accepted) << white;
  }
}

TEST(FitEdgeCurveAndBlur, ReturnsNulloptForNoiseOrFewPixels) {
  Step step{.black = 99, .white = 101, .noise = 30};
  EdgeCurve edge = step.start();
  EXPECT_FALSE(fit_edge_curve_and_blur(edge, step.pixels(), {}));
  auto few = Step().pixels();
  few.resize(20);
  EXPECT_FALSE(fit_edge_curve_and_blur(edge, few, {}));
}

TEST(FindEdgeIntersection, ReturnsPointOnBothCurves) {
  EdgeCurve flat = Step().start(), upright = flat;
  flat.coefficients << 0.5, 0.1, -0.3, 0.05;
  upright.along = {0, 1};
  upright.across = {-1, 0};
  upright.coefficients << -0.2, 0.3, 0.2, 0;
  const Eigen::Vector2d at = find_edge_intersection(flat, upright, {101, 99});
  EXPECT_LT(std::abs(flat.distance_from_curve_px(at)), 1e-12);
  EXPECT_LT(std::abs(upright.distance_from_curve_px(at)), 1e-12);
}

TEST(FitEdgeCurveAndBlur, Requires24Pixels) {
  auto pixels = Step().pixels();
  std::vector<EdgePixel> some;
  for (std::size_t i = 0; some.size() < 24; i += 9) some.push_back(pixels[i]);
  EdgeCurve edge = Step().start();
  EXPECT_TRUE(fit_edge_curve_and_blur(edge, some, {}));
  some.pop_back();
  edge = Step().start();
  EXPECT_FALSE(fit_edge_curve_and_blur(edge, some, {}));
}

TEST(FitEdgeCurveAndBlur, RequiresRmsBelow35PercentOfContrast) {
  for (const auto& [noise, is_accepted] : {std::pair(14.0, true), std::pair(22.0, false)}) {
    const Step step{.black = 70, .white = 170, .stripe_px = 10, .noise = noise};
    EdgeCurve edge = step.start();
    EXPECT_EQ(fit_edge_curve_and_blur(edge, step.pixels(), {}).has_value(), is_accepted) << noise;
  }
}

/// Creates pixels up to 20 px from an edge with a given blur.
std::vector<EdgePixel> make_wide_band(double blur_px) {
  std::vector<EdgePixel> pixels;
  for (double x = -19.5; x < 20; ++x) {
    for (double v = -20.3; v < 20; ++v) {
      const double level = 110 + 80 * std::erf(v / (std::numbers::sqrt2 * blur_px));
      pixels.push_back({x / 20, v, level, 100, 0});
    }
  }
  return pixels;
}

TEST(FitEdgeCurveAndBlur, RequiresBlurBetween0p05And6Pixels) {
  for (const auto& [blur_px, is_accepted] : {std::pair(5.5, true), std::pair(6.5, false)}) {
    EdgeCurve edge = Step().start();
    edge.blur_px = 4;
    EXPECT_EQ(fit_edge_curve_and_blur(edge, make_wide_band(blur_px), {}).has_value(), is_accepted);
    EXPECT_NEAR(edge.blur_px, blur_px, 0.01);
  }
  // A strong prior determines the blur.
  for (const auto& [blur_px, is_accepted] : {std::pair(0.06, true), std::pair(0.04, false)}) {
    EdgeCurve edge = Step().start();
    edge.blur_px = blur_px;
    auto pixels = make_wide_band(1e-3);
    EXPECT_EQ(fit_edge_curve_and_blur(edge, pixels, {1, blur_px, 1e5}).has_value(), is_accepted);
  }
}

// Saturation is decided by the pixels on the brighter side with level 254 or more.
TEST(FitEdgeCurveAndBlur, IsSaturatedFor25PercentWhitePixels) {
  for (const bool is_inside : {false, true}) {
    for (const auto& [one_of, level, is_saturated] :
         {std::tuple{4U, 254., true}, {4U, 253.9, false}, {5U, 255., false}}) {
      auto pixels = make_wide_band(0.8);
      std::size_t count = 0;
      for (EdgePixel& pixel : pixels) {
        if (is_inside) pixel.across_px = -pixel.across_px;
        pixel.level += 55;
        const bool is_bright = is_inside ? pixel.across_px < 0 : pixel.across_px > 0;
        if (is_bright && count++ % one_of == 0) pixel.level = level;
      }
      EdgeCurve edge = Step().start();
      const auto fit = fit_edge_curve_and_blur(edge, pixels, {});
      ASSERT_TRUE(fit);
      EXPECT_EQ(fit->is_saturated, is_saturated) << one_of << " " << level << " " << is_inside;
    }
  }
}

TEST(FitEdgeCurveAndBlur, StartsFromLightOfPreviousFitWithOtherToneCurve) {
  for (const bool is_white_inside : {false, true}) {
    Step step{.gamma = 2.4, .stripe_px = 100};
    if (is_white_inside) std::swap(step.black, step.white);
    auto pixels = step.pixels();
    for (EdgePixel& pixel : pixels) {
      pixel.white_behind = 0;
      const double light = 255 * std::pow(pixel.level / 255, step.gamma);
      pixel.level = 255 * std::pow(light * (1 + 0.1 * pixel.along) / 255, 1 / step.gamma);
    }
    EdgeCurve edge = step.start();
    const auto linear = fit_edge_curve_and_blur(edge, pixels, {1.3});
    ASSERT_TRUE(linear);
    const auto fit = fit_edge_curve_and_blur(edge, pixels, {2.4}, &*linear);
    ASSERT_TRUE(fit);
    step.expect_found(edge, 1e-3);
    EXPECT_FALSE(fit->is_saturated);
    EXPECT_NEAR(fit->bright_light, std::max(step.white, step.black), 0.1);
    EXPECT_NEAR(fit->dark_light, std::min(step.white, step.black), 0.1);
    EXPECT_NEAR(fit->light.slope[0], 0.1, 1e-3);
  }
}

/// Line spread of a Gaussian and a box, as of a pixel: the step is known as an integral of erf.
TEST(FitEdgeCurveAndBlur, EquivalentBlurMatchesMtf50OfGaussianWithBox) {
  for (const auto& [sigma_px, width_px] :
       {std::pair(0.6, 1.0), std::pair(0.5, 2.0), std::pair(0.7, 2.5)}) {
    const auto integral = [sigma = sigma_px](double x) {
      const double u = x / (std::numbers::sqrt2 * sigma);
      return x * std::erf(u) + sigma * std::sqrt(2 / std::numbers::pi) * std::exp(-u * u);
    };
    std::vector<EdgePixel> pixels;
    for (double x = -19.5; x < 20; ++x) {
      for (double v = -4.3; v < 5; ++v) {
        const double at = v - 0.31 - 0.4 * x / 20;
        const double step = (integral(at + width_px / 2) - integral(at - width_px / 2)) / width_px;
        pixels.push_back({x / 20, v, 110 + 80 * step, 100, 0});
      }
    }
    EdgeCurve edge = Step().start();
    const auto fit = fit_edge_curve_and_blur(edge, pixels, {});
    ASSERT_TRUE(fit);
    // exp(-s^2 / 2) is 0.5 at the frequency (rad / px) where the transfer is 0.5.
    double low = 0, high = 3;
    for (int i = 0; i < 50; ++i) {
      const double f = (low + high) / 2, x = f * width_px / 2;
      (std::exp(-f * f * sigma_px * sigma_px / 2) * std::sin(x) / x > 0.5 ? low : high) = f;
    }
    const double expected_px = std::sqrt(2 * std::numbers::ln2) / low;
    EXPECT_NEAR(fit->equivalent_blur_px / expected_px, 1, 0.012) << sigma_px << " " << width_px;
  }
}

TEST(EdgeCurve, GradientOfDistanceMatchesDifferenceQuotients) {
  EdgeCurve edge = Step().start();
  edge.along = {0.8, 0.6};
  edge.across = {-0.6, 0.8};
  edge.coefficients << 0.5, -1.1, 0.7, 1.3;
  constexpr double h = 1e-5;
  for (const Eigen::Vector2d& x : {Eigen::Vector2d(103, 99), {88, 92}, {118, 111}}) {
    const Eigen::Vector2d gradient = edge.compute_gradient_of_curve_distance_wrt_pixel(x);
    for (const Eigen::Index i : {0, 1}) {
      const Eigen::Vector2d step = h * Eigen::Vector2d::Unit(i);
      EXPECT_NEAR(
          gradient[i],
          (edge.distance_from_curve_px(x + step) - edge.distance_from_curve_px(x - step)) / (2 * h),
          1e-8);
    }
  }
}

}  // namespace
}  // namespace vlp
