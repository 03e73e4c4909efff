// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
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

constexpr SolveOptions kAllParameters{.core = true, .distortions = true, .warp = true};

TEST(SolveByMrcal, ErrorByRegularizationDecreasesWithSquareOfNoise) {
  std::vector<double> errors;
  for (const double noise_px : {1.0, 0.2}) {
    const BoardProblem truth = make_exact_mrcal_problem(LensModel::opencv4);
    BoardProblem problem = truth;
    problem.noise_px = noise_px;
    ASSERT_TRUE(solve_by_mrcal(problem, kAllParameters));
    errors.push_back(problem.intrinsics[5] - truth.intrinsics[5]);
  }
  ASSERT_GT(std::abs(errors[0]), 1e-5);
  EXPECT_NEAR(errors[1] / errors[0], 0.04, 0.02);
}

TEST(SolveByMrcal, ThrowsForModelThatMrcalLacks) {
  BoardProblem problem = make_exact_mrcal_problem(LensModel::pinhole);
  problem.lens_model = LensModel::fisheye;
  problem.intrinsics.resize(8, 0);
  std::string message;
  try {
    solve_by_mrcal(problem, kAllParameters);
  } catch (const std::runtime_error& error) {
    message = error.what();
  }
  EXPECT_EQ(message, "mrcal does not support OPENCV_FISHEYE");
}

}  // namespace
}  // namespace vlp
