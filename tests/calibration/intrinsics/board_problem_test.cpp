// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/board_problem.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "calibration/intrinsics/intrinsics.h"
#include "calibration/intrinsics/rotation_vector.h"
#include "calibration/intrinsics/synthetic_views.h"
#include "support/matchers.h"

namespace vlp {
namespace {

constexpr SolveOptions kLens{.core = true, .distortions = true};

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
  const auto residuals_a = compute_board_residuals(a), residuals_b = compute_board_residuals(b);
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

class SolveIntermediateStage : public testing::TestWithParam<LensModel> {};

TEST_P(SolveIntermediateStage, ReachesMinimumOfFinalSolve) {
  const BoardProblem start = make_problem_beside_minimum(GetParam(), 12);
  ASSERT_FALSE(start.intrinsics.empty());
  BoardProblem intermediate = start, final = start;
  ASSERT_TRUE(solve_intermediate_stage(intermediate, kLens));
  ASSERT_TRUE(solve_board_problem(final, kLens));
  EXPECT_GT(compute_max_residual_difference_px(start, final), 1);
  EXPECT_LT(compute_max_residual_difference_px(intermediate, final), 0.001);
  EXPECT_NE(intermediate.intrinsics, final.intrinsics) << "not by Ceres with a larger tolerance";
}
INSTANTIATE_TEST_SUITE_P(Models, SolveIntermediateStage,
                         testing::Values(LensModel::opencv4, LensModel::opencv8,
                                         LensModel::stereographic, LensModel::fisheye),
                         [](const auto& model) {
                           std::string name(lens_model_name(model.param));
                           std::erase(name, '_');
                           return name;
                         });

/// Few corners hardly determine the rational distortion of OPENCV8: the regularization does.
TEST(SolveByCeres, RegularizesDistortionsLikeMrcal) {
  BoardProblem start = make_problem_beside_minimum(LensModel::opencv8, 3);
  ASSERT_FALSE(start.intrinsics.empty());
  for (std::size_t i = 0; i < start.points.size(); ++i) {
    if (i % 4 != 0) start.points[i].z() = BoardProblem::kUnseen;
  }
  BoardProblem by_ceres = start, by_mrcal = start;
  ASSERT_TRUE(solve_by_ceres(by_ceres, kLens));
  ASSERT_TRUE(solve_by_mrcal(by_mrcal, kLens));
  ASSERT_EQ(by_ceres.intrinsics.size(), by_mrcal.intrinsics.size());
  for (std::size_t i = 0; i < by_mrcal.intrinsics.size(); ++i)
    EXPECT_NEAR(by_ceres.intrinsics[i], by_mrcal.intrinsics[i], i < 4 ? 0.01 : 0.001) << i;
}

/// Returns the position of a lattice point on the warped board, m (BoardProblem).
Eigen::Vector3d compute_warped_point(const BoardProblem& problem, std::size_t index) {
  const auto cols = static_cast<std::size_t>(problem.cols);
  const double i = static_cast<double>(index % cols), j = static_cast<double>(index / cols);
  const double across = 2 * i / (problem.cols - 1) - 1, down = 2 * j / (problem.rows - 1) - 1;
  return {problem.spacing_m * i, problem.spacing_m * j,
          problem.warp_m.x() * (1 - across * across) + problem.warp_m.y() * (1 - down * down)};
}

/// Returns a problem of four boards of 10 x 8 points with exact measurements of weight 1.
BoardProblem make_exact_problem(LensModel model = LensModel::fisheye) {
  BoardProblem problem{};
  problem.lens_model = model;
  problem.intrinsics = {290, 295, 402, 297};
  if (model == LensModel::fisheye)
    problem.intrinsics.insert(problem.intrinsics.end(), {0.03, -0.012, 0.004, -0.0006});
  if (model == LensModel::opencv8) {
    problem.intrinsics.insert(problem.intrinsics.end(),
                              {-0.25, 0.08, 2e-4, -1e-4, -0.012, 0.01, 0.002, 1e-4});
  }
  problem.imager_px = {800, 600};
  problem.cols = 10;
  problem.rows = 8;
  problem.spacing_m = 0.02;
  problem.warp_m = {0.0006, -0.0004};
  problem.poses = {{{0.5, -0.3, 0.2}, {-0.08, -0.05, 0.25}},
                   {{-0.4, 0.5, -0.1}, {-0.12, -0.06, 0.22}},
                   {{0.1, 0.6, 0.3}, {-0.02, -0.09, 0.3}},
                   {{-0.5, -0.4, 0.1}, {-0.15, 0.0, 0.28}}};
  const Lens lens(model, problem.intrinsics);
  for (const BoardPose& pose : problem.poses) {
    for (std::size_t i = 0; i < problem.points_per_board(); ++i) {
      const auto pixel = lens.project_point(rotation_from_vector(pose.rotation) *
                                                compute_warped_point(problem, i) +
                                            pose.translation_m);
      problem.points.emplace_back(pixel.value().x(), pixel.value().y(), 1);
    }
  }
  return problem;
}

/// Moves all parameters of a problem, the warp and the distortions on request.
BoardProblem perturb(BoardProblem problem, bool distortions, bool warp) {
  problem.intrinsics[0] *= 1.01;
  problem.intrinsics[1] *= 0.99;
  problem.intrinsics[2] += 2;
  problem.intrinsics[3] -= 3;
  for (std::size_t i = 4; distortions && i < problem.intrinsics.size(); ++i)
    problem.intrinsics[i] *= 0.9;
  if (warp) problem.warp_m = {0, 0};
  for (BoardPose& pose : problem.poses) {
    pose.rotation += Eigen::Vector3d(0.02, -0.01, 0.015);
    pose.translation_m += Eigen::Vector3d(0.002, -0.001, 0.003);
  }
  return problem;
}

void expect_same_parameters(const BoardProblem& found, const BoardProblem& truth,
                            double tolerance) {
  ASSERT_EQ(found.intrinsics.size(), truth.intrinsics.size());
  for (std::size_t i = 0; i < truth.intrinsics.size(); ++i)
    EXPECT_NEAR(found.intrinsics[i], truth.intrinsics[i], tolerance * (i < 4 ? 100 : 1)) << i;
  EXPECT_THAT(found.warp_m, IsNear(truth.warp_m, tolerance));
  ASSERT_EQ(found.poses.size(), truth.poses.size());
  for (std::size_t i = 0; i < truth.poses.size(); ++i) {
    EXPECT_THAT(found.poses[i].rotation, IsNear(truth.poses[i].rotation, tolerance)) << i;
    EXPECT_THAT(found.poses[i].translation_m, IsNear(truth.poses[i].translation_m, tolerance)) << i;
  }
}

TEST(SolveBoardProblem, ReturnsTrueParametersOfFisheyeWithWarp) {
  const BoardProblem truth = make_exact_problem();
  BoardProblem problem = perturb(truth, true, true);
  ASSERT_TRUE(solve_board_problem(problem, {.core = true, .distortions = true, .warp = true}));
  expect_same_parameters(problem, truth, 1e-7);
}

TEST(SolveBoardProblem, KeepsParametersThatAreNotSolved) {
  const BoardProblem truth = make_exact_problem();
  BoardProblem core = perturb(truth, false, false);
  ASSERT_TRUE(solve_board_problem(core, {.core = true}));
  expect_same_parameters(core, truth, 1e-7);
  for (std::size_t i = 4; i < 8; ++i) EXPECT_EQ(core.intrinsics[i], truth.intrinsics[i]);
  EXPECT_EQ(core.warp_m, truth.warp_m);
  BoardProblem poses = perturb(truth, false, false);
  poses.intrinsics = truth.intrinsics;
  ASSERT_TRUE(solve_board_problem(poses, {}));
  expect_same_parameters(poses, truth, 1e-7);
  EXPECT_EQ(poses.intrinsics, truth.intrinsics);
  BoardProblem flat = perturb(truth, true, true);
  ASSERT_TRUE(solve_board_problem(flat, {.core = true, .distortions = true}));
  EXPECT_EQ(flat.warp_m, Eigen::Vector2d(0, 0));
  EXPECT_GT(compute_max_residual_difference_px(flat, truth), 0.01);
}

/// Returns a problem with different weights, residuals, an outlier and a point that is not seen.
BoardProblem make_problem_to_linearize(LensModel model) {
  BoardProblem problem = perturb(make_exact_problem(model), true, false);
  for (std::size_t i = 0; i < problem.points.size(); ++i)
    problem.points[i].z() = 0.5 + 0.01 * static_cast<double>(i % 50);
  problem.points[3].z() = -0.7;
  problem.points[120].z() = BoardProblem::kUnseen;
  return problem;
}

/// Returns the entry of the state: intrinsics, poses, warp.
double& state_entry(BoardProblem& problem, std::size_t index) {
  const std::size_t intrinsics = problem.intrinsics.size(), poses = 6 * problem.poses.size();
  if (index < intrinsics) return problem.intrinsics[index];
  index -= intrinsics;
  if (index >= poses) return problem.warp_m[static_cast<Eigen::Index>(index - poses)];
  BoardPose& pose = problem.poses[index / 6];
  const auto k = static_cast<Eigen::Index>(index % 6);
  return k < 3 ? pose.rotation[k] : pose.translation_m[k - 3];
}

Eigen::VectorXd compute_weighted_residuals(const BoardProblem& problem) {
  Eigen::VectorXd residuals =
      Eigen::VectorXd::Zero(static_cast<Eigen::Index>(2 * problem.points.size()));
  const Lens lens(problem.lens_model, problem.intrinsics);
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    if (!(problem.points[i].z() > 0)) continue;
    const BoardPose& pose = problem.poses[i / problem.points_per_board()];
    const auto pixel =
        lens.project_point(rotation_from_vector(pose.rotation) *
                               compute_warped_point(problem, i % problem.points_per_board()) +
                           pose.translation_m);
    residuals.segment<2>(static_cast<Eigen::Index>(2 * i)) =
        problem.points[i].z() * (pixel.value() - problem.points[i].head<2>());
  }
  return residuals;
}

TEST(LinearizeAnalytically, MatchesDifferenceQuotients) {
  const BoardProblem problem = make_problem_to_linearize(LensModel::fisheye);
  for (const bool warp : {false, true}) {
    const Linearization at =
        linearize_analytically(problem, {.core = true, .distortions = true, .warp = warp});
    const std::size_t states = 8 + 6 * 4 + (warp ? 2 : 0);
    ASSERT_EQ(at.jacobian_transposed.rows(), static_cast<Eigen::Index>(states));
    ASSERT_EQ(at.jacobian_transposed.cols(), 640);
    EXPECT_EQ(at.first_intrinsic, 0);
    EXPECT_EQ(at.poses, 8);
    EXPECT_EQ(at.regularization.size(), 0);
    EXPECT_THAT(at.residuals_px, IsNear(compute_weighted_residuals(problem), 1e-9));
    const Eigen::MatrixXd packed = Eigen::MatrixXd(at.jacobian_transposed);
    for (std::size_t k = 0; k < states; ++k) {
      const auto row = static_cast<Eigen::Index>(k);
      BoardProblem lower = problem, upper = problem;
      const double step = k < 4 ? 1e-3 : 1e-6;
      state_entry(lower, k) -= step;
      state_entry(upper, k) += step;
      const Eigen::VectorXd quotient =
          (compute_weighted_residuals(upper) - compute_weighted_residuals(lower)) / (2 * step);
      EXPECT_NEAR(packed.row(row).norm(), 1, 1e-9) << k;
      EXPECT_THAT((packed.row(row).transpose() / at.scale[row]).eval(),
                  IsNear(quotient, 1e-6 * quotient.norm()))
          << k;
    }
  }
}

TEST(LinearizeBoardProblem, MatchesMrcalForOpencv8) {
  const BoardProblem problem = make_problem_to_linearize(LensModel::opencv8);
  const SolveOptions options{.core = true, .distortions = true, .warp = true};
  const Linearization by_mrcal = linearize_board_problem(problem, options),
                      analytic = linearize_analytically(problem, options);
  EXPECT_GT(by_mrcal.regularization.size(), 0);
  ASSERT_EQ(by_mrcal.poses, analytic.poses);
  ASSERT_EQ(by_mrcal.residuals_px.size(), analytic.residuals_px.size());
  EXPECT_THAT(by_mrcal.residuals_px, IsNear(analytic.residuals_px, 1e-6));
  const auto unpack = [](const Linearization& at) -> Eigen::MatrixXd {
    return (at.scale.cwiseInverse().asDiagonal() * Eigen::MatrixXd(at.jacobian_transposed))
        .leftCols(at.residuals_px.size());
  };
  const Eigen::MatrixXd expected = unpack(by_mrcal), found = unpack(analytic);
  ASSERT_EQ(found.rows(), expected.rows());
  for (Eigen::Index k = 0; k < found.rows(); ++k)
    EXPECT_LT((found.row(k) - expected.row(k)).norm(), 1e-6 * expected.row(k).norm()) << k;
  EXPECT_EQ(linearize_board_problem(make_exact_problem(), options).regularization.size(), 0);
}

TEST(ComputeBoardResiduals, ReturnsMeasuredMinusProjected) {
  BoardProblem problem = make_exact_problem();
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    problem.points[i].head<2>() += Eigen::Vector2d(0.01 * static_cast<double>(i), -0.5);
    problem.points[i].z() = i % 3 == 0 ? -2 : 3;
  }
  problem.points[100].z() = BoardProblem::kUnseen;
  const auto residuals = compute_board_residuals(problem);
  ASSERT_EQ(residuals.size(), 320U);
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    if (i == 100) {
      EXPECT_TRUE(std::isnan(residuals[i].x()) && std::isnan(residuals[i].y()));
    } else {
      EXPECT_THAT(residuals[i], IsNear(Eigen::Vector2d(0.01 * static_cast<double>(i), -0.5), 1e-9));
    }
  }
}

}  // namespace
}  // namespace vlp
