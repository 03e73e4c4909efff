// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Tags shrunk by a tone curve.
#include "calibration/intrinsics/edge_corrections.h"

#include <gtest/gtest.h>

#include <vector>

#include "calibration/intrinsics/board_check.h"
#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/synthetic_views.h"
#include "calibration/intrinsics/wide_views.h"

namespace vlp {
namespace {

/// Board of separate tags, with gaps as wide as a tag or narrower.
class TagsWithDisplacedEdges : public testing::TestWithParam<double> {
 protected:
  Board board() const {
    Board board = synthetic_board(false);
    board.tag_spacing = GetParam();
    return board;
  }
  std::vector<BoardView> shrunk_views(int count, double noise_px, double shift_px) const {
    const SyntheticViews views{board(), synthetic_lens()};
    const BoardLattice lattice(views.board);
    Random random(31);
    std::vector<BoardView> seen;
    while (static_cast<int>(seen.size()) < count) {
      BoardDetection view = views.random_view(random, noise_px);
      if (!lattice.can_determine_pose(view)) continue;
      for (TagDetection& tag : view.tags) tag = shrunk(tag, shift_px);
      seen.push_back({"", views.imager_px, view});
    }
    return seen;
  }
  IntrinsicsInput make_input(const std::vector<BoardView>& seen) const {
    IntrinsicsInput input{BoardLattice(board()), {}, {800, 600}, LensModel::opencv8};
    for (const BoardView& view : seen)
      input.views.push_back(input.lattice.list_corners(view.detection));
    return input;
  }
};

TEST_P(TagsWithDisplacedEdges, YieldTrueEdgeDisplacementOfEachView) {
  const auto input = make_input(shrunk_views(6, 0, 0.3));
  const auto shifts = fit_displacements(input.views, synthetic_lens());
  ASSERT_EQ(shifts.size(), 6U);
  for (const EdgeDisplacement& shift : shifts)
    EXPECT_NEAR(shift.inward_shift_px(shift.middle), 0.3, 0.005);
  const auto none = fit_displacements(make_input(shrunk_views(6, 0, 0)).views, synthetic_lens());
  ASSERT_EQ(none.size(), 6U);
  for (const EdgeDisplacement& shift : none)
    EXPECT_NEAR(shift.inward_shift_px(shift.middle), 0, 1e-6);
}

TEST_P(TagsWithDisplacedEdges, SolveIntrinsicsRecoversEdgeShiftAndTrueLens) {
  const auto input = make_input(shrunk_views(16, 0.03, 0.35));
  const IntrinsicsSolution solution = solve_intrinsics(input);
  ASSERT_TRUE(solution.has_succeeded());
  ASSERT_EQ(solution.edge_displacements_px.size(), 16U);
  for (const double shift_px : solution.edge_displacements_px) EXPECT_NEAR(shift_px, 0.35, 0.03);
  EXPECT_NEAR(solution.rms_px, 0.03, 0.004);
  const auto difference =
      compare_projections(synthetic_lens(), solution.fitted_lens(), {800, 600}, even);
  ASSERT_TRUE(difference);
  EXPECT_LT(difference->mean_px, 0.03);
}

TEST_P(TagsWithDisplacedEdges, SolveIntrinsicsEstimatesNoWarpWhenEdgeShiftVaries) {
  auto seen = shrunk_views(16, 0.03, 0);
  for (BoardView& view : seen) {
    for (TagDetection& tag : view.detection.tags) {
      tag = shrunk(tag, 0.3 + 0.1 * (tag.corners_px[0].x() - 400) / 400);
    }
  }
  const IntrinsicsSolution solution = solve_intrinsics(make_input(seen));
  ASSERT_TRUE(solution.has_succeeded());
  EXPECT_FALSE(solution.solved_parameters.warp);
  EXPECT_NEAR(solution.rms_px, 0.03, 0.004);
  const auto difference =
      compare_projections(synthetic_lens(), solution.fitted_lens(), {800, 600}, even);
  ASSERT_TRUE(difference);
  EXPECT_LT(difference->mean_px, 0.03);
}

TEST_P(TagsWithDisplacedEdges, CheckBoardLayoutAcceptsTrueSpacingDespiteEdgeShift) {
  const auto seen = shrunk_views(10, 0.03, 0.4);
  EXPECT_EQ(check_board_layout(board(), seen, {}).problem, "");
  EXPECT_EQ(check_board_layout(board(), seen, synthetic_lens()).problem, "");
  Board other = board();
  other.tag_spacing += 0.06;
  EXPECT_NE(check_board_layout(other, seen, synthetic_lens()).problem, "");
}

INSTANTIATE_TEST_SUITE_P(Spacings, TagsWithDisplacedEdges, testing::Values(1.0, 0.4),
                         [](const auto& gap) { return gap.param == 1 ? "OneTag" : "Narrow"; });

/// A warped board that is assumed flat looks as if edges shifted inwards here and outwards there.
TEST(SolveIntrinsicsOfWarpedBoard, EstimatesWarpInsteadOfEdgeShifts) {
  constexpr double noise_px = 0.017;
  Random random(12);
  const WideBoards boards{0.1, 0.2};
  const auto input = wide_input(false, 40, random, noise_px, {6e-4, 9e-4}, boards);
  const IntrinsicsSolution solution = solve_intrinsics(input);
  ASSERT_TRUE(solution.has_succeeded());
  EXPECT_TRUE(solution.solved_parameters.warp);
  EXPECT_NEAR(solution.rms_px, 0.0165, 0.0005);  // 0.0176 with such shifts left in
  const auto difference =
      compare_projections(wide_lens(), solution.fitted_lens(), kWideImager, even);
  ASSERT_TRUE(difference);
  EXPECT_LT(difference->rms_px, 0.006);  // 0.0144
}

TEST(FitDisplacements, ReturnsZeroForTagsWithCornerSquares) {
  const SyntheticViews views{synthetic_board(true), synthetic_lens()};
  Random random(3);
  const auto input = views.input(4, random, 0.1);
  const auto shifts = fit_displacements(input.views, views.lens);
  ASSERT_EQ(shifts.size(), 4U);
  for (const EdgeDisplacement& shift : shifts) EXPECT_TRUE(shift.coefficients.isZero(0));
}

TEST(CorrectDisplacement, MovesCornersOutwardsAndReturnsMean) {
  EdgeDisplacement shift;
  shift.coefficients = {0.3, 0.1, -0.2, 0.05};
  shift.middle = {100, 200};
  shift.radius_px = 50;
  std::vector<BoardLattice::Corner> corners(2);
  corners[0].pixel = {150, 200};  // x = 1, y = 0: 0.3 + 0.1 + 0.05
  corners[0].d_pixel_d_edge_shift = {1, -1};
  corners[1].pixel = {100, 300};  // x = 0, y = 2: 0.3 - 0.4 + 0.2
  corners[1].d_pixel_d_edge_shift = {-2, 0.5};
  EXPECT_NEAR(correct_displacement(corners, shift), (0.45 + 0.1) / 2, 1e-12);
  EXPECT_LT((corners[0].pixel - Eigen::Vector2d(149.55, 200.45)).norm(), 1e-12);
  EXPECT_LT((corners[1].pixel - Eigen::Vector2d(100.2, 299.95)).norm(), 1e-12);
  corners.clear();
  EXPECT_EQ(correct_displacement(corners, shift), 0);
}

}  // namespace
}  // namespace vlp
