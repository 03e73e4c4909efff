// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/tone_curve_estimation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <tuple>
#include <vector>

#include "calibration/intrinsics/board_lattice.h"
#include "calibration/intrinsics/intrinsics.h"
#include "calibration/intrinsics/lens_estimate.h"
#include "calibration/intrinsics/synthetic_views.h"
#include "detection/boards/tone_curve.h"
#include "support/random.h"

namespace vlp {
namespace {

constexpr double kCornerNoise_px = 0.02;

/// Camera with a tone curve whose gray values indicate another one.
struct CodedCamera {
  double gamma, levels_gamma;
  /// Relative difference of the edge shifts between tags.
  double uneven = 0.5;
  Lens lens = synthetic_lens();

  double shift_px(int id, double behind_gamma) const {
    const double share = 1 + uneven * (id % 5 - 2);
    return 0.3 * share * std::log(gamma / behind_gamma);
  }

  /// Returns the views without a tone curve.
  std::vector<BoardView> uncoded(int count, std::uint64_t seed) const {
    const SyntheticViews boards{synthetic_board(false), lens};
    Random random(seed);
    std::vector<BoardView> views;
    for (int i = 0; i < count; ++i) {
      views.push_back({"image", boards.imager_px, boards.random_view(random, kCornerNoise_px)});
    }
    return views;
  }
  std::vector<BoardView> views(int count, std::uint64_t seed) const {
    auto views = uncoded(count, seed);
    for (BoardView& view : views) {
      for (TagDetection& tag : view.detection.tags) tag = coded(tag);
      for (const double each : kGammas) {
        view.detection.curve_costs.push_back(500 * std::pow(std::log(each / levels_gamma), 2));
      }
    }
    return views;
  }

 private:
  TagDetection coded(const TagDetection& truth) const {
    TagDetection tag = shrunk(truth, shift_px(truth.id, 1));
    tag.corner_sds_px.fill(kCornerNoise_px);
    for (const double each : kGammas) {
      if (each == 1) continue;
      tag.tone_curve_fits.push_back(
          {shrunk(truth, shift_px(truth.id, each)).corners_px, {}, tag.corner_sds_px});
    }
    return tag;
  }
};

/// Returns the largest distance of a corner from the truth; infinity if there are no tags.
double worst_px(const std::vector<BoardView>& views, const std::vector<BoardView>& truth) {
  double worst_px = -1;
  for (std::size_t i = 0; i < views.size(); ++i) {
    for (std::size_t tag = 0; tag < views[i].detection.tags.size(); ++tag) {
      for (std::size_t k = 0; k < 4; ++k) {
        worst_px = std::max(worst_px, (views[i].detection.tags[tag].corners_px[k] -
                                       truth[i].detection.tags[tag].corners_px[k])
                                          .norm());
      }
    }
  }
  return worst_px < 0 ? INFINITY : worst_px;
}

/// Also with more views than are used.
TEST(CorrectToneCurve, ReturnsTrueGammaWhenGrayValuesIndicateAnother) {
  for (const auto& [gamma, levels_gamma, count] : {std::tuple{2.0, 1.5, 40}, {1.5, 2.2, 16}}) {
    const CodedCamera camera{gamma, levels_gamma};
    auto views = camera.views(count, 1);
    const auto truth = camera.uncoded(count, 1);
    EXPECT_GT(worst_px(views, truth), 0.2);
    EXPECT_NEAR(std::log(correct_tone_curve(views, synthetic_board(false)) / gamma), 0, 0.04);
    EXPECT_LT(worst_px(views, truth), 0.05);
    EXPECT_TRUE(views[0].detection.tags[0].tone_curve_fits.empty());
  }
}

/// Images without the board do not count.
TEST(CorrectToneCurve, ReturnsTrueGammaWhenMostViewsLackBoard) {
  auto views = CodedCamera{2, 1.5}.views(12, 1);
  views.resize(30, {"none", {800, 600}, {}});
  EXPECT_NEAR(std::log(correct_tone_curve(views, synthetic_board(false)) / 2), 0, 0.04);
}

TEST(CorrectToneCurve, ReturnsOneWhenOnlyGrayValuesIndicateCurve) {
  auto views = CodedCamera{1, 1.46}.views(16, 2);
  const auto before = views;
  EXPECT_EQ(correct_tone_curve(views, synthetic_board(false)), 1);
  EXPECT_EQ(views[5].detection.tags[3].corners_px, before[5].detection.tags[3].corners_px);
}

/// With any curve the corners then lie on a board, once the shift is corrected.
TEST(CorrectToneCurve, ReturnsEstimateFromGrayValuesWhenEqualEdgeShiftsHideTrueGamma) {
  for (const double levels_gamma : {1.4, 2.2}) {
    auto views = CodedCamera{1.8, levels_gamma, 0}.views(16, 3);
    const double gamma = correct_tone_curve(views, synthetic_board(false));
    EXPECT_NEAR(std::log(gamma / levels_gamma), 0, 0.05) << gamma;
  }
}

TEST(CorrectToneCurve, ReturnsGammaOfGrayValuesIfCornerSdsAreUnknownOrNoLensFits) {
  const Board board = synthetic_board(false);
  auto without_noise = CodedCamera{2, 1.5}.views(8, 4), of_another = without_noise;
  for (BoardView& view : without_noise) {
    for (TagDetection& tag : view.detection.tags) {
      tag.corner_sds_px.fill(0);
      for (auto& outline : tag.tone_curve_fits) outline.corner_sds_px.fill(0);
    }
  }
  EXPECT_NEAR(correct_tone_curve(without_noise, board), 1.5, 1e-9);
  Board other = board;
  other.tag_spacing = 0.7;
  EXPECT_NEAR(correct_tone_curve(of_another, other), 1.5, 1e-9);
  auto few = CodedCamera{1, 1.5}.views(2, 4);
  EXPECT_NEAR(correct_tone_curve(few, board), 1.5, 1e-9);
  std::vector<BoardView> none;
  EXPECT_EQ(correct_tone_curve(none, board), 1);
}

TEST(CorrectToneCurve, ReturnsGammaOfGrayValuesIfHalfOfViewsLackToneCurveFits) {
  auto views = CodedCamera{1, 1.5}.views(4, 5);
  for (const BoardView& view : CodedCamera{1, 1}.views(4, 6)) {
    views.push_back(view);
    views.back().detection.curve_costs = {0, 40};
    for (TagDetection& tag : views.back().detection.tags) tag.tone_curve_fits.clear();
  }
  const double by_levels = estimate_gamma(sum_tone_curve_costs(views));
  EXPECT_GT(by_levels, 1.2);
  EXPECT_NEAR(correct_tone_curve(views, synthetic_board(false)), by_levels, 1e-9);
}

TEST(CorrectToneCurve, ReturnsOneWhenViewsAreAlreadyCorrected) {
  auto views = CodedCamera{2, 2}.views(8, 7);
  correct_tone_curve(views, synthetic_board(false));
  const auto once = views[0].detection.tags[0].corners_px;
  EXPECT_EQ(correct_tone_curve(views, synthetic_board(false)), 1);
  EXPECT_EQ(views[0].detection.tags[0].corners_px, once);
}

TEST(EstimateLens, ReturnsAllViewsCorrectedForEstimatedToneCurve) {
  const Board board = synthetic_board(false);
  const std::vector<BoardView> views = CodedCamera{1.8, 1.8}.views(12, 3);
  std::vector<BoardView> expected = views;
  const double gamma = correct_tone_curve(expected, board);
  LensViews input;
  input.views = views;
  input.board = board;
  const LensEstimate lens = estimate_lens(input);
  ASSERT_TRUE(lens.has_succeeded()) << lens.problem;
  EXPECT_NEAR(lens.gamma, 1.8, 0.1);
  EXPECT_EQ(lens.gamma, gamma);
  ASSERT_EQ(lens.views.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    ASSERT_EQ(lens.views[i].detection.tags.size(), expected[i].detection.tags.size());
    for (std::size_t k = 0; k < expected[i].detection.tags.size(); ++k) {
      EXPECT_EQ(lens.views[i].detection.tags[k].corners_px,
                expected[i].detection.tags[k].corners_px);
    }
  }
  EXPECT_NE(expected[0].detection.tags[0].corners_px, views[0].detection.tags[0].corners_px);
}

}  // namespace
}  // namespace vlp
