// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/tone_curve_estimation.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <tuple>
#include <utility>
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
TEST(EstimateAndCorrectToneCurve, ReturnsTrueGammaWhenGrayValuesIndicateAnother) {
  for (const auto& [gamma, levels_gamma, count] : {std::tuple{2.0, 1.5, 40}, {1.5, 2.2, 16}}) {
    const CodedCamera camera{gamma, levels_gamma};
    auto views = camera.views(count, 1);
    const auto truth = camera.uncoded(count, 1);
    EXPECT_GT(worst_px(views, truth), 0.2);
    EXPECT_NEAR(std::log(estimate_and_correct_tone_curve(views, synthetic_board(false)) / gamma), 0,
                0.04);
    EXPECT_LT(worst_px(views, truth), 0.05);
    EXPECT_TRUE(views[0].detection.tags[0].tone_curve_fits.empty());
  }
}

/// Images without the board do not count.
TEST(EstimateAndCorrectToneCurve, ReturnsTrueGammaWhenMostViewsLackBoard) {
  auto views = CodedCamera{2, 1.5}.views(12, 1);
  views.resize(30, {"none", {800, 600}, {}});
  EXPECT_NEAR(std::log(estimate_and_correct_tone_curve(views, synthetic_board(false)) / 2), 0,
              0.04);
}

TEST(EstimateAndCorrectToneCurve, ReturnsOneWhenOnlyGrayValuesIndicateCurve) {
  auto views = CodedCamera{1, 1.46}.views(16, 2);
  const auto before = views;
  EXPECT_EQ(estimate_and_correct_tone_curve(views, synthetic_board(false)), 1);
  EXPECT_EQ(views[5].detection.tags[3].corners_px, before[5].detection.tags[3].corners_px);
}

/// With any curve the corners then lie on a board, once the shift is corrected.
TEST(EstimateAndCorrectToneCurve, ReturnsEstimateFromGrayValuesWhenEqualEdgeShiftsHideTrueGamma) {
  for (const double levels_gamma : {1.4, 2.2}) {
    auto views = CodedCamera{1.8, levels_gamma, 0}.views(16, 3);
    const double gamma = estimate_and_correct_tone_curve(views, synthetic_board(false));
    EXPECT_NEAR(std::log(gamma / levels_gamma), 0, 0.05) << gamma;
  }
}

TEST(EstimateAndCorrectToneCurve, ReturnsGammaOfGrayValuesIfCornerSdsAreUnknownOrNoLensFits) {
  const Board board = synthetic_board(false);
  auto without_noise = CodedCamera{2, 1.5}.views(8, 4), of_another = without_noise;
  for (BoardView& view : without_noise) {
    for (TagDetection& tag : view.detection.tags) {
      tag.corner_sds_px.fill(0);
      for (auto& outline : tag.tone_curve_fits) outline.corner_sds_px.fill(0);
    }
  }
  EXPECT_NEAR(estimate_and_correct_tone_curve(without_noise, board), 1.5, 1e-9);
  Board other = board;
  other.tag_spacing = 0.7;
  EXPECT_NEAR(estimate_and_correct_tone_curve(of_another, other), 1.5, 1e-9);
  auto few = CodedCamera{1, 1.5}.views(2, 4);
  EXPECT_NEAR(estimate_and_correct_tone_curve(few, board), 1.5, 1e-9);
  std::vector<BoardView> none;
  EXPECT_EQ(estimate_and_correct_tone_curve(none, board), 1);
}

TEST(EstimateAndCorrectToneCurve, ReturnsGammaOfGrayValuesIfHalfOfViewsLackToneCurveFits) {
  auto views = CodedCamera{1, 1.5}.views(4, 5);
  for (const BoardView& view : CodedCamera{1, 1}.views(4, 6)) {
    views.push_back(view);
    views.back().detection.curve_costs = {0, 40};
    for (TagDetection& tag : views.back().detection.tags) tag.tone_curve_fits.clear();
  }
  const double by_levels = estimate_tone_curve_gamma(sum_tone_curve_costs(views));
  EXPECT_GT(by_levels, 1.2);
  EXPECT_NEAR(estimate_and_correct_tone_curve(views, synthetic_board(false)), by_levels, 1e-9);
}

TEST(EstimateAndCorrectToneCurve, ReturnsOneWhenViewsAreAlreadyCorrected) {
  auto views = CodedCamera{2, 2}.views(8, 7);
  estimate_and_correct_tone_curve(views, synthetic_board(false));
  const auto once = views[0].detection.tags[0].corners_px;
  EXPECT_EQ(estimate_and_correct_tone_curve(views, synthetic_board(false)), 1);
  EXPECT_EQ(views[0].detection.tags[0].corners_px, once);
}

TEST(EstimateLens, ReturnsAllViewsCorrectedForEstimatedToneCurve) {
  const Board board = synthetic_board(false);
  const std::vector<BoardView> views = CodedCamera{1.8, 1.8}.views(12, 3);
  std::vector<BoardView> expected = views;
  const double gamma = estimate_and_correct_tone_curve(expected, board);
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

/// Computes gamma from the costs that the header states, with a solved lens for each curve. Views
/// that the solve without a curve drops are left out for all curves.
double compute_expected_gamma(std::vector<BoardView> views, const Board& board,
                              LensModel model = LensModel::opencv8) {
  const double levels_gamma = estimate_tone_curve_gamma(sum_tone_curve_costs(views));
  IntrinsicsInput input{BoardLattice(board), {}, views[0].imager_px, model};
  ValuesPerGamma ratios{};
  for (std::size_t curve = 0; curve < kGammas.size(); ++curve) {
    input.views.clear();
    std::vector<double> sds_px;
    for (const BoardView& view : views) {
      BoardDetection seen = view.detection;
      for (TagDetection& tag : seen.tags) {
        if (curve > 0) {
          tag.corners_px = tag.tone_curve_fits[curve - 1].corners_px;
          tag.corner_sds_px = tag.tone_curve_fits[curve - 1].corner_sds_px;
        }
        std::ranges::copy_if(tag.corner_sds_px, std::back_inserter(sds_px),
                             [](double sd_px) { return sd_px > 0; });
      }
      input.views.push_back(input.lattice.list_corners_with_board_positions(seen));
    }
    const IntrinsicsSolution solution = solve_intrinsics(input);
    EXPECT_TRUE(solution.has_succeeded());
    if (curve == 0) {
      input.warp = solution.solved_parameters.warp ? WarpChoice::on : WarpChoice::off;
      std::vector<BoardView> kept;
      for (const std::size_t view : solution.views) kept.push_back(views[view]);
      views = kept;
    }
    std::sort(sds_px.begin(), sds_px.end());
    ratios[curve] = solution.rms_px / sds_px[sds_px.size() / 2];
  }
  const double count = 50 / *std::min_element(ratios.begin(), ratios.end());
  ValuesPerGamma costs{};
  for (std::size_t i = 0; i < costs.size(); ++i) {
    costs[i] =
        count * std::log(ratios[i]) + std::pow(std::log(kGammas[i] / levels_gamma) / 0.2, 2) / 2;
  }
  return estimate_tone_curve_gamma(costs);
}

TagDetection::Corners displace_corners(TagDetection::Corners corners_px) {
  for (auto& corner : corners_px) corner.y() += 15;
  return corners_px;
}

TEST(EstimateAndCorrectToneCurve, MinimizesSumOfCostsOfResidualsAndGrayLevels) {
  auto views = CodedCamera{1.7, 2.3, 0.08}.views(7, 8);
  // The standard deviations differ from corner to corner and from curve to curve.
  for (BoardView& view : views) {
    for (TagDetection& tag : view.detection.tags) {
      const double scale = tag.id % 4 == 0 ? 0 : 1 + 0.1 * (tag.id % 7);  // 0: unknown
      for (double& sd_px : tag.corner_sds_px) sd_px *= scale;
      for (std::size_t i = 0; i < tag.tone_curve_fits.size(); ++i) {
        for (double& sd_px : tag.tone_curve_fits[i].corner_sds_px) {
          sd_px *= scale * (1 + 0.02 * static_cast<double>(i));
        }
      }
    }
  }
  // A view does not fit without a curve, another one with the first curve only.
  for (TagDetection& tag : views[1].detection.tags) {
    if (tag.id % 2 == 0) tag.corners_px = displace_corners(tag.corners_px);
  }
  for (TagDetection& tag : views[3].detection.tags) {
    auto& outline = tag.tone_curve_fits[0];
    if (tag.id % 2 == 0) outline.corners_px = displace_corners(outline.corners_px);
  }
  const double expected = compute_expected_gamma(views, synthetic_board(false));
  EXPECT_GT(std::abs(std::log(expected / 1.7)), 0.01);
  EXPECT_GT(std::abs(std::log(expected / 2.3)), 0.01);
  EXPECT_NEAR(estimate_and_correct_tone_curve(views, synthetic_board(false)), expected, 1e-9);
}

/// The board is warped only in the corners without a curve: the warp is estimated for all curves.
TEST(EstimateAndCorrectToneCurve, EstimatesWarpForAllCurvesIfItIsNeededWithoutCurve) {
  SyntheticViews flat{synthetic_board(false), synthetic_lens()}, warped = flat;
  warped.warp_m = {0.003, -0.002};
  Random random(11);
  std::vector<BoardView> views;
  for (int i = 0; i < 4; ++i) {
    const double azimuth = 1.5 * i + 0.3;
    const Eigen::Matrix3d rotation =
        (Eigen::AngleAxisd(0.5, Eigen::Vector3d(std::cos(azimuth), std::sin(azimuth), 0)) *
         Eigen::AngleAxisd(0.4 * i, Eigen::Vector3d::UnitZ()))
            .toRotationMatrix();
    const Eigen::Vector3d middle_m(0.01 * i, -0.01, 0.3);
    BoardDetection seen = warped.view(rotation, middle_m, random, 0.02);
    for (std::size_t fit = 1; fit < kGammas.size(); ++fit) {
      const double noise_px = 0.02 + 0.01 * std::abs(static_cast<double>(fit) - 2.2);
      const BoardDetection other = flat.view(rotation, middle_m, random, noise_px);
      ASSERT_EQ(other.tags.size(), seen.tags.size());
      for (std::size_t k = 0; k < seen.tags.size(); ++k) {
        seen.tags[k].tone_curve_fits.push_back({other.tags[k].corners_px, {}, {}});
        seen.tags[k].tone_curve_fits.back().corner_sds_px.fill(0.02);
      }
    }
    for (TagDetection& tag : seen.tags) tag.corner_sds_px.fill(0.02);
    for (const double each : kGammas) {
      seen.curve_costs.push_back(500 * std::pow(std::log(each / 2), 2));
    }
    views.push_back({"image", flat.imager_px, seen});
  }
  ASSERT_GT(views[0].detection.tags.size(), 20U);
  const double expected = compute_expected_gamma(views, flat.board);
  EXPECT_NEAR(estimate_and_correct_tone_curve(views, flat.board), expected, 1e-9);
}

/// OPENCV8 does not fit a wide fisheye.
TEST(EstimateAndCorrectToneCurve, UsesFisheyeModelIfItFitsBetter) {
  const Lens fisheye(LensModel::fisheye,
                     std::array{250.0, 251.0, 402.0, 297.0, 0.03, -0.012, 0.004, -0.0006});
  auto views = CodedCamera{1.7, 2.3, 0.15, fisheye}.views(6, 10);
  const double expected = compute_expected_gamma(views, synthetic_board(false), LensModel::fisheye);
  EXPECT_NEAR(estimate_and_correct_tone_curve(views, synthetic_board(false)), expected, 1e-9);
}

/// Every fifth of 30 views is not used.
TEST(EstimateAndCorrectToneCurve, UsesTwentyFourViewsEvenlySpaced) {
  const Board board = synthetic_board(false);
  auto all = CodedCamera{1.8, 2.2, 0.2}.views(30, 9);
  for (BoardView& view : all) view.detection.tags.resize(8, view.detection.tags[0]);
  auto used = all;
  for (std::size_t i = 4; i < used.size(); i += 5) used[i].detection.tags.clear();
  auto fewer = all;
  for (std::size_t i = 3; i < fewer.size(); i += 5) fewer[i].detection.tags.clear();
  const double gamma = estimate_and_correct_tone_curve(all, board);
  EXPECT_EQ(estimate_and_correct_tone_curve(used, board), gamma);
  EXPECT_NE(estimate_and_correct_tone_curve(fewer, board), gamma);
}

}  // namespace
}  // namespace vlp
