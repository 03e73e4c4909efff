// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// The steps of scripts/ci/action.yml, run as a CI system runs them; tests/packages.sh runs them in
/// a bare root with the package of the programs.
#include <gmock/gmock.h>

#include <filesystem>

#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

class CiAction : public testing::Test {
 protected:
  const TemporaryFolder folder;

  void SetUp() override {
#ifdef __SANITIZE_ADDRESS__
    GTEST_SKIP() << "renders a session; the programs' own tests run under the sanitizers";
#endif
    const auto rendered = run_program("vlp-simulate -q " VLP_SOURCE_DIR
                                      "/datasets/archive/scene.yaml "
                                      "--only boards,rotation,dispersion,check -o '" +
                                      (folder / "session").string() + "'");
    ASSERT_EQ(rendered.exit_code, 0) << rendered.errors;
    folder.file("gates.yaml", "format: vlp-gates/1\ngates: {mean_mm: 1, missing_fraction: 0}\n");
  }
  ProgramResult run_action(const std::string& inputs) const {
    return run_program("cd '" + (folder / "").string() +
                       "' && python3 " VLP_SOURCE_DIR
                       "/tests/ci/run_action.py session=session "
                       "'options=--row-time-s 3e-5\n--readout rows' gates=gates.yaml " +
                       inputs);
  }
  std::string content(const std::string& name) const {
    return TemporaryFolder::read_content(folder / name);
  }
};

TEST_F(CiAction, ComparesWithAcceptedFixesAlsoIfCalibrationMissesGate) {
  const auto first = run_action("results=accepted");
  ASSERT_EQ(first.exit_code, 0) << first.output << first.errors;
  EXPECT_THAT(content("accepted/junit.xml"),
              AllOf(HasSubstr("failures=\"0\" errors=\"0\""), HasSubstr("name=\"mean_mm\"")));
  EXPECT_FALSE(fs::exists(folder / "accepted/comparison.xml"));
  const auto accept = [&](const std::string& words) {
    return run_program("cd '" + (folder / "").string() +
                       "' && " VLP_SOURCE_DIR "/scripts/ci/accept-fixes.sh " + words);
  };
  const auto accepted = accept("accepted fixes.csv");
  EXPECT_EQ(accepted.exit_code, 0) << accepted.errors;
  EXPECT_EQ(content("fixes.csv"), content("accepted/check-fixes.csv"));
  EXPECT_THAT(content("fixes.csv.origin"),
              testing::ContainsRegex("commit .+\ndate 20.+Z\nversion .+\nsha256 [0-9a-f]{64}\n"));
  EXPECT_THAT(content("fixes.csv.gates.yaml"), testing::ContainsRegex("gates: .mtf50: 0.2[0-9]+."));
  EXPECT_THAT(accept("session fixes.csv").errors, HasSubstr("check-fixes.csv: is missing"));
  const auto again = run_action("accepted=fixes.csv");
  EXPECT_EQ(again.exit_code, 0) << again.output << again.errors;
  EXPECT_THAT(content("results/comparison.xml"),
              AllOf(HasSubstr("failures=\"0\" errors=\"0\""), HasSubstr("name=\"worse_mm\"")));
  EXPECT_EQ(run_action("accepted=fixes.csv gates=").exit_code, 0);
  const std::string gates = content("fixes.csv.gates.yaml");
  EXPECT_EQ(accept("results fixes.csv").exit_code, 0) << "results with the gate";
  EXPECT_EQ(content("fixes.csv.gates.yaml"), gates);
  folder.file("fixes.csv.gates.yaml", "format: vlp-gates/1\ngates: {mtf50: 0.4}\n");
  EXPECT_EQ(run_action("accepted=fixes.csv gates=").exit_code, 1) << "a blurred lens";
  EXPECT_THAT(content("results/junit.xml"), HasSubstr("mtf50 is 0.2"));
  folder.file("gates.yaml", "format: vlp-gates/1\ngates: {mean_mm: 1e-6}\n");
  const auto missed = run_action("accepted=accepted/check-fixes.csv");
  EXPECT_EQ(missed.exit_code, 1) << missed.output << missed.errors;
  EXPECT_THAT(content("results/junit.xml"), HasSubstr("failures=\"1\""));
  EXPECT_THAT(content("results/comparison.xml"), HasSubstr("failures=\"0\" errors=\"0\""));
  // A run that is refused leaves no results of the former one.
  folder.file("gates.yaml", "format: vlp-gates/1\ngates: {odd_mm: 1}\n");
  const auto refused = run_action("accepted=accepted/check-fixes.csv");
  EXPECT_EQ(refused.exit_code, 2) << refused.output << refused.errors;
  EXPECT_THAT(content("results/junit.xml"), AllOf(HasSubstr("errors=\"1\""), HasSubstr("odd_mm")));
  EXPECT_FALSE(fs::exists(folder / "results/comparison.xml"));
}

}  // namespace
}  // namespace vlp
