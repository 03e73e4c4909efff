// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Tags shrunk by a tone curve.
#include "calibration/intrinsics/edge_corrections.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "calibration/intrinsics/board_check.h"
#include "calibration/intrinsics/board_poses.h"
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
      if (!lattice.are_corners_sufficient_for_pose(view)) continue;
      for (TagDetection& tag : view.tags) tag = shrunk(tag, shift_px);
      seen.push_back({"", views.imager_px, view});
    }
    return seen;
  }
  IntrinsicsInput make_input(const std::vector<BoardView>& seen) const {
    IntrinsicsInput input{BoardLattice(board()), {}, {800, 600}, LensModel::opencv8};
    for (const BoardView& view : seen)
      input.views.push_back(input.lattice.list_corners_with_board_positions(view.detection));
    return input;
  }
};

TEST_P(TagsWithDisplacedEdges, YieldTrueEdgeDisplacementOfEachView) {
  const auto input = make_input(shrunk_views(6, 0, 0.3));
  const auto shifts = estimate_tag_edge_displacements(input.views, synthetic_lens());
  ASSERT_EQ(shifts.size(), 6U);
  for (const EdgeDisplacement& shift : shifts)
    EXPECT_NEAR(shift.inward_displacement_at_pixel_px(shift.middle), 0.3, 0.005);
  const auto none =
      estimate_tag_edge_displacements(make_input(shrunk_views(6, 0, 0)).views, synthetic_lens());
  ASSERT_EQ(none.size(), 6U);
  for (const EdgeDisplacement& shift : none)
    EXPECT_NEAR(shift.inward_displacement_at_pixel_px(shift.middle), 0, 1e-6);
}

TEST_P(TagsWithDisplacedEdges, SolveIntrinsicsRecoversEdgeShiftAndTrueLens) {
  const auto input = make_input(shrunk_views(16, 0.03, 0.35));
  const IntrinsicsSolution solution = solve_intrinsics(input);
  ASSERT_TRUE(solution.has_succeeded());
  ASSERT_EQ(solution.edge_displacements_px.size(), 16U);
  for (const double shift_px : solution.edge_displacements_px) EXPECT_NEAR(shift_px, 0.35, 0.03);
  EXPECT_NEAR(solution.rms_px, 0.03, 0.004);
  const auto difference =
      compute_projection_difference(synthetic_lens(), solution.fitted_lens(), {800, 600}, even);
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
      compute_projection_difference(synthetic_lens(), solution.fitted_lens(), {800, 600}, even);
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
      compute_projection_difference(wide_lens(), solution.fitted_lens(), kWideImager, even);
  ASSERT_TRUE(difference);
  EXPECT_LT(difference->rms_px, 0.006);  // 0.0144
}

TEST(EstimateTagEdgeDisplacements, ReturnsZeroForTagsWithCornerSquares) {
  const SyntheticViews views{synthetic_board(true), synthetic_lens()};
  Random random(3);
  const auto input = views.input(4, random, 0.1);
  const auto shifts = estimate_tag_edge_displacements(input.views, views.lens);
  ASSERT_EQ(shifts.size(), 4U);
  for (const EdgeDisplacement& shift : shifts) EXPECT_TRUE(shift.coefficients.isZero(0));
}

TEST(CorrectCornersForEdgeDisplacement, MovesCornersOutwardsAndReturnsMean) {
  EdgeDisplacement shift;
  shift.coefficients = {0.3, 0.1, -0.2, 0.05};
  shift.middle = {100, 200};
  shift.radius_px = 50;
  std::vector<BoardLattice::Corner> corners(2);
  corners[0].pixel = {150, 200};  // x = 1, y = 0: 0.3 + 0.1 + 0.05
  corners[0].d_pixel_d_edge_shift = {1, -1};
  corners[1].pixel = {100, 300};  // x = 0, y = 2: 0.3 - 0.4 + 0.2
  corners[1].d_pixel_d_edge_shift = {-2, 0.5};
  EXPECT_NEAR(correct_corners_for_edge_displacement(corners, shift), (0.45 + 0.1) / 2, 1e-12);
  EXPECT_LT((corners[0].pixel - Eigen::Vector2d(149.55, 200.45)).norm(), 1e-12);
  EXPECT_LT((corners[1].pixel - Eigen::Vector2d(100.2, 299.95)).norm(), 1e-12);
  corners.clear();
  EXPECT_EQ(correct_corners_for_edge_displacement(corners, shift), 0);
}

/// Computes the edge displacement of a view by least squares with difference quotients of the pose.
/// `prior` and `prior_weights`: values of the coefficients and their weights.
EdgeDisplacement compute_expected_displacement(const std::vector<BoardLattice::Corner>& corners,
                                               const Lens& lens, const Eigen::Vector4d& prior,
                                               const Eigen::Vector4d& prior_weights) {
  EdgeDisplacement shift;
  const auto count = std::ssize(corners);
  for (const auto& corner : corners) shift.middle += corner.pixel / static_cast<double>(count);
  double squares = 0;
  for (const auto& corner : corners) squares += (corner.pixel - shift.middle).squaredNorm();
  shift.radius_px = std::sqrt(squares / static_cast<double>(count));
  const BoardPose pose = estimate_board_view_pose(corners, lens).value().camera_from_board;
  const Eigen::Matrix3d rotation =
      Eigen::AngleAxisd(pose.rotation.norm(), pose.rotation.normalized()).toRotationMatrix();
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(2 * count + 4, 10);
  Eigen::VectorXd residuals(2 * count + 4);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto& corner = corners[static_cast<std::size_t>(i)];
    const auto project_corner = [&](int unknown, double step) {
      const Eigen::Vector3d unit = Eigen::Vector3d::Unit(unknown % 3);
      const Eigen::Matrix3d turn = unknown < 3 ? Eigen::AngleAxisd(step, unit).toRotationMatrix()
                                               : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
      const Eigen::Vector3d move = unknown < 3 ? Eigen::Vector3d(0, 0, 0) : step * unit;
      return lens.project_point(turn * rotation * corner.in_board_m + pose.translation_m + move)
          .value();
    };
    for (int unknown = 0; unknown < 6; ++unknown) {
      constexpr double step = 1e-6;
      rows.block<2, 1>(2 * i, unknown) =
          corner.weight * (project_corner(unknown, step) - project_corner(unknown, -step)) /
          (2 * step);
    }
    const Eigen::Vector2d x = (corner.pixel - shift.middle) / shift.radius_px;
    rows.block<2, 4>(2 * i, 6) = corner.weight * corner.d_pixel_d_edge_shift *
                                 Eigen::RowVector4d(1, x.x(), x.y(), x.squaredNorm());
    residuals.segment<2>(2 * i) = corner.weight * (corner.pixel - project_corner(0, 0));
  }
  for (Eigen::Index k = 0; k < 4; ++k) {
    rows(2 * count + k, 6 + k) = std::sqrt(prior_weights[k]);
    residuals[2 * count + k] = std::sqrt(prior_weights[k]) * prior[k];
  }
  shift.coefficients = rows.colPivHouseholderQr().solve(residuals).tail<4>();
  return shift;
}

/// Returns views of a board with weights and noise, and with edges displaced by constant and
/// varying shifts.
std::vector<std::vector<BoardLattice::Corner>> make_displaced_views(int count) {
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  Random random(17);
  auto corners = views.input(count, random, 0.05).views;
  for (int view = 0; view < count; ++view) {
    for (std::size_t i = 0; auto& corner : corners[static_cast<std::size_t>(view)]) {
      corner.weight = i++ % 3 == 0 ? 0.5 : 1;
      corner.pixel +=
          (0.1 + 0.15 * view + 0.2 * corner.pixel.x() / 400) * corner.d_pixel_d_edge_shift;
    }
  }
  return corners;
}

TEST(EstimateTagEdgeDisplacements, MatchesLeastSquaresWithPriors) {
  const Lens lens = synthetic_lens();
  const auto views = make_displaced_views(4);
  for (const auto form : {DisplacementForm::varying, DisplacementForm::constant}) {
    const double uneven = form == DisplacementForm::constant ? 1e9 : 0.25;
    std::vector<double> separate_px;
    for (const auto& view : views) {
      separate_px.push_back(compute_expected_displacement(view, lens, Eigen::Vector4d::Zero(),
                                                          {1e-6, uneven, uneven, uneven})
                                .coefficients[0]);
    }
    std::sort(separate_px.begin(), separate_px.end());
    ASSERT_GT(separate_px[2] - separate_px[1], 0.05);
    const auto shifts = estimate_tag_edge_displacements(views, lens, form);
    ASSERT_EQ(shifts.size(), 4U);
    for (std::size_t i = 0; i < 4; ++i) {
      const EdgeDisplacement expected = compute_expected_displacement(
          views[i], lens, {separate_px[2], 0, 0, 0}, {0.25, uneven, uneven, uneven});
      EXPECT_LT((shifts[i].coefficients - expected.coefficients).norm(), 1e-5)
          << shifts[i].coefficients.transpose() << "; " << expected.coefficients.transpose();
      EXPECT_LT((shifts[i].middle - expected.middle).norm(), 1e-9);
      EXPECT_NEAR(shifts[i].radius_px, expected.radius_px, 1e-9);
    }
    EXPECT_EQ(std::abs(shifts[0].coefficients[1]) > 0.02, form == DisplacementForm::varying);
  }
}

TEST(EstimateTagEdgeDisplacements, ViewsOfFewerThanTwelveCornersGetMedian) {
  const Lens lens = synthetic_lens();
  auto views = make_displaced_views(3);
  views[1].resize(12);
  views.push_back(views[2]);
  views[3].resize(11);
  views.emplace_back();
  views.push_back(views[2]);  // without a pose
  for (auto& corner : views[5]) {
    corner.pixel.setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  views.push_back(views[3]);  // cannot move
  for (auto& corner : views[6]) corner.d_pixel_d_edge_shift.setZero();
  const auto shifts = estimate_tag_edge_displacements(views, lens);
  ASSERT_EQ(shifts.size(), 7U);
  std::vector<double> separate_px;
  for (std::size_t i = 0; i < 3; ++i) {
    separate_px.push_back(compute_expected_displacement(views[i], lens, Eigen::Vector4d::Zero(),
                                                        {1e-6, 0.25, 0.25, 0.25})
                              .coefficients[0]);
  }
  std::sort(separate_px.begin(), separate_px.end());
  EXPECT_GT(shifts[1].radius_px, 1) << "12 corners are enough";
  for (const std::size_t i : {3U, 5U}) {
    EXPECT_NEAR(shifts[i].coefficients[0], separate_px[1], 1e-5);
    EXPECT_EQ(shifts[i].coefficients.tail<3>(), Eigen::Vector3d(0, 0, 0));
    EXPECT_EQ(shifts[i].middle, Eigen::Vector2d(0, 0));
  }
  EXPECT_TRUE(shifts[4].coefficients.isZero(0));
  EXPECT_TRUE(shifts[6].coefficients.isZero(0));
}

TEST(EstimateTagEdgeDisplacements, IsZeroIfAllViewsHaveFewCorners) {
  auto views = make_displaced_views(2);
  for (auto& view : views) view.resize(8);
  const auto shifts = estimate_tag_edge_displacements(views, synthetic_lens());
  ASSERT_EQ(shifts.size(), 2U);
  for (const EdgeDisplacement& shift : shifts) EXPECT_TRUE(shift.coefficients.isZero(0));
}

}  // namespace
}  // namespace vlp
