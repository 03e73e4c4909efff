// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "calibration/intrinsics/board_problem.h"
#include "calibration/intrinsics/intrinsics.h"
#include "calibration/intrinsics/synthetic_views.h"
#include "camera/lens.h"
#include "support/random.h"

namespace vlp {
namespace {

/// mrcal reports outliers on stderr. Only the messages of other threads may appear there.
TEST(SolveIntrinsicsByMrcal, SuppressesMrcalMessagesButKeepsStderrOfOtherThreads) {
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  Random random(7);
  IntrinsicsInput input = views.input(15, random, 0.05);
  for (std::size_t i = 0; i < 10; ++i) input.views[i][3 * i].pixel.y() += 1.5;
  IntrinsicsSolution solution;
  std::string written;
  testing::internal::CaptureStderr();
  {
    std::atomic<bool> solved = false;
    const std::jthread solving([&] {
      solution = solve_intrinsics(input);
      solved = true;
    });
    while (!solved) {
      const std::string line = std::to_string(written.size()) + "\n";
      std::fputs(line.c_str(), stderr);
      written += line;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), written);
  ASSERT_TRUE(solution.has_succeeded());
  EXPECT_GE(solution.outliers, 10);
}

/// Returns a problem of exact measurements of boards of `cols` x `rows` points.
BoardProblem make_exact_mrcal_problem(LensModel model, int boards = 4, int cols = 7, int rows = 5) {
  const std::vector<BoardPose> poses{{{0.5, -0.3, 0.2}, {-0.08, -0.05, 0.3}},
                                     {{-0.4, 0.5, -0.1}, {-0.12, -0.06, 0.28}},
                                     {{0.1, 0.6, 0.3}, {-0.06, -0.07, 0.35}},
                                     {{-0.5, -0.4, 0.1}, {-0.1, -0.03, 0.32}}};
  BoardProblem problem{};
  problem.lens_model = model;
  problem.intrinsics = {500, 510, 405, 290};
  if (model == LensModel::opencv4) {
    problem.intrinsics.insert(problem.intrinsics.end(), {-0.1, 0.04, 0.002, -0.003});
  }
  problem.imager_px = {800, 600};
  problem.cols = cols;
  problem.rows = rows;
  problem.spacing_m = 0.03;
  problem.warp_m = {0.001, -0.002};
  problem.poses.assign(poses.begin(), poses.begin() + boards);
  const Lens lens(model, problem.intrinsics);
  for (const BoardPose& pose : problem.poses) {
    const Eigen::AngleAxisd rotation(pose.rotation.norm(), pose.rotation.normalized());
    for (int row = 0; row < rows; ++row) {
      for (int col = 0; col < cols; ++col) {
        const double x = 2.0 * col / (cols - 1) - 1, y = 2.0 * row / (rows - 1) - 1;
        const Eigen::Vector3d point(0.03 * col, 0.03 * row,
                                    0.001 * (1 - x * x) - 0.002 * (1 - y * y));
        const Eigen::Vector2d pixel =
            lens.project_point(rotation * point + pose.translation_m).value();
        problem.points.emplace_back(pixel.x(), pixel.y(), 1);
      }
    }
  }
  return problem;
}

constexpr SolveOptions kAllParameters{true, true, true, false};

/// Parameters of a problem in the order of the state.
std::vector<double*> list_state(BoardProblem& problem, const SolveOptions& options) {
  std::vector<double*> state;
  for (std::size_t i = 0; i < problem.intrinsics.size(); ++i) {
    if (i < 4 ? options.core : options.distortions) state.push_back(&problem.intrinsics[i]);
  }
  for (BoardPose& pose : problem.poses) {
    for (double& value : pose.rotation) state.push_back(&value);
    for (double& value : pose.translation_m) state.push_back(&value);
  }
  if (options.warp) {
    for (double& value : problem.warp_m) state.push_back(&value);
  }
  return state;
}

TEST(LinearizeBoardProblemByMrcal, MatchesDifferenceQuotientsInPixels) {
  BoardProblem problem = make_exact_mrcal_problem(LensModel::opencv4, 2);
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    problem.points[i] += Eigen::Vector3d(0.1, -0.2, -0.5 * static_cast<double>(i % 2));
  }
  problem.points[3].z() = BoardProblem::kUnseen;
  problem.points[8].z() = -0.7;
  for (const double noise_px : {1.0, 0.25}) {
    problem.noise_px = noise_px;
    for (const SolveOptions& options : {kAllParameters, SolveOptions{false, true, false, false},
                                        SolveOptions{true, false, false, false}}) {
      const Linearization at = linearize_board_problem_by_mrcal(problem, options);
      ASSERT_EQ(at.residuals_px.size(), 2 * 70);
      EXPECT_EQ(at.regularization.size() > 0, options.distortions);
      for (std::size_t i = 0; i < problem.points.size(); ++i) {
        const auto row = 2 * static_cast<Eigen::Index>(i);
        const double weight = std::max(0.0, problem.points[i].z());
        EXPECT_NEAR(at.residuals_px[row], -0.1 * weight, 1e-9) << i;
        EXPECT_NEAR(at.residuals_px[row + 1], 0.2 * weight, 1e-9) << i;
      }
      BoardProblem changed = problem;
      const auto state = list_state(changed, options);
      ASSERT_EQ(at.scale.size(), std::ssize(state));
      ASSERT_EQ(at.jacobian_transposed.rows(), std::ssize(state));
      EXPECT_EQ(at.first_intrinsic, options.core ? 0 : 4);
      EXPECT_EQ(at.poses, (options.core ? 4 : 0) + (options.distortions ? 4 : 0));
      const Eigen::MatrixXd jacobian = Eigen::MatrixXd(at.jacobian_transposed).transpose() *
                                       at.scale.cwiseInverse().asDiagonal();
      for (std::size_t k = 0; k < state.size(); ++k) {
        const double value = *state[k], step = 1e-6 * std::max(1.0, std::abs(value));
        const auto all_residuals = [&](double change) {
          *state[k] = value + change;
          const Linearization there = linearize_board_problem_by_mrcal(changed, options);
          *state[k] = value;
          Eigen::VectorXd all(there.residuals_px.size() + there.regularization.size());
          all << there.residuals_px, there.regularization;
          return all;
        };
        const Eigen::VectorXd expected = (all_residuals(step) - all_residuals(-step)) / (2 * step);
        const Eigen::VectorXd found = jacobian.col(static_cast<Eigen::Index>(k));
        ASSERT_EQ(found.size(), expected.size());
        EXPECT_LT((found - expected).norm(), 1e-5 * expected.norm()) << k;
        EXPECT_GT(expected.norm(), 0);
      }
    }
  }
}

TEST(LinearizeBoardProblemByMrcal, RegularizationIsProportionalToNoise) {
  BoardProblem problem = make_exact_mrcal_problem(LensModel::opencv4, 2);
  const Linearization one = linearize_board_problem_by_mrcal(problem, kAllParameters);
  problem.noise_px = 0.25;
  const Linearization quarter = linearize_board_problem_by_mrcal(problem, kAllParameters);
  ASSERT_GT(one.regularization.norm(), 0);
  EXPECT_LT((quarter.regularization - 0.25 * one.regularization).norm(),
            1e-12 * one.regularization.norm());
}

TEST(SolveBoardProblemByMrcal, ReturnsTrueParametersOfPinhole) {
  const BoardProblem truth = make_exact_mrcal_problem(LensModel::pinhole);
  BoardProblem problem = truth;
  problem.intrinsics = {480, 530, 390, 310};
  problem.warp_m.setZero();
  for (BoardPose& pose : problem.poses) pose.translation_m.z() *= 1.05;
  ASSERT_TRUE(solve_board_problem_by_mrcal(problem, kAllParameters));
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_NEAR(problem.intrinsics[k], truth.intrinsics[k], 1e-3);
  }
  EXPECT_LT((problem.warp_m - truth.warp_m).norm(), 1e-6);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_LT((problem.poses[i].rotation - truth.poses[i].rotation).norm(), 1e-5);
    EXPECT_LT((problem.poses[i].translation_m - truth.poses[i].translation_m).norm(), 1e-5);
  }
}

TEST(SolveBoardProblemByMrcal, KeepsParametersThatAreNotSelected) {
  const BoardProblem truth = make_exact_mrcal_problem(LensModel::opencv4);
  BoardProblem problem = truth;
  for (BoardPose& pose : problem.poses) pose.translation_m.z() *= 1.02;
  ASSERT_TRUE(solve_board_problem_by_mrcal(problem, {false, false, false, false}));
  EXPECT_EQ(problem.intrinsics, truth.intrinsics);
  EXPECT_EQ(problem.warp_m, truth.warp_m);
  EXPECT_LT((problem.poses[2].translation_m - truth.poses[2].translation_m).norm(), 1e-5);
}

TEST(SolveBoardProblemByMrcal, MarksOutliersOnRequestOnly) {
  for (const bool reject : {true, false}) {
    BoardProblem problem = make_exact_mrcal_problem(LensModel::pinhole);
    Random random(3);
    for (auto& point : problem.points) {
      const double v = random.normal(), u = random.normal();
      point += Eigen::Vector3d(0.05 * u, 0.05 * v, -0.25);
    }
    problem.points[20].x() += 4;
    problem.points[21].z() = BoardProblem::kUnseen;
    problem.points[22].z() = -0.5;
    const BoardProblem before = problem;
    ASSERT_TRUE(solve_board_problem_by_mrcal(problem, {true, true, true, reject}));
    for (std::size_t i = 0; i < problem.points.size(); ++i) {
      EXPECT_EQ(problem.points[i].z(), (reject && i == 20 ? -1 : 1) * before.points[i].z()) << i;
      EXPECT_EQ(problem.points[i].x(), before.points[i].x());
    }
    EXPECT_EQ(std::abs(problem.intrinsics[0] - 500) < 1, reject);
  }
}

/// The regularization pulls the distortions to zero, less with smaller noise.
TEST(SolveBoardProblemByMrcal, ErrorByRegularizationDecreasesWithSquareOfNoise) {
  std::vector<double> errors;
  for (const double noise_px : {1.0, 0.2}) {
    const BoardProblem truth = make_exact_mrcal_problem(LensModel::opencv4);
    BoardProblem problem = truth;
    problem.noise_px = noise_px;
    ASSERT_TRUE(solve_board_problem_by_mrcal(problem, kAllParameters));
    errors.push_back(problem.intrinsics[5] - truth.intrinsics[5]);
  }
  ASSERT_GT(std::abs(errors[0]), 1e-5);
  EXPECT_NEAR(errors[1] / errors[0], 0.04, 0.02);
}

/// At the minimum the gradients of the corners and of the fixed ray cancel each other.
TEST(SolveBoardProblemByMrcal, WeightsFixedRayLikeCorner) {
  for (const double noise_px : {1.0, 0.2}) {
    BoardProblem problem = make_exact_mrcal_problem(LensModel::pinhole);
    problem.noise_px = noise_px;
    const Eigen::Vector3d ray(0.8, -0.4, 2);
    problem.fixed_rays.push_back({{600, 180}, ray});  // from (605, 188)
    ASSERT_TRUE(solve_board_problem_by_mrcal(problem, kAllParameters));
    const Lens lens(problem.lens_model, problem.intrinsics);
    const auto projection = lens.project_point_with_jacobians(ray);
    ASSERT_TRUE(projection);
    const Eigen::Vector4d of_ray = projection->d_pixel_d_parameters.transpose() *
                                   (projection->pixel - problem.fixed_rays[0].pixel);
    const Linearization at = linearize_board_problem_by_mrcal(problem, kAllParameters);
    const Eigen::VectorXd packed =
        at.jacobian_transposed.leftCols(at.residuals_px.size()) * at.residuals_px;
    const Eigen::Vector4d of_corners = packed.head<4>().cwiseQuotient(at.scale.head<4>());
    EXPECT_GT(of_ray.norm(), 1);
    EXPECT_LT((of_ray + of_corners).norm(), 0.01 * of_ray.norm());
  }
}

TEST(SolveBoardProblemByMrcal, NeedsAsManyResidualsAsUnknowns) {
  const SolveOptions core_only{true, false, false, false};
  // One board of 2 x 2 points: 8 residuals, 10 unknowns. Two of them: 16 of each.
  BoardProblem one = make_exact_mrcal_problem(LensModel::pinhole, 1, 2, 2);
  EXPECT_FALSE(solve_board_problem_by_mrcal(one, core_only));
  BoardProblem two = make_exact_mrcal_problem(LensModel::pinhole, 2, 2, 2);
  EXPECT_TRUE(solve_board_problem_by_mrcal(two, core_only));
}

TEST(SolveBoardProblemByMrcal, ThrowsForModelThatMrcalLacks) {
  BoardProblem problem = make_exact_mrcal_problem(LensModel::pinhole);
  problem.lens_model = LensModel::fisheye;
  problem.intrinsics.resize(8, 0);
  std::string message;
  try {
    solve_board_problem_by_mrcal(problem, kAllParameters);
  } catch (const std::runtime_error& error) {
    message = error.what();
  }
  EXPECT_EQ(message, "mrcal does not support OPENCV_FISHEYE");
}

}  // namespace
}  // namespace vlp
