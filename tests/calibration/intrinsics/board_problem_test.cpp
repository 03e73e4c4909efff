// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/board_problem.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "calibration/intrinsics/intrinsics.h"
#include "calibration/intrinsics/synthetic_views.h"

namespace vlp {
namespace {

constexpr SolveOptions kLens{true, true, false, false};

/// Returns a problem with corner errors of 0.05 px beside its minimum.
BoardProblem make_problem_beside_minimum(LensModel lens_model, int num_views) {
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  Random random(5);
  IntrinsicsInput input = views.input(num_views, random, 0.05);
  input.lens_model = lens_model;
  BoardProblem problem = solve_intrinsics(input).problem;
  if (problem.intrinsics.empty()) return problem;
  problem.intrinsics[0] *= 1.005;
  for (BoardPose& pose : problem.poses) pose.translation_m += Eigen::Vector3d(0.002, -0.001, 0.003);
  return problem;
}

double compute_max_residual_difference_px(const BoardProblem& a, const BoardProblem& b) {
  const auto residuals_a = compute_reprojection_residuals(a),
             residuals_b = compute_reprojection_residuals(b);
  if (residuals_a.size() != residuals_b.size()) return std::numeric_limits<double>::infinity();
  double max_px = 0;
  for (std::size_t i = 0; i < residuals_a.size(); ++i) {
    if (residuals_a[i].allFinite() != residuals_b[i].allFinite())
      return std::numeric_limits<double>::infinity();
    if (residuals_a[i].allFinite())
      max_px = std::max(max_px, (residuals_a[i] - residuals_b[i]).norm());
  }
  return max_px;
}

class SolveIntermediateBoardProblem : public testing::TestWithParam<LensModel> {};

TEST_P(SolveIntermediateBoardProblem, ReachesMinimumOfFinalSolve) {
  const BoardProblem start = make_problem_beside_minimum(GetParam(), 12);
  ASSERT_FALSE(start.intrinsics.empty());
  BoardProblem intermediate = start, final = start;
  ASSERT_TRUE(solve_intermediate_board_problem(intermediate, kLens));
  ASSERT_TRUE(solve_board_problem(final, kLens));
  EXPECT_GT(compute_max_residual_difference_px(start, final), 1);
  EXPECT_LT(compute_max_residual_difference_px(intermediate, final), 0.001);
  EXPECT_NE(intermediate.intrinsics, final.intrinsics) << "not by Ceres with a larger tolerance";
}
INSTANTIATE_TEST_SUITE_P(Models, SolveIntermediateBoardProblem,
                         testing::Values(LensModel::opencv4, LensModel::opencv8,
                                         LensModel::stereographic, LensModel::fisheye),
                         [](const auto& model) {
                           std::string name(lens_model_name(model.param));
                           std::erase(name, '_');
                           return name;
                         });

/// Few corners hardly determine the rational distortion of OPENCV8: the regularization does.
TEST(SolveBoardProblemByCeres, RegularizesDistortionsLikeMrcal) {
  BoardProblem start = make_problem_beside_minimum(LensModel::opencv8, 3);
  ASSERT_FALSE(start.intrinsics.empty());
  for (std::size_t i = 0; i < start.points.size(); ++i) {
    if (i % 4 != 0) start.points[i].z() = BoardProblem::kUnseen;
  }
  BoardProblem by_ceres = start, by_mrcal = start;
  ASSERT_TRUE(solve_board_problem_by_ceres(by_ceres, kLens));
  ASSERT_TRUE(solve_board_problem_by_mrcal(by_mrcal, kLens));
  ASSERT_EQ(by_ceres.intrinsics.size(), by_mrcal.intrinsics.size());
  for (std::size_t i = 0; i < by_mrcal.intrinsics.size(); ++i)
    EXPECT_NEAR(by_ceres.intrinsics[i], by_mrcal.intrinsics[i], i < 4 ? 0.01 : 0.001) << i;
}

/// mrcal also solves for points behind the camera, Ceres only if the lens projects all points.
TEST(SolveIntermediateBoardProblem, SolvesByMrcalIfLensCannotProjectAllPoints) {
  BoardProblem start = make_problem_beside_minimum(LensModel::opencv8, 8);
  ASSERT_FALSE(start.intrinsics.empty());
  start.poses[0].translation_m.z() *= -1;
  BoardProblem by_ceres = start, intermediate = start, by_mrcal = start;
  ASSERT_FALSE(solve_board_problem_by_ceres(by_ceres, kLens));
  EXPECT_EQ(by_ceres.intrinsics, start.intrinsics);
  EXPECT_EQ(solve_intermediate_board_problem(intermediate, kLens),
            solve_board_problem(by_mrcal, kLens));
  EXPECT_EQ(intermediate.intrinsics, by_mrcal.intrinsics);
  EXPECT_NE(intermediate.intrinsics, start.intrinsics);
}

}  // namespace
}  // namespace vlp
