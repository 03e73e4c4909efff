// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// What a robot carries.
#include <gmock/gmock.h>

#include <algorithm>

#include "support/program.h"

namespace vlp {
namespace {

TEST(SharedLibrary, NeedsNoneOfTheToolboxsLibraries) {
  auto result = run_program("ldd '" VLP_SHARED_LIBRARY "'");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  std::string& needed = result.output;
  ASSERT_THAT(needed, testing::HasSubstr("yaml-cpp"));
  std::transform(needed.begin(), needed.end(), needed.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const char* library :
       {"opencv", "mrcal", "ceres", "apriltag", "spdlog", "fmt", "libcsv", "cholmod"}) {
    EXPECT_THAT(needed, testing::Not(testing::HasSubstr(library)));
  }
}

}  // namespace
}  // namespace vlp
