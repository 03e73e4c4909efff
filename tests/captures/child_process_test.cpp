// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/child_process.h"

#include <gtest/gtest.h>

#include <chrono>

namespace vlp {
namespace {

constexpr std::size_t kMaxBytes = std::size_t{1} << 24;

TEST(RunChild, PassesInputAndReturnsWholeOutputWithoutStderr) {
  const std::string input(3'000'000, 'x');  // more than a pipe holds
  const ChildResult result = run_child({.words = {"sh", "-c", "cat; echo error >&2"},
                                        .input = input,
                                        .time_limit_s = 60,
                                        .max_output_bytes = kMaxBytes});
  EXPECT_TRUE(result.has_succeeded());
  EXPECT_TRUE(result.output == input) << result.output.size();
}

TEST(RunChild, KeepsEndOfOutputWithStderr) {
  const ChildResult result = run_child({.words = {"sh", "-c", "printf abc; printf def >&2; exit 3"},
                                        .time_limit_s = 60,
                                        .max_output_bytes = 4,
                                        .has_stderr = true});
  ASSERT_TRUE(result.status);
  EXPECT_FALSE(result.has_succeeded());
  EXPECT_EQ(result.output, "cdef");
}

TEST(RunChild, KillsGroupAtTimeLimit) {
  const auto begun = std::chrono::steady_clock::now();
  const ChildResult result = run_child({.words = {"sh", "-c", "sleep 60 & sleep 60"},
                                        .time_limit_s = 0.1,
                                        .max_output_bytes = kMaxBytes});
  EXPECT_FALSE(result.status);
  EXPECT_EQ(result.start_error + result.status_error, "");
  EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(30));
}

TEST(RunChild, StatesWhyProgramCannotBeStarted) {
  const ChildResult result =
      run_child({.words = {"./no-such-program"}, .time_limit_s = 1, .max_output_bytes = kMaxBytes});
  EXPECT_EQ(result.start_error, "No such file or directory");
  EXPECT_FALSE(result.has_succeeded());
}

}  // namespace
}  // namespace vlp
