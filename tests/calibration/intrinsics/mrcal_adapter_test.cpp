// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <thread>

#include "calibration/intrinsics/intrinsics.h"
#include "calibration/intrinsics/synthetic_views.h"

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

}  // namespace
}  // namespace vlp
