// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/session_results.h"

#include <gmock/gmock.h>

#include "rig/input_error.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::ThrowsMessage;

class SessionResultsTest : public testing::Test {
 protected:
  /// A folder in which lens and rotation have ended, with an output each.
  void keep_two_steps(SessionResults& kept) const {
    kept.plan(kPlan);
    folder.file("results/lens.yaml", "lens");
    kept.keep("lens", "key of the lens", StepResult());
    folder.file("results/rotated.yaml", "rotated");
    kept.keep("rotation", "key of the rotation", StepResult());
  }
  const std::vector<StepOutputs> kPlan{{"lens", {"lens.yaml"}}, {"rotation", {"rotated.yaml"}}};
  const TemporaryFolder folder;
  const fs::path results = folder / "results", session = folder / "session";
};

TEST_F(SessionResultsTest, StepsHoldWhileTheirInputsAndOutputsAreAsTheyWere) {
  SessionResults kept(results, session);
  EXPECT_FALSE(kept.kept("lens", "key of the lens"));
  keep_two_steps(kept);
  EXPECT_TRUE(kept.kept("lens", "key of the lens"));
  EXPECT_FALSE(kept.kept("lens", "another key"));
  folder.file("results/lens.yaml", "changed");
  EXPECT_FALSE(kept.kept("lens", "key of the lens"));
  EXPECT_TRUE(kept.kept("rotation", "key of the rotation"));
  fs::remove(results / "rotated.yaml");
  EXPECT_FALSE(kept.kept("rotation", "key of the rotation"));
}

TEST_F(SessionResultsTest, WhatWasABadFileIsTriedAgain) {
  SessionResults kept(results, session);
  kept.plan(kPlan);
  StepResult bad, undetermined;
  bad.fail(StepFailure::bad_input, "cut");
  undetermined.fail(StepFailure::undetermined, "too few");
  kept.keep("lens", "key", bad);
  EXPECT_FALSE(kept.kept("lens", "key"));
  kept.keep("lens", "key", undetermined);
  ASSERT_TRUE(kept.kept("lens", "key"));
  EXPECT_EQ(kept.kept("lens", "key")->why, "too few");
}

TEST_F(SessionResultsTest, NothingStaysThatTheRunDoesNotMake) {
  {
    SessionResults before(results, session);
    keep_two_steps(before);
    folder.file("results/line-x-fixes.csv", "of a drive");
    folder.file("results/mine.txt", "of somebody");
  }
  SessionResults now(results, session);
  now.plan({{"lens", {"lens.yaml"}}});
  EXPECT_TRUE(now.kept("lens", "key of the lens"));
  EXPECT_FALSE(fs::exists(results / "rotated.yaml"));
  EXPECT_FALSE(fs::exists(results / "steps/rotation.json"));
  EXPECT_FALSE(fs::exists(results / "line-x-fixes.csv"));
  EXPECT_TRUE(fs::exists(results / "mine.txt"));
}

TEST_F(SessionResultsTest, WhatIsBehindAStepThatFailedIsForgotten) {
  SessionResults kept(results, session);
  keep_two_steps(kept);
  kept.forget_behind("lens");
  EXPECT_TRUE(kept.kept("lens", "key of the lens"));
  EXPECT_FALSE(fs::exists(results / "rotated.yaml"));
  kept.forget("lens");
  EXPECT_FALSE(fs::exists(results / "lens.yaml"));
  EXPECT_FALSE(kept.kept("lens", "key of the lens"));
}

TEST_F(SessionResultsTest, BelongToOneSessionAndOneRunAtATime) {
  const auto take = [&](const fs::path& of) { return [&, of] { SessionResults(results, of); }; };
  {
    const SessionResults taken(results, session);
    EXPECT_THAT(take(session),
                ThrowsMessage<InputError>(HasSubstr("another run is at work there")));
  }
  EXPECT_NO_THROW(take(session)());
  EXPECT_THAT(take(folder / "another"),
              ThrowsMessage<InputError>(HasSubstr("holds the results of another session")));
  fs::create_directory(folder / "mine");
  folder.file("mine/calibration.yaml", "of somebody");
  EXPECT_THAT([&] { SessionResults(folder / "mine", session); },
              ThrowsMessage<InputError>(HasSubstr("holds calibration.yaml, which is not of")));
}

}  // namespace
}  // namespace vlp
