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
  void keep_two_steps(SessionResults& cached_result) const {
    cached_result.set_steps(kPlan);
    folder.file("results/lens.yaml", "lens");
    cached_result.store_step_result("lens", "key of the lens", StepResult());
    folder.file("results/rotated.yaml", "rotated");
    cached_result.store_step_result("rotation", "key of the rotation", StepResult());
  }
  const std::vector<StepOutputs> kPlan{{"lens", {"lens.yaml"}}, {"rotation", {"rotated.yaml"}}};
  const TemporaryFolder folder;
  const fs::path results = folder / "results", session = folder / "session";
};

TEST_F(SessionResultsTest, KeepsOutputsOfLastRunUntilThoseOfThisRunArePublished) {
  {
    SessionResults before(results, session);
    keep_two_steps(before);
  }
  {
    SessionResults killed(results, session);
    killed.set_steps({kPlan[0]});
    killed.remove_outputs("lens");
    EXPECT_EQ(killed.results_file_path("lens.yaml"), results / "steps/new/lens.yaml");
    folder.file("results/steps/new/lens.yaml", "new");
    killed.store_step_result("lens", "new key", StepResult());
    EXPECT_EQ(TemporaryFolder::read_content(results / "lens.yaml"), "lens");
    EXPECT_TRUE(fs::exists(results / "rotated.yaml"));
  }
  SessionResults now(results, session);
  now.set_steps(kPlan);
  EXPECT_TRUE(now.find_cached("lens", "new key"));
  EXPECT_TRUE(now.find_cached("rotation", "key of the rotation"));
  now.remove_outputs("rotation");  // which has no output this time
  EXPECT_TRUE(fs::exists(results / "rotated.yaml"));
  now.publish_outputs();
  EXPECT_EQ(TemporaryFolder::read_content(results / "lens.yaml"), "new");
  EXPECT_TRUE(now.find_cached("lens", "new key"));
  EXPECT_FALSE(fs::exists(results / "rotated.yaml"));
  EXPECT_FALSE(fs::exists(results / "steps/new"));
}

TEST_F(SessionResultsTest, WriteRefusalJunitReplacesFileOfAnySession) {
  { const SessionResults taken(results, session); }
  const std::string owner = TemporaryFolder::read_content(results / "steps/session");
  for (const fs::path& other : {folder / "another", session, fs::path()}) {
    const std::string words = "refused " + other.string();
    write_refusal_junit(results, other, words);
    EXPECT_THAT(TemporaryFolder::read_content(results / "junit.xml"), HasSubstr(words));
  }
  EXPECT_EQ(TemporaryFolder::read_content(results / "steps/session"), owner);
  fs::remove_all(results);
  fs::create_directories(results / "boards");
  write_refusal_junit(results, session, "refused");
  EXPECT_FALSE(fs::exists(results / "junit.xml")) << "no results";
}

TEST_F(SessionResultsTest, KeepsForeignFilesAndRejectsThemAsOutputs) {
  fs::create_directories(results / "steps");
  const std::vector<std::string> mine{"line-a-fixes.csv", "steps/mine.json", "steps/line-a.json"};
  for (const std::string& name : mine) folder.file("results/" + name, "mine");
  {
    SessionResults first(results, session);
    first.set_steps(kPlan);
    folder.file("results/lens.svg", "mine, beside results");
    first.set_steps(kPlan);
    first.remove_evaluation();
    first.remove_all_outputs();
  }
  for (const std::string& name : mine) {
    EXPECT_EQ(TemporaryFolder::read_content(results / name), "mine") << name;
  }
  EXPECT_TRUE(fs::exists(results / "lens.svg"));
  SessionResults next(results, session);
  EXPECT_THAT(
      [&] {
        next.set_steps({{"lens", {"lens.yaml", "lens.svg"}}});
      },
      ThrowsMessage<InputError>(HasSubstr("holds lens.svg, which is not of vlp-calibrate")));
}

TEST_F(SessionResultsTest, RemovesNoFileOutsideResultsFolderDespiteForgedOutputList) {
  folder.file("outside.txt", "mine");
  { const SessionResults taken(results, session); }
  folder.file("results/steps/outputs", "../outside.txt\nsteps/../../outside.txt\n" +
                                           (folder / "outside.txt").string() + "\n..\n");
  SessionResults taken(results, session);
  taken.set_steps(kPlan);
  taken.remove_all_outputs();
  EXPECT_TRUE(fs::exists(folder / "outside.txt"));
}

TEST_F(SessionResultsTest, RemovesOnlyKnownOutputNamesOfForgedOutputList) {
  { const SessionResults taken(results, session); }
  folder.file("results/mine.txt", "mine");
  folder.file("results/line-x", "mine");
  folder.file("results/report.html", "of a run");
  const std::string end_of_name = std::string(1, '\0') + "-fixes.csv\n";
  folder.file("results/steps/outputs",
              "steps/lock\nsteps/session\nsteps/outputs\nmine.txt\nline-x\nreport.html\nline-x" +
                  end_of_name);
  const SessionResults taken(results, session);
  taken.remove_all_outputs();
  EXPECT_FALSE(fs::exists(results / "report.html"));
  for (const char* name : {"steps/lock", "steps/session", "steps/outputs", "mine.txt", "line-x"}) {
    EXPECT_TRUE(fs::exists(results / name)) << name;
  }
}

TEST_F(SessionResultsTest, KeepsUnremovableOutputsInOutputList) {
  const std::vector<StepOutputs> with_picture{{"lens", {"lens.yaml", "lens.svg"}}};
  {
    SessionResults before(results, session);
    before.set_steps(with_picture);
    fs::create_directories(results / "lens.svg/full");  // cannot be removed, even by root
    before.set_steps(kPlan);
    before.publish_outputs();
  }
  fs::remove_all(results / "lens.svg");
  folder.file("results/lens.svg", "of a run");
  SessionResults now(results, session);
  EXPECT_NO_THROW(now.set_steps(with_picture));
  EXPECT_TRUE(fs::exists(results / "lens.svg"));
  now.set_steps(kPlan);
  now.publish_outputs();
  EXPECT_FALSE(fs::exists(results / "lens.svg"));
}

TEST_F(SessionResultsTest, SetStepsThrowsIfOutputListWasRemoved) {
  { const SessionResults taken(results, session); }
  fs::remove(results / "steps/outputs");
  SessionResults now(results, session);
  EXPECT_THAT([&] { now.set_steps(kPlan); },
              ThrowsMessage<InputError>(HasSubstr("steps/outputs: was removed")));
}

TEST_F(SessionResultsTest, RemovesOutputsOfDrivesWithLongNames) {
  const std::string drive = "line-" + std::string(195, 'x'), fixes = drive + "-fixes.csv";
  {
    SessionResults before(results, session);
    before.set_steps({{drive, {fixes}}});
    folder.file("results/" + fixes, "of a drive");
  }
  SessionResults now(results, session);
  EXPECT_NO_THROW(now.set_steps({{drive, {fixes}}}));
  now.set_steps(kPlan);
  now.publish_outputs();
  EXPECT_FALSE(fs::exists(results / fixes));
}

TEST_F(SessionResultsTest, RejectsSymbolicLinkInPlaceOfOutput) {
  { const SessionResults taken(results, session); }
  fs::create_symlink(folder.file("mine.txt", "mine"), results / "lens.yaml");
  SessionResults taken(results, session);
  EXPECT_THAT([&] { taken.set_steps(kPlan); },
              ThrowsMessage<InputError>(HasSubstr("holds lens.yaml, which is not of")));
  EXPECT_EQ(TemporaryFolder::read_content(folder / "mine.txt"), "mine");
}

TEST_F(SessionResultsTest, RejectsConcurrentRunOtherSessionAndForeignFiles) {
  const auto take = [&](const fs::path& of) { return [&, of] { SessionResults(results, of); }; };
  {
    const SessionResults taken(results, session);
    EXPECT_THAT(take(session),
                ThrowsMessage<InputError>(HasSubstr("another run is at work there")));
  }
  EXPECT_NO_THROW(take(session)());
  EXPECT_THAT(take(folder / "another"),
              ThrowsMessage<InputError>(HasSubstr("contains the results of another session")));
  fs::create_directory(folder / "mine");
  folder.file("mine/calibration.yaml", "of somebody");
  EXPECT_THAT([&] { SessionResults(folder / "mine", session); },
              ThrowsMessage<InputError>(HasSubstr("holds calibration.yaml, which is not of")));
}

}  // namespace
}  // namespace vlp
