// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/json_bounds.h"

#include <gmock/gmock.h>

#include <stdexcept>
#include <string>

#include "support/refused.h"

namespace vlp {
namespace {

using testing::HasSubstr;

std::string problem_of(const std::string& text) {
  return refusal_of<std::runtime_error>([&] { check_json_bounds(text); });
}

TEST(CheckJsonBounds, AcceptsLevelsAndValuesUpToLimits) {
  EXPECT_EQ(problem_of(""), "");
  EXPECT_EQ(problem_of(std::string(16, '[') + std::string(16, ']')), "");
  EXPECT_EQ(problem_of("[" + std::string(999'999, ',') + "]"), "");
}

TEST(CheckJsonBounds, ThrowsAboveLimits) {
  EXPECT_THAT(problem_of(std::string(17, '[')), HasSubstr("more than 16 levels"));
  EXPECT_THAT(problem_of(R"({"a":)" + std::string(16, '{')), HasSubstr("more than 16 levels"));
  EXPECT_THAT(problem_of("[" + std::string(1'000'000, ',')), HasSubstr("more than a million"));
}

TEST(CheckJsonBounds, IgnoresContentOfStrings) {
  EXPECT_EQ(problem_of("\"" + std::string(100, '[') + std::string(2'000'000, ',') + "\""), "");
  EXPECT_EQ(problem_of(R"("\"[[[[[[[[[[[[[[[[[[")"), "");
  EXPECT_THAT(problem_of(R"("\\")" + std::string(17, '[')), HasSubstr("levels"));
}

}  // namespace
}  // namespace vlp
