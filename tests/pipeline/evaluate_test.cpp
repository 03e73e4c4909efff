// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-evaluate as its users call it.
#include <fmt/core.h>
#include <gmock/gmock.h>

#include "captures/digest.h"
#include "support/program.h"
#include "support/schema.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

const std::string kFixes =
    "image,status,x_m,y_m,z_m,yaw_rad,x_sd_m,y_sd_m,z_sd_m,yaw_sd_rad,lamps,residual_px\n";

/// Six captures at two places, off by 1 to 4 mm along x and y; one has no fix.
class VlpEvaluate : public testing::Test {
 protected:
  const TemporaryFolder folder;

  void SetUp() override {
    folder.file("fixes.csv", kFixes +
                                 "a.png,ok,0.001,0,0.002,0,,,,,3,0\n"
                                 "b.png,ok,0,0.002,0,0,,,,,3,0\n"
                                 "c.png,ok,1.003,0,0,0,,,,,3,0\n"
                                 "d.png,ok,1,0.004,0,0,,,,,3,0\n"
                                 "e.png,ok,1,0,0,0.01,,,,,3,0\n"
                                 "f.png,too_few_lamps,,,,,,,,,1,\n");
    folder.file("truth.csv",
                "image,x_m,y_m,z_m,yaw_rad\n"
                "a.png,0,0,0,0\nb.png,0,0,0,0\nc.png,1,0,0,0\nd.png,1,0,0,0\ne.png,1,0,0,0\n"
                "f.png,1,0,0,0\n");
  }
  std::string path(const std::string& name) const { return (folder / name).string(); }
  ProgramResult evaluate(const std::string& options) const {
    return run_program("cd '" + path("") + "' && vlp-evaluate fixes.csv " + options);
  }
  ProgramResult with_truth(const std::string& options = "") const {
    return evaluate("--truth truth.csv " + options);
  }
  /// The fixes of datasets/example, with their lamps and calibration.
  ProgramResult evaluate_example(const std::string& options) const {
    const std::string example = VLP_SOURCE_DIR "/datasets/example/";
    const std::string rig =
        " --lamps " + example + "lamps.yaml --calibration " + example + "calibration.yaml ";
    const auto located = run_program("vlp-locate " + example + "detections.csv" + rig + "-o '" +
                                     path("example.csv") + "'");
    EXPECT_EQ(located.exit_code, 0) << located.errors;
    return run_program("vlp-evaluate '" + path("example.csv") + "' --truth " + example +
                       "truth.csv" + rig + options);
  }
  std::string content(const std::string& name) const {
    return TemporaryFolder::read_content(folder / name);
  }
};

TEST_F(VlpEvaluate, PrintsMetricsComputedByHand) {
  const auto result = with_truth();
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.output,
              AllOf(StartsWith("captures    6\nfixes       5\nmissing     16.7 %\n"),
                    HasSubstr("no fix    1 too_few_lamps"), HasSubstr("mean            2.000 mm"),
                    HasSubstr("median          2.000 mm"), HasSubstr("p90             4.000 mm"),
                    HasSubstr("rms             2.449 mm"),
                    HasSubstr("too few reference points for an interval"),
                    HasSubstr("ref. points 2 with 5 fixes"), HasSubstr("height      rms 0.894 mm"),
                    HasSubstr("yaw         rms 0.2562 deg")));
  EXPECT_THAT(result.errors, testing::Not(HasSubstr("missing_fraction")));
  EXPECT_THAT(with_truth("--gate mean_mm=2.5").errors,
              HasSubstr("1 of 6 captures has no fix, and there is no gate 'missing_fraction'"));
}

TEST_F(VlpEvaluate, ReturnsOneAndWritesJsonAndJUnitWhenGateFails) {
  const auto result = with_truth(
      "--gate mean_mm=2.5,p90_mm=3 --gate missing_fraction=0 --json evaluation.json --junit "
      "junit.xml");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.errors, AllOf(HasSubstr("p90_mm is 4 mm, at most 3 mm"),
                                   HasSubstr("missing_fraction is 0.1667, at most 0 is"),
                                   testing::Not(HasSubstr("mean_mm"))));
  EXPECT_THAT(result.output,
              AllOf(HasSubstr("NOT MET gate p90_mm"), HasSubstr("met    gate mean_mm")));
  EXPECT_THAT(content("evaluation.json"), HasSubstr("\"passed\": false"));
  EXPECT_EQ(problems_by_schema("evaluation", {folder / "evaluation.json"}), "");
  EXPECT_THAT(content("junit.xml"), HasSubstr("tests=\"4\" failures=\"2\""));
  EXPECT_EQ(with_truth("--gate mean_mm=2.5 --gate p90_mm=4.5").exit_code, 0);
}

TEST_F(VlpEvaluate, WritesErrorToJUnitWhenNoGateIsChecked) {
  const auto expect_error = [&](const std::string& options, int exit_code,
                                const std::string& words) {
    SCOPED_TRACE(options);
    folder.file("junit.xml", "<testsuites errors=\"0\"/>\n");
    EXPECT_EQ(with_truth(options).exit_code, exit_code);
    EXPECT_THAT(content("junit.xml"), AllOf(HasSubstr("errors=\"1\""), HasSubstr(words)));
  };
  expect_error("--gate mean_mm=1,worse_mm=1 --junit junit.xml", 2,
               "<error type=\"bad_input\" message=\"gate 'worse_mm': the metric has no value here");
  expect_error("--gate mean_mm=1 --junit junit.xml --odd", 2, "unknown: --odd");
  expect_error("--junit=junit.xml --gate", 2, "--gate: 1 required");
  expect_error("--gate mean_mm=1 --junit junit.xml --json truth.csv", 2, "is also an input");
  expect_error("--gates none.yaml --junit junit.xml", 2, "none.yaml");
  folder.file("fixes.csv", kFixes + "a.png,too_few_lamps,,,,,,,,,1,\n");
  expect_error("--gate mean_mm=1 --junit junit.xml", 3, "<error type=\"undetermined\" message=\"");
  const std::string truth = content("truth.csv");
  EXPECT_EQ(with_truth("--junit truth.csv --odd").exit_code, 2);
  EXPECT_EQ(content("truth.csv"), truth) << "not a JUnit file";
}

TEST_F(VlpEvaluate, ProposedGatesPassForSameFixes) {
  const auto few = with_truth("--propose-gates gates.yaml");
  EXPECT_EQ(few.exit_code, 3);
  EXPECT_THAT(few.errors, HasSubstr("--propose-gates: too few reference points or captures"));
  const auto proposed =
      evaluate_example("--noise-px 0.05 --propose-gates '" + path("gates.yaml") + "'");
  ASSERT_EQ(proposed.exit_code, 0) << proposed.errors;
  EXPECT_THAT(content("gates.yaml"),
              AllOf(HasSubstr("format: vlp-gates/1\n"), HasSubstr("  mean_mm: "),
                    HasSubstr("  height_rms_mm: "), HasSubstr("  missing_fraction: 0 ")));
  const auto passed = evaluate_example("--noise-px 0.05 --gates '" + path("gates.yaml") + "'");
  EXPECT_EQ(passed.exit_code, 0) << passed.errors;
}

TEST_F(VlpEvaluate, PrintsErrorsForPathOptionAndWithLineFitForLineOption) {
  folder.file("path.csv", "x_m,y_m,z_m\n0,0,0\n1,0,0\n");
  const auto path = evaluate("--path path.csv");
  ASSERT_EQ(path.exit_code, 0) << path.errors;
  // Beyond its end by 3 mm; 2 and 4 mm beside it; twice on it.
  EXPECT_THAT(path.output, AllOf(HasSubstr("mean            1.800 mm"), HasSubstr("height")));
  const auto line = evaluate("--line 0 0 1 0 --gate fitted_max_mm=3.3 --json line.json");
  ASSERT_EQ(line.exit_code, 0) << line.errors;
  EXPECT_THAT(line.output, AllOf(HasSubstr("mean            1.800 mm"),
                                 HasSubstr("line fit    mean"), HasSubstr("jitter    ")));
  EXPECT_THAT(content("line.json"), HasSubstr("\"jitter_mm\""));
  EXPECT_EQ(problems_by_schema("evaluation", {folder / "line.json"}), "");
}

/// Baseline of 42 captures at as many places, and changes of it that have to be red.
TEST_F(VlpEvaluate, CompareOptionFailsForWorseHeightYawOrSdAndForLostRows) {
  const auto make_fixes = [](int first, double height_m, double yaw_rad, double sd_m) {
    std::string text = kFixes;
    for (int i = first; i < 42; ++i) {
      const double error_m = 0.0004 * (i % 7 - 3);
      text += fmt::format("{},ok,{},0,{},{},{},{},{},0.001,3,0\n", i, i + error_m,
                          error_m + height_m, 0.5 * error_m + yaw_rad, sd_m, sd_m, sd_m);
    }
    return text;
  };
  std::string truth = "image,x_m,y_m,z_m,yaw_rad\n";
  for (int i = 0; i < 42; ++i) truth += fmt::format("{},{},0,0,0\n", i, i);
  folder.file("truth.csv", truth);
  const std::string accepted = make_fixes(0, 0, 0, 0.001);
  const auto compare = [&](const std::string& fixes, const std::string& baseline,
                           const std::string& options = "") {
    folder.file("fixes.csv", fixes);
    folder.file("baseline.csv", baseline);
    return with_truth("--compare baseline.csv --json c.json --junit c.xml " + options);
  };
  const auto same = compare(accepted, accepted);
  EXPECT_EQ(same.exit_code, 0) << same.errors;
  EXPECT_THAT(content("c.xml"), HasSubstr("tests=\"7\" failures=\"0\""));
  const auto expect_red = [&](const ProgramResult& result, const std::string& words) {
    EXPECT_EQ(result.exit_code, 1) << words;
    EXPECT_THAT(result.errors, HasSubstr(words));
    EXPECT_EQ(problems_by_schema("evaluation", {folder / "c.json"}), "");
  };
  expect_red(compare(make_fixes(0, 0.02, 0, 0.001), accepted), "worse_height_mm is 1");
  expect_red(compare(make_fixes(0, 0, 0.0192, 0.001), accepted), "worse_yaw_deg is 1");
  expect_red(compare(make_fixes(0, 0, 0, 0.0001), accepted), "worse_normalized_error is ");
  expect_red(compare(accepted, make_fixes(24, 0, 0, 0.001)), "unpaired_fraction is 0.5714");
  const std::string lost = make_fixes(1, 0, 0, 0.001) + "0,too_few_lamps,,,,,,,,,1,\n";
  expect_red(compare(lost, accepted), "unpaired_fraction is 0.02381");
  EXPECT_EQ(compare(accepted, lost).exit_code, 0) << "a fix more";
  EXPECT_EQ(compare(lost, accepted, "--gate unpaired_fraction=0.1").exit_code, 0);
  // Fixes to compare with that cannot be accepted ones of these captures.
  const auto expect_refused = [&](const std::string& baseline, const std::string& words) {
    EXPECT_EQ(compare(accepted, baseline).exit_code, 2) << words;
    EXPECT_THAT(content("c.xml"), AllOf(HasSubstr("errors=\"1\""), HasSubstr(words)));
  };
  expect_refused(make_fixes(0, 0.06, 0, 0.001), "baseline.csv: its errors are 60 times the rep");
  expect_refused(make_fixes(42, 0, 0, 0.001) + "0,too_few_lamps,,,,,,,,,1,\n",
                 "baseline.csv: none of its rows has a fix");
  folder.file("baseline.csv.origin", "commit none\nsha256 " + hash_text(accepted) + "\n");
  EXPECT_EQ(compare(accepted, accepted).exit_code, 0);
  expect_refused(make_fixes(0, 0.001, 0, 0.001), "baseline.csv: was changed after it was accepted");
}

}  // namespace
}  // namespace vlp
