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

}  // namespace
}  // namespace vlp
