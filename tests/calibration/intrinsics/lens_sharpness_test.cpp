// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/lens_sharpness.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <random>

#include "support/random.h"

namespace vlp {
namespace {

constexpr std::array kSharpnessImager_px{800, 600};
constexpr double kLensBlur_px = 0.8;

/// Step of the light at a place of a view.
using StepAt = std::function<EdgeStep(const Eigen::Vector2d& at_px, int view)>;

EdgeStep even_step(const Eigen::Vector2d&, int) { return {kLensBlur_px, 14, 190}; }

/// Returns views full of tags of 25 px, displaced from view to view, with noise of 2 % of the blur.
std::vector<BoardView> make_views(const StepAt& step_at, int count = 24) {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, 0.02);
  std::vector<BoardView> views;
  views.reserve(static_cast<std::size_t>(count));
  for (int view = 0; view < count; ++view) {
    BoardView& added = views.emplace_back(BoardView{"view", kSharpnessImager_px, {}});
    for (int i = 0; i < 16 * 12; ++i) {
      const double size_px = 25, x = 50 * (i % 16) + view % 5 * 5, y = 50 * (i / 16) + view % 7 * 3;
      TagDetection tag{i,
                       {{{x, y + size_px}, {x + size_px, y + size_px}, {x + size_px, y}, {x, y}}}};
      for (std::size_t k = 0; k < 4; ++k) {
        const Eigen::Vector2d at_px = (tag.corners_px[k] + tag.corners_px[(k + 1) % 4]) / 2;
        tag.steps[k] = step_at(at_px, view);
        tag.steps[k].blur_px *= 1 + noise(random);
      }
      added.detection.tags.push_back(std::move(tag));
    }
  }
  return views;
}

LensSharpness measured(const StepAt& step_at) {
  return measure_sharpness(make_views(step_at), kSharpnessImager_px).value();
}

TEST(MeasureSharpness, ReturnsMtf50AndNoDefectsForUniformBlur) {
  const LensSharpness even = measured(even_step);
  EXPECT_NEAR(even.mean_mtf50, compute_mtf50_of_blur(kLensBlur_px), 0.02 * even.mean_mtf50);
  EXPECT_GT(even.worst_ratio, 0.97);
  EXPECT_LT(even.asymmetry, 0.02);
  EXPECT_LT(even.local_loss, 0.03);
  EXPECT_LT(even.local_shadow, 0.01);
  EXPECT_NEAR(even.black_level, 14.0 / 190, 1e-6);
}

TEST(MeasureSharpness, ReportsAsymmetryForTiltedFocalPlane) {
  const LensSharpness tilted = measured([](const Eigen::Vector2d& at_px, int view) {
    EdgeStep step = even_step(at_px, view);
    step.blur_px = std::hypot(step.blur_px, 1.0 * (at_px.x() / 400 - 1));
    return step;
  });
  EXPECT_GT(tilted.asymmetry, 0.15);
  EXPECT_LT(tilted.worst_ratio, 0.9);
}

TEST(MeasureSharpness, ReturnsDepthAndPositionOfDustShadow) {
  const Eigen::Vector2d dust_px(500, 200);
  const LensSharpness dusty = measured([&](const Eigen::Vector2d& at_px, int view) {
    EdgeStep step = even_step(at_px, view);
    const double light = (at_px - dust_px).norm() < 45 ? 0.8 : 1;
    step.dark *= light;
    step.bright *= light;
    return step;
  });
  EXPECT_GT(dusty.local_shadow, 0.15);
  EXPECT_LT((dusty.local_shadow_px - dust_px).norm(), 45);
  EXPECT_LT(dusty.local_loss, 0.05);
}

TEST(MeasureSharpness, ReportsLocalMtf50LossWhereLensIsSmeared) {
  const Eigen::Vector2d smear_px(300, 350);
  const LensSharpness smeared = measured([&](const Eigen::Vector2d& at_px, int view) {
    EdgeStep step = even_step(at_px, view);
    if ((at_px - smear_px).norm() < 60) step.blur_px *= 1.5;
    return step;
  });
  EXPECT_NEAR(smeared.local_loss, 1 - 1 / 1.5, 0.05);
  EXPECT_LT(smeared.worst_ratio, 0.75);
  EXPECT_LT(smeared.local_shadow, 0.01);
}

TEST(MeasureSharpness, ReturnsNulloptWhenTagsHaveNoEdgeSteps) {
  auto views = make_views(even_step, 6);
  for (BoardView& view : views) {
    for (TagDetection& tag : view.detection.tags) tag.steps = {};
  }
  EXPECT_FALSE(measure_sharpness(views, kSharpnessImager_px));
}

TEST(ComputeMedianEdgeMtf50, ReturnsMtf50OfUpperMedianBlur) {
  BoardDetection seen = make_views(even_step, 1)[0].detection;
  seen.tags.resize(2);
  const std::array blurs_px{2.0, 0.5, 0.7, 1.1, 9.0, 0.9, 0.4, 3.0};
  for (std::size_t i = 0; i < blurs_px.size(); ++i) {
    seen.tags[i / 4].steps[i % 4].blur_px = blurs_px[i];
  }
  const auto found = compute_median_edge_mtf50(seen);
  ASSERT_TRUE(found);
  EXPECT_DOUBLE_EQ(*found, compute_mtf50_of_blur(1.1));

  seen.tags[0].steps[0].blur_px = 0;  // not measured
  const auto of_seven = compute_median_edge_mtf50(seen);
  ASSERT_TRUE(of_seven);
  EXPECT_DOUBLE_EQ(*of_seven, compute_mtf50_of_blur(0.9));
}

// Tests with exact values: a small tag in the middle of each of `cols` x `rows` equal parts of an
// image of 1200 x 540 px. MTF50 and contrast have 12 x 9 parts, the light 24 x 18.

constexpr std::array kPartsImager_px{1200, 540};

/// Step of an edge of the tag in a part of the image. An edge with the blur 0 is not measured.
using StepInPart = std::function<EdgeStep(int col, int row, int view, std::size_t edge)>;

TagDetection make_square_tag(int id, const Eigen::Vector2d& center_px, double half_px) {
  const double x = center_px.x(), y = center_px.y();
  return {id,
          {{{x - half_px, y + half_px},
            {x + half_px, y + half_px},
            {x + half_px, y - half_px},
            {x - half_px, y - half_px}}}};
}

std::vector<BoardView> make_views_of_parts(const StepInPart& step_in_part, int count, int cols = 12,
                                           int rows = 9) {
  std::vector<BoardView> views;
  views.reserve(static_cast<std::size_t>(count));
  for (int view = 0; view < count; ++view) {
    BoardView& added = views.emplace_back(BoardView{"view", kPartsImager_px, {}});
    for (int row = 0; row < rows; ++row) {
      for (int col = 0; col < cols; ++col) {
        TagDetection tag = make_square_tag(
            row * cols + col, {(col + 0.5) * 1200 / cols, (row + 0.5) * 540 / rows}, 5);
        for (std::size_t k = 0; k < 4; ++k) tag.steps[k] = step_in_part(col, row, view, k);
        added.detection.tags.push_back(tag);
      }
    }
  }
  return views;
}

std::optional<LensSharpness> measure_parts(const StepInPart& step_in_part, int count, int cols = 12,
                                           int rows = 9) {
  return measure_sharpness(make_views_of_parts(step_in_part, count, cols, rows), kPartsImager_px);
}

/// Smooth positive function without symmetry.
double uneven_value(int col, int row) { return 0.6 + 0.03 * col + 0.05 * row; }

/// Largest loss of a part relative to the upper median of the means of opposite parts, up to
/// `reach` parts away in both directions.
double compute_expected_local_loss(const LensSharpness::Map& map, int reach) {
  const auto is_inside = [&](int col, int row) {
    return col >= 0 && row >= 0 && col < map.cols && row < map.rows;
  };
  double largest = -1e9;
  for (int row = 0; row < map.rows; ++row) {
    for (int col = 0; col < map.cols; ++col) {
      std::vector<double> means;  // each pair twice
      for (int v = -reach; v <= reach; ++v) {
        for (int u = -reach; u <= reach; ++u) {
          if (u == 0 && v == 0) continue;
          if (!is_inside(col + u, row + v) || !is_inside(col - u, row - v)) continue;
          const double mean = 0.5 * map.at(col + u, row + v) + 0.5 * map.at(col - u, row - v);
          if (!std::isnan(mean)) means.push_back(mean);
        }
      }
      if (means.empty() || std::isnan(map.at(col, row))) continue;
      std::sort(means.begin(), means.end());
      largest = std::max(largest, 1 - map.at(col, row) / means[means.size() / 2]);
    }
  }
  return largest;
}

TEST(ComputeMtf50OfBlur, IsFrequencyOfHalfModulation) {
  for (const double sigma_px : {0.4, 0.8, 2.0}) {
    const double frequency = compute_mtf50_of_blur(sigma_px);
    EXPECT_GT(frequency, 0);
    EXPECT_NEAR(std::exp(-2 * std::pow(std::numbers::pi * sigma_px * frequency, 2)), 0.5, 1e-12);
  }
}

TEST(MeasureSharpness, SharpnessOfImagePartIsLowerQuartileOfViewMedians) {
  // Upper medians of the four edges: 1.1 times the blur of the view.
  const std::array<double, 4> edges{1.1, 0.9, 1.4, 1.0};
  const std::array<double, 8> views{1.3, 1.0, 1.7, 1.1, 1.4, 1.6, 1.2, 1.5};
  for (const int count : {5, 8}) {
    const auto found = measure_parts(
        [&](int col, int row, int view, std::size_t edge) {
          const double factor = edges[edge] * views[static_cast<std::size_t>(view)];
          return EdgeStep{uneven_value(col, row) * factor, 20, 200};
        },
        count);
    ASSERT_TRUE(found);
    // 5 views at 1.0, 1.1, 1.3, ...: the quartile is 2/3 of the way from the first to the second.
    // 8 views at 1.0, 1.1, 1.2, ...: 5/12 of the way from the second to the third.
    const double quartile = 1.1 * (count == 5 ? 1 + 0.1 * 2 / 3 : 1.1 + 0.1 * 5 / 12);
    double sum = 0;
    for (int row = 0; row < 9; ++row) {
      for (int col = 0; col < 12; ++col) {
        const double expected = compute_mtf50_of_blur(uneven_value(col, row) * quartile);
        EXPECT_NEAR(found->mtf50.at(col, row), expected, 1e-12) << col << ' ' << row;
        sum += expected;
      }
    }
    EXPECT_NEAR(found->mean_mtf50, sum / 108, 1e-12);
    const double worst = compute_mtf50_of_blur(uneven_value(11, 8) * quartile);
    EXPECT_NEAR(found->worst_ratio, worst / (sum / 108), 1e-12);
  }
}

TEST(MeasureSharpness, EdgeBelongsToImagePartOfItsMiddle) {
  // A tag 220 px wide and 100 px high: the middle of each edge is in a part of its own.
  auto views = make_views_of_parts(
      [](int col, int row, int, std::size_t) {
        return EdgeStep{col >= 1 && col <= 3 && row <= 1 ? 0 : 0.8, 20, 200};
      },
      5);
  for (BoardView& view : views) {
    TagDetection tag{500, {{{110, 110}, {330, 110}, {330, 10}, {110, 10}}}};
    tag.steps = {{{0.5, 20, 200}, {0.6, 20, 200}, {0.7, 20, 200}, {0.9, 20, 200}}};
    view.detection.tags.insert(view.detection.tags.begin(), tag);
  }
  const auto found = measure_sharpness(views, kPartsImager_px);
  ASSERT_TRUE(found);
  const auto blur_px = [&](int col, int row) {
    return compute_mtf50_of_blur(1) / found->mtf50.at(col, row);
  };
  EXPECT_NEAR(blur_px(2, 1), 0.5, 1e-12) << "lower edge";
  EXPECT_NEAR(blur_px(3, 1), 0.6, 1e-12) << "right edge";
  EXPECT_NEAR(blur_px(2, 0), 0.7, 1e-12) << "upper edge";
  EXPECT_NEAR(blur_px(1, 1), 0.9, 1e-12) << "left edge";
  EXPECT_TRUE(std::isnan(found->mtf50.at(1, 0)));
  EXPECT_TRUE(std::isnan(found->mtf50.at(3, 0)));
}

TEST(MeasureSharpness, AsymmetryIsTwiceTheSumOfDipoleAndQuadrupole) {
  const double a = 0.03, b = -0.04, d = 0.005, e = 0.012;
  const auto sharpness_at = [&](int col, int row) {
    const double x = (100 * (col + 0.5) - 600) / 270, y = (60 * (row + 0.5) - 270) / 270;
    return 1.2 + a * x + b * y + d * (x * x - y * y) + e * 2 * x * y - 0.03 * (x * x + y * y);
  };
  // Parts of two columns are unknown.
  const auto is_known = [](int col) { return col != 1 && col != 7; };
  const auto found = measure_parts(
      [&](int col, int row, int, std::size_t) {
        return EdgeStep{is_known(col) ? 1 / sharpness_at(col, row) : 0, 20, 200};
      },
      5);
  ASSERT_TRUE(found);
  double sum = 0;
  for (int row = 0; row < 9; ++row) {
    for (int col = 0; col < 12; ++col) {
      if (is_known(col)) sum += sharpness_at(col, row);
    }
  }
  // |(a, b)| = 0.05, |(d, e)| = 0.013, and 90 parts are known.
  EXPECT_NEAR(found->asymmetry, 2 * (0.05 + 0.013) / (sum / 90), 1e-10);
}

TEST(MeasureSharpness, LocalLossComparesWithMediansOfOppositeParts) {
  Random random(5);
  std::vector<double> values(108);
  for (double& value : values) value = random.uniform(0.7, 1.0);
  const auto blur_at = [&](int col, int row) {
    if (col > 8 && row > 6) return 0.0;  // unknown
    return values[static_cast<std::size_t>(12 * row + col)];
  };
  const auto found = measure_parts(
      [&](int col, int row, int, std::size_t) {
        return EdgeStep{blur_at(col, row), 20, 200};
      },
      5);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->local_loss, compute_expected_local_loss(found->mtf50, 2), 1e-12);
  EXPECT_GT(found->local_loss, 0.1);
}

TEST(MeasureSharpness, LocalShadowIsLossOfMeanLightInMiddleOfItsPart) {
  // The light decreases smoothly to the right and down, and is reduced to 70 to 90 % in one part.
  const std::array<double, 4> shadow{0.7, 0.9, 0.75, 0.85};
  const auto found = measure_parts(
      [&](int col, int row, int, std::size_t edge) {
        const double light = std::exp(5 - 0.02 * col - 0.01 * row - 0.001 * row * row);
        return EdgeStep{0.8, 10, col == 17 && row == 5 ? light * shadow[edge] : light};
      },
      5, 24, 18);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->local_shadow, 0.2, 0.002);
  EXPECT_NEAR(found->local_shadow_px.x(), 17.5 * 50 - 0.5, 1e-9);
  EXPECT_NEAR(found->local_shadow_px.y(), 5.5 * 30 - 0.5, 1e-9);
  EXPECT_NEAR(found->light.at(17, 5), 0.8, 0.01);
  EXPECT_NEAR(found->light.at(3, 12), 1, 0.01);
  EXPECT_NEAR(found->local_shadow, compute_expected_local_loss(found->light, 4), 1e-12);
}

}  // namespace
}  // namespace vlp
