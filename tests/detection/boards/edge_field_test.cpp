// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/edge_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "support/random.h"

namespace vlp {
namespace {

/// Returns a blur that increases towards the rim and along a motion.
double blur_px(const Eigen::Vector2d& at_px, const Eigen::Vector2d& along) {
  const Eigen::Vector2d x = (at_px - Eigen::Vector2d(400, 300)) / 400;
  return 0.8 * std::exp(0.3 * x.squaredNorm() + 0.1 * x.x() - 0.2 * along.x() * along.y());
}

/// Creates samples of this blur with a relative standard deviation in addition to the noise.
std::vector<EdgeSample> make_samples(int count, double excess_sd, double noise = 0.02) {
  Random random(5);
  std::vector<EdgeSample> all;
  for (int i = 0; i < count; ++i) {
    const double u = random.uniform(50, 750), v = random.uniform(50, 550);
    const double angle = random.uniform(0, 3);
    const Eigen::Vector2d at(u, v), along(std::cos(angle), std::sin(angle));
    const double off = excess_sd * random.normal() + noise * random.normal();
    all.push_back({at, along, blur_px(at, along) * std::exp(off), noise});
  }
  return all;
}

TEST(EdgeField, ReturnsSampleValuesExactlyWithoutNoise) {
  const auto all = make_samples(60, 0, 0);
  const EdgeField field(all, EdgeField::Terms::position_and_direction);
  for (const EdgeSample& sample : all) {
    EXPECT_NEAR(field.evaluate_field_at_edge(sample.at_px, sample.along) / sample.value, 1, 1e-6);
  }
}

TEST(EdgeField, ExcessRelativeSdOfEdgesMatchesScatterBeyondNoise) {
  for (const double excess_sd : {0.05, 0.2}) {
    const EdgeField field(make_samples(300, excess_sd), EdgeField::Terms::position_and_direction);
    EXPECT_NEAR(field.excess_relative_sd_of_edges() / excess_sd, 1, 0.15);
  }
  const EdgeField alike(make_samples(300, 0), EdgeField::Terms::position_and_direction);
  EXPECT_LE(alike.excess_relative_sd_of_edges(), 0.012);
  const EdgeField without_direction(make_samples(300, 0), EdgeField::Terms::position);
  EXPECT_GT(without_direction.excess_relative_sd_of_edges(), 0.05);
}

TEST(EdgeField, ReturnsTrueBlurDespiteOutliersAmongSamples) {
  auto all = make_samples(100, 0);
  for (std::size_t i = 0; i < all.size(); i += 8) all[i].value *= 4;
  const EdgeField field(all, EdgeField::Terms::position_and_direction);
  const EdgeSample& sample = all[1];
  EXPECT_NEAR(field.evaluate_field_at_edge(sample.at_px, sample.along) /
                  blur_px(sample.at_px, sample.along),
              1, 0.03);
}

TEST(EdgeField, VariesOverImageFor32SamplesOrMore) {
  const auto ratio_across_image = [](int count) {
    const EdgeField field(make_samples(count, 0), EdgeField::Terms::position);
    return field.evaluate_field_at_edge({100, 100}, {1, 0}) /
           field.evaluate_field_at_edge({700, 500}, {1, 0});
  };
  EXPECT_EQ(ratio_across_image(31), 1);
  EXPECT_GT(std::abs(ratio_across_image(32) - 1), 0.01);
}

TEST(EdgeField, ReturnsGeometricMeanEverywhereForThreeSamples) {
  const std::vector<EdgeSample> few{
      {{10, 10}, {1, 0}, 0.5, 0.1}, {{90, 10}, {1, 0}, 0.8, 0.1}, {{50, 80}, {0, 1}, 2.0, 0.1}};
  const EdgeField field(few, EdgeField::Terms::position);
  EXPECT_EQ(field.evaluate_field_at_edge({0, 0}, {1, 0}),
            field.evaluate_field_at_edge({500, 700}, {0, 1}));
  EXPECT_NEAR(field.evaluate_field_at_edge({0, 0}, {1, 0}), 0.9, 0.2);
  // The samples have equal weights: no residual exceeds three standard deviations.
  EXPECT_NEAR(field.evaluate_field_at_edge({0, 0}, {1, 0}), std::cbrt(0.5 * 0.8 * 2.0), 1e-6);
  EXPECT_GT(field.excess_relative_sd_of_edges(), 0.3);
}

std::vector<EdgeSample> make_samples_at_one_place(const std::vector<double>& logs, double sd) {
  std::vector<EdgeSample> samples;
  for (const double log : logs) samples.push_back({{100, 100}, {1, 0}, std::exp(log), sd});
  return samples;
}

// The scatter is the median magnitude of the residuals divided by 0.6745.
TEST(EdgeField, ExcessRelativeSdIsScatterWithoutMedianVariance) {
  std::vector<double> logs;
  for (int i = 0; i < 10; ++i) logs.insert(logs.end(), {-0.4, 0.4});
  const EdgeField field(make_samples_at_one_place(logs, 0.3), EdgeField::Terms::position);
  EXPECT_NEAR(field.evaluate_field_at_edge({0, 0}, {1, 0}), 1, 1e-9);
  EXPECT_NEAR(field.excess_relative_sd_of_edges(), std::sqrt(std::pow(0.4 / 0.6745, 2) - 0.3 * 0.3),
              1e-6);
  const EdgeField precise(make_samples_at_one_place({0, 0, 0}, 0.3), EdgeField::Terms::position);
  EXPECT_NEAR(precise.excess_relative_sd_of_edges(), 0.01, 1e-12);
}

// One outlier has the weight of a residual of three standard deviations. The value c minimizes
//   30 c = 3 (d + c) / 0.6745
// with 15 samples each at -d and d, whose median residual is d + c.
TEST(EdgeField, OutlierHasWeightOfThreeStandardDeviations) {
  constexpr double d = 0.1;
  std::vector<double> logs{5};
  for (int i = 0; i < 15; ++i) logs.insert(logs.end(), {-d, d});
  const EdgeField field(make_samples_at_one_place(logs, 0.01), EdgeField::Terms::position);
  const double ratio = 3 / (0.6745 * 30);
  EXPECT_NEAR(std::log(field.evaluate_field_at_edge({0, 0}, {1, 0})), d * ratio / (1 - ratio),
              1e-4 * d);
}

TEST(EdgeField, WeightsSamplesByInverseVariance) {
  std::vector<EdgeSample> samples;
  for (int i = 0; i < 10; ++i) {
    samples.push_back({{10, 10}, {1, 0}, std::exp(0.1), 1});
    samples.push_back({{10, 10}, {1, 0}, std::exp(-0.1), 2});
  }
  // The excess is 0.01: weights 1 / (1 + 1e-4) and 1 / (4 + 1e-4).
  const double heavy = 1 / (1 + 1e-4), light = 1 / (4 + 1e-4);
  const EdgeField field(samples, EdgeField::Terms::position);
  EXPECT_NEAR(std::log(field.evaluate_field_at_edge({10, 10}, {1, 0})),
              0.1 * (heavy - light) / (heavy + light), 1e-7);
}

TEST(EdgeField, DependsOnDirectionOnlyWithTermsOfDirection) {
  const auto all = make_samples(200, 0, 0);
  const EdgeField position(all, EdgeField::Terms::position);
  EXPECT_EQ(position.evaluate_field_at_edge({200, 100}, {1, 0}),
            position.evaluate_field_at_edge({200, 100}, {0.6, 0.8}));
  const EdgeField field(all, EdgeField::Terms::position_and_direction);
  for (const Eigen::Vector2d& along : {Eigen::Vector2d(1, 0), {0.6, 0.8}, {-0.8, 0.6}, {0, 1}}) {
    for (const Eigen::Vector2d& at_px : {Eigen::Vector2d(200, 100), {20, 590}, {790, 300}}) {
      EXPECT_NEAR(field.evaluate_field_at_edge(at_px, along) / blur_px(at_px, along), 1, 1e-6);
      EXPECT_NEAR(field.evaluate_field_at_edge(at_px, -along) / blur_px(at_px, along), 1, 1e-6);
    }
  }
}

}  // namespace
}  // namespace vlp
