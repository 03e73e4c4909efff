// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "session/adjust_step.h"
#include "support/rejection_message.h"

namespace vlp {
namespace {

TEST(ReplaceDuplicateSetNamesByPaths, UsesPathsForEqualNames) {
  std::vector<AdjustSet> sets{{"check", {}, {}}, {"rotation", {}, {}}, {"check", {}, {}}};
  replace_duplicate_set_names_by_paths(sets, {"a/check", "a/rotation", "b/check"});
  EXPECT_EQ(sets[0].name, "a/check");
  EXPECT_EQ(sets[1].name, "rotation");
  EXPECT_EQ(sets[2].name, "b/check");
  EXPECT_THAT(rejection_message<std::invalid_argument>([&] {
                replace_duplicate_set_names_by_paths(sets, {"a/check", "a/rotation", "a/check"});
              }),
              testing::StartsWith("a/check is named twice"));
}

}  // namespace
}  // namespace vlp
