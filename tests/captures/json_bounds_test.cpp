// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/json_bounds.h"

#include <gmock/gmock.h>

#include <stdexcept>
#include <string>

#include "support/rejection_message.h"

namespace vlp {
namespace {

using testing::HasSubstr;

std::string error_message(const std::string& text) {
  return rejection_message<std::runtime_error>([&] { check_json_bounds(text); });
}

TEST(CheckJsonBounds, AcceptsLevelsAndValuesUpToLimits) {
  EXPECT_EQ(error_message(""), "");
  EXPECT_EQ(error_message(std::string(16, '[') + std::string(16, ']')), "");
  EXPECT_EQ(error_message("[" + std::string(999'999, ',') + "]"), "");
}

TEST(CheckJsonBounds, ThrowsAboveLimits) {
  EXPECT_THAT(error_message(std::string(17, '[')), HasSubstr("more than 16 levels"));
  EXPECT_THAT(error_message(R"({"a":)" + std::string(16, '{')), HasSubstr("more than 16 levels"));
  EXPECT_THAT(error_message("[" + std::string(1'000'000, ',')), HasSubstr("more than a million"));
}

TEST(CheckJsonBounds, IgnoresContentOfStrings) {
  EXPECT_EQ(error_message("\"" + std::string(100, '[') + std::string(2'000'000, ',') + "\""), "");
  EXPECT_EQ(error_message(R"("\"[[[[[[[[[[[[[[[[[[")"), "");
  EXPECT_THAT(error_message(R"("\\")" + std::string(17, '[')), HasSubstr("levels"));
}

}  // namespace
}  // namespace vlp
