// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Fits of noisy edges compared with numeric derivatives of the model: optimum and variances.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include "detection/boards/edge_fit.h"

namespace vlp {
namespace {

/// Edge of 30 px with all effects of the model, and a fit of it.
struct NoisyEdge {
  std::string name;
  double gamma = 1, middle = 110, contrast = 80, noise = 4, white = 255;
  EdgePrior prior = {};
  bool is_cubic = false;
  double kurtosis = 0;

  /// Parameters: blur, middle, contrast, slopes of the light along and across, coefficients,
  /// excess kurtosis.
  using Parameters = Eigen::VectorXd;

  Parameters true_parameters() const {
    Parameters p(10);
    p << 0.9, middle, contrast, 0.06, -0.012, 0.23, -0.31, 0.27, is_cubic ? 0.4 : 0, kurtosis;
    return p;
  }
  double compute_level(const Parameters& p, const EdgePixel& pixel) const {
    const double w = pixel.along, v = pixel.across_px;
    const double e = v - p[5] - p[6] * w - p[7] * w * w - p[8] * w * w * w;
    const auto blurred_step = [&](double x) {  // integral of the Gram-Charlier series
      const double u = x / p[0];
      return std::erf(u / std::numbers::sqrt2) +
             p[9] * u * (3 - u * u) / 12 * std::exp(-u * u / 2) / std::sqrt(2 * std::numbers::pi);
    };
    const double step =
        blurred_step(e) + pixel.white_behind * (1 + blurred_step(-e - pixel.stripe_px));
    const double light = (p[1] + p[2] * step) * (1 + p[3] * w + p[4] * v);
    return 255 * std::pow(std::max(light, 1e-3) / 255, 1 / gamma);
  }
  std::vector<EdgePixel> render() const {
    std::mt19937 generator(3);
    std::normal_distribution<double> normal(0, noise);
    std::vector<EdgePixel> pixels;
    for (double x = -14.3; x < 15; ++x) {
      for (double v = -2.2; v < 3; ++v) {
        EdgePixel pixel{x / 15, v, 0, 2.6 + 0.3 * x / 15, x < 3 ? 0.7 : 0};
        pixel.level = compute_level(true_parameters(), pixel) + normal(generator);
        pixel.level = std::clamp(pixel.level, 0.0, white);
        pixels.push_back(pixel);
      }
    }
    return pixels;
  }
  EdgeCurve make_start() const {
    EdgeCurve edge;
    edge.middle = {100, 100};
    edge.along = {1, 0};
    edge.across = {0, 1};
    edge.half_length_px = 15;
    edge.cubic = is_cubic;
    return edge;
  }

  /// Returns the residuals of all pixels and of the prior.
  Eigen::VectorXd compute_residuals(const Parameters& p, const std::vector<EdgePixel>& pixels,
                                    bool is_saturated) const {
    const double max_level = is_saturated ? 250 : INFINITY;
    Eigen::VectorXd residuals(static_cast<Eigen::Index>(pixels.size()) + 2);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      residuals[static_cast<Eigen::Index>(i)] =
          std::min(compute_level(p, pixels[i]), max_level) - std::min(pixels[i].level, max_level);
    }
    residuals.tail<2>() << prior.blur_weight * (p[0] - prior.blur_px),
        prior.bright_weight * (p[1] + std::abs(p[2]) - prior.bright_light);
    return residuals;
  }
  /// Returns the derivatives by the fitted parameters and, in the last column, by the kurtosis.
  Eigen::MatrixXd compute_jacobian(const Parameters& p, const std::vector<EdgePixel>& pixels,
                                   bool is_saturated) const {
    constexpr double h = 1e-5;
    const Eigen::Index parameters = is_cubic ? 9 : 8;
    Eigen::MatrixXd jacobian(static_cast<Eigen::Index>(pixels.size()) + 2, parameters + 1);
    for (Eigen::Index i = 0; i <= parameters; ++i) {
      const Parameters step = h * Parameters::Unit(10, i < parameters ? i : 9);
      jacobian.col(i) = (compute_residuals(p + step, pixels, is_saturated) -
                         compute_residuals(p - step, pixels, is_saturated)) /
                        (2 * h);
    }
    return jacobian;
  }

  friend void PrintTo(const NoisyEdge& edge, std::ostream* out) { *out << edge.name; }
};

class FitEdgeCurveAndBlurOptimum : public testing::TestWithParam<NoisyEdge> {
 protected:
  void SetUp() override {
    pixels = GetParam().render();
    EdgePrior prior = GetParam().prior;
    prior.gamma = GetParam().gamma;
    curve = GetParam().make_start();
    const auto fitted = fit_edge_curve_and_blur(curve, pixels, prior);
    ASSERT_TRUE(fitted);
    fit = *fitted;
    p << curve.blur_px, fit.light.middle, fit.light.contrast, fit.light.slope, curve.coefficients,
        0;
    residuals = GetParam().compute_residuals(p, pixels, fit.is_saturated);
    const Eigen::MatrixXd all = GetParam().compute_jacobian(p, pixels, fit.is_saturated);
    jacobian = all.leftCols(all.cols() - 1);
    by_kurtosis = all.rightCols<1>();
  }
  /// Returns the covariance of the first `parameters` for a noise of one gray level.
  Eigen::MatrixXd compute_covariance(Eigen::Index parameters) const {
    const Eigen::MatrixXd part = jacobian.leftCols(parameters);
    return (part.transpose() * part)
        .ldlt()
        .solve(Eigen::MatrixXd::Identity(parameters, parameters));
  }

  std::vector<EdgePixel> pixels;
  EdgeCurve curve;
  EdgeFit fit{};
  Eigen::VectorXd p{10}, residuals, by_kurtosis;
  Eigen::MatrixXd jacobian;
};

TEST_P(FitEdgeCurveAndBlurOptimum, ConvergesToMinimumOfSumOfSquares) {
  const Eigen::VectorXd gradient = jacobian.transpose() * residuals;
  const double decrease = gradient.dot(compute_covariance(jacobian.cols()) * gradient);
  EXPECT_LT(decrease, 1e-4);
}

TEST_P(FitEdgeCurveAndBlurOptimum, SumOfSquaresExcludesPrior) {
  EXPECT_EQ(fit.pixels, pixels.size());
  const double squares = residuals.head(residuals.size() - 2).squaredNorm();
  EXPECT_NEAR(fit.sum_of_squares / squares, 1, 1e-6);
}

TEST_P(FitEdgeCurveAndBlurOptimum, EndVarianceMatchesNumericJacobianForKnownCurvature) {
  const Eigen::MatrixXd covariance = compute_covariance(7);
  // The covariances of both coefficients cancel in the mean over both ends.
  EXPECT_NEAR(fit.end_variance / (covariance(5, 5) + covariance(6, 6)), 1, 1e-4);
}

TEST_P(FitEdgeCurveAndBlurOptimum, VariancesOfBlurAndLightMatchNumericJacobian) {
  if (GetParam().gamma == 1 && !fit.is_saturated) {
    EXPECT_EQ(fit.blur_variance, 0);
    EXPECT_EQ(fit.bright_variance, 0);
    return;
  }
  const Eigen::MatrixXd covariance = compute_covariance(jacobian.cols());
  Eigen::VectorXd brighter = Eigen::VectorXd::Zero(jacobian.cols());
  brighter.segment<2>(1) << 1, p[2] < 0 ? -1 : 1;
  EXPECT_NEAR(fit.blur_variance / covariance(0, 0), 1, 1e-4);
  EXPECT_NEAR(fit.bright_variance / brighter.dot(covariance * brighter), 1, 1e-4);
}

TEST_P(FitEdgeCurveAndBlurOptimum, ReportsLightOfBothSides) {
  EXPECT_NEAR(fit.bright_light, p[1] + std::abs(p[2]), 1e-9);
  EXPECT_NEAR(fit.dark_light, p[1] - std::abs(p[2]), 1e-9);
  EXPECT_EQ(fit.light.gamma, GetParam().gamma);
}

// One Gauss-Newton step estimates the kurtosis, with a prior of 0 +- 0.5, between -1.5 and 3.
TEST_P(FitEdgeCurveAndBlurOptimum, EquivalentBlurMatchesMtf50ForKurtosisOfGaussNewtonStep) {
  const double variance =
      std::max(residuals.squaredNorm() / static_cast<double>(residuals.size()), 0.3 * 0.3);
  const Eigen::MatrixXd covariance = compute_covariance(jacobian.cols());
  const Eigen::VectorXd orthogonal =
      by_kurtosis - jacobian * (covariance * (jacobian.transpose() * by_kurtosis));
  const double kurtosis = std::clamp(
      -orthogonal.dot(residuals) / (orthogonal.squaredNorm() + variance / 0.25), -1.5, 3.0);
  const Eigen::VectorXd change =
      -covariance * (jacobian.transpose() * (residuals + kurtosis * by_kurtosis));
  ASSERT_LT(std::abs(change[0]), 0.3 * p[0]);
  double low = 0, high = 1.8;
  for (int i = 0; i < 50; ++i) {
    const double s = (low + high) / 2;
    (std::exp(-s * s / 2) * (1 + kurtosis * s * s * s * s / 24) > 0.5 ? low : high) = s;
  }
  const double expected_px = (p[0] + change[0]) * std::sqrt(2 * std::numbers::ln2) / low;
  EXPECT_NEAR(fit.equivalent_blur_px / expected_px, 1, 1e-4) << kurtosis;
}

INSTANTIATE_TEST_SUITE_P(
    Edges, FitEdgeCurveAndBlurOptimum,
    testing::Values(NoisyEdge{.name = "Linear"},
                    NoisyEdge{.name = "PositiveKurtosis", .noise = 0.5, .kurtosis = 1.2},
                    NoisyEdge{.name = "NegativeKurtosis", .noise = 0.5, .kurtosis = -0.8},
                    NoisyEdge{.name = "LargestKurtosis", .noise = 0.5, .kurtosis = 4.5},
                    NoisyEdge{.name = "SmallestKurtosis", .noise = 0.5, .kurtosis = -3},
                    NoisyEdge{.name = "LowContrast", .contrast = 12, .noise = 0.1, .kurtosis = 1},
                    NoisyEdge{.name = "Cubic", .is_cubic = true},
                    NoisyEdge{.name = "WhiteInside", .contrast = -60},
                    NoisyEdge{.name = "ToneCurve", .gamma = 1.7},
                    NoisyEdge{.name = "ToneCurveWhiteInside", .gamma = 2, .contrast = -60},
                    NoisyEdge{.name = "CubicWithToneCurveAndPriors",
                              .gamma = 1.7,
                              .prior = {1.7, 0.8, 90, 200, 1.4},
                              .is_cubic = true},
                    NoisyEdge{.name = "WhiteInsideWithPriors",
                              .contrast = -60,
                              .prior = {1, 1.1, 120, 160, 2.1}},
                    NoisyEdge{.name = "SaturatedWithPriors",
                              .middle = 180,
                              .contrast = 150,
                              .prior = {1, 0.95, 200, 340, 0.9}}),
    [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace vlp
