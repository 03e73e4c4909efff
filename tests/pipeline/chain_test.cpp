// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// scripts/calibrate.sh: the whole chain, from a folder of images to a verdict.
#include <gmock/gmock.h>

#include <fstream>

#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

const std::string kDatasets = VLP_SOURCE_DIR "/datasets/";

class Chain : public testing::Test {
 protected:
  void SetUp() override {
#ifdef __SANITIZE_ADDRESS__
    GTEST_SKIP() << "hundreds of images; the programs' own tests run under the sanitizers";
#endif
  }
  std::string path(const std::string& name) const { return (folder / name).string(); }
  /// Captures as a scene describes them, in the folder that is calibrated.
  void render(const std::string& scene, const std::string& folders) const {
    const auto result = run_program("vlp-simulate -q " + scene + " --only " + folders + " -o '" +
                                    path("a station") + "'");
    ASSERT_EQ(result.exit_code, 0) << result.errors;
  }
  ProgramResult calibrate(const std::string& options = "--row-time-s 3e-5 --readout rows") const {
    return run_program("VLP_PROGRAMS_DIR=" VLP_PROGRAMS_DIR " " VLP_SOURCE_DIR
                       "/scripts/calibrate.sh '" +
                       path("a station") + "' " + options);
  }
  std::string result(const std::string& name) const {
    return TemporaryFolder::content_of(folder / ("a station/results/" + name));
  }
  const TemporaryFolder folder;
};

class Accuracy : public Chain, public testing::WithParamInterface<const char*> {};

/// The gates are 1.5 times what was measured when they were written.
TEST_P(Accuracy, KeepsToItsGates) {
  const std::string rig = kDatasets + GetParam();
  render(rig + "/scene.yaml", "boards,rotation,dispersion,check");
  fs::copy(rig + "/gates.yaml", folder / "a station/gates.yaml");
  const auto run = calibrate();
  EXPECT_EQ(run.exit_code, 0) << run.output << run.errors;
  EXPECT_THAT(result("evaluation.json"), HasSubstr("vlp-evaluation/1"));
  EXPECT_THAT(result("report.html"), HasSubstr("PASS"));
}

INSTANTIATE_TEST_SUITE_P(Rigs, Accuracy, testing::Values("paper-rig", "paper-rig-faulty"));

/// Fewer check captures, so that it is quick; a line of the paper's.
class SmallStation : public Chain {
 protected:
  void SetUp() override {
    Chain::SetUp();
    if (IsSkipped()) return;
    std::string scene = TemporaryFolder::content_of(kDatasets + "paper-rig/scene.yaml");
    const std::string grid = "columns: 6, rows: 6}\n    heights_m: [0, 0.1, 0.2, 0.3]";
    ASSERT_NE(scene.find(grid), std::string::npos);
    scene.replace(scene.find(grid), grid.size(), "columns: 3, rows: 2}\n    heights_m: [0]");
    render(folder.file("scene.yaml", scene).string(), "boards,rotation,dispersion,check,line-x");
  }
};

TEST_F(SmallStation, RunsOnlyWhatIsNotAsBefore) {
  const auto first = calibrate("--readout rows");  // and finds the row time
  ASSERT_EQ(first.exit_code, 0) << first.output << first.errors;
  EXPECT_THAT(first.output, Not(HasSubstr("as before")));
  EXPECT_THAT(first.output, HasSubstr("row-time"));
  EXPECT_THAT(result("report.html"), HasSubstr("line-x-fixes.csv"));
  const std::string calibration = result("calibration.yaml"), report = result("report.html");

  const auto again = calibrate("--readout rows");
  EXPECT_EQ(again.exit_code, 0);
  EXPECT_THAT(again.output, Not(HasSubstr(" s\n"))) << "a stage was run again";
  EXPECT_EQ(result("report.html"), report);

  // A stage that something ended in the middle left no key.
  fs::remove(folder / "a station/results/stages/rotation.txt.key");
  // And a capture less in check.
  fs::remove(folder / "a station/check/0000.png");
  const auto changed = calibrate("--readout rows");
  EXPECT_EQ(changed.exit_code, 0) << changed.output << changed.errors;
  EXPECT_THAT(changed.output, HasSubstr("intrinsics    as before"));
  EXPECT_THAT(changed.output, Not(HasSubstr("rotation      as before")));
  EXPECT_THAT(changed.output,
              HasSubstr("dispersion    as before"));  // its input has the same bytes
  EXPECT_THAT(changed.output, Not(HasSubstr("check         as before")));
  EXPECT_EQ(result("calibration.yaml"), calibration);
  EXPECT_THAT(result("evaluation.json"), HasSubstr("\"missing\""));
}

TEST_F(SmallStation, EndsWithTheVerdictOfTheGatesEachTime) {
  folder.file("a station/gates.yaml", "format: vlp-gates/1\ngates:\n  mean_mm: 1e-6\n");
  for (int run = 0; run < 2; ++run) {
    const auto result = calibrate();
    EXPECT_EQ(result.exit_code, 1) << result.output << result.errors;
    EXPECT_THAT(result.output, HasSubstr("a gate is not met"));
    EXPECT_THAT(result.output, HasSubstr("mean_mm"));
  }
  EXPECT_THAT(result("report.html"), HasSubstr("FAIL"));
  EXPECT_THAT(result("gates.xml"), HasSubstr("<failure"));
}

TEST_F(SmallStation, FollowsWhatIsInItsFolder) {
  ASSERT_EQ(calibrate().exit_code, 0);
  const std::string calibration = result("calibration.yaml");
  // Without the dispersion nothing of it is left, and with it again all is as it was.
  fs::rename(folder / "a station/dispersion", folder / "kept");
  ASSERT_EQ(calibrate().exit_code, 0);
  EXPECT_EQ(result("calibration.yaml"), result("rotated.yaml"));
  EXPECT_FALSE(fs::exists(folder / "a station/results/dispersion.svg"));
  fs::rename(folder / "kept", folder / "a station/dispersion");
  ASSERT_EQ(calibrate().exit_code, 0);
  EXPECT_EQ(result("calibration.yaml"), calibration);
  // A camera that is known already, and then is not.
  fs::copy(folder / "a station/true_calibration.yaml", folder / "a station/camera.yaml");
  EXPECT_THAT(calibrate().errors, HasSubstr("camera.yaml says what the camera is"));
  ASSERT_EQ(calibrate("").exit_code, 0);
  EXPECT_THAT(result("calibration.yaml"), HasSubstr("id: \"paper-rig\""));
  EXPECT_FALSE(fs::exists(folder / "a station/results/lens.yaml"));
  fs::remove(folder / "a station/camera.yaml");
  ASSERT_EQ(calibrate().exit_code, 0);
  EXPECT_EQ(result("calibration.yaml"), calibration);
  // A result that somebody changed, or took away, is made again.
  folder.file("a station/results/rotated.yaml", "changed\n");
  EXPECT_THAT(calibrate().output, Not(HasSubstr("rotation      as before")));
  EXPECT_EQ(result("calibration.yaml"), calibration);
  fs::remove(folder / "a station/results/rotation.svg");
  fs::remove(folder / "a station/results/evaluation.json");
  ASSERT_EQ(calibrate().exit_code, 0);
  EXPECT_TRUE(fs::exists(folder / "a station/results/rotation.svg"));
  EXPECT_TRUE(fs::exists(folder / "a station/results/evaluation.json"));
  // A drive that cannot be taken costs the report, not the calibration.
  folder.file("a station/line-x/truth.csv", "image,x_m,y_m\n0000.png,\"0\",0\n");
  const auto bad_line = calibrate();
  EXPECT_EQ(bad_line.exit_code, 2);
  EXPECT_THAT(bad_line.errors, HasSubstr("line-x/truth.csv: its x_m and y_m are no plain numbers"));
  EXPECT_EQ(result("calibration.yaml"), calibration);
  EXPECT_FALSE(fs::exists(folder / "a station/results/report.html"));
}

TEST_F(SmallStation, FailsWithTheLensWhoseGatesAreNotMet) {
  std::size_t views = 0;
  for (const auto& image : fs::directory_iterator(folder / "a station/boards")) {
    if (image.path().extension() == ".png" && ++views > 5) fs::remove(image.path());
  }
  const auto run = calibrate();
  EXPECT_EQ(run.exit_code, 1) << run.output << run.errors;
  EXPECT_THAT(run.output, HasSubstr("a gate is not met"));
  EXPECT_THAT(result("report.html"), HasSubstr("FAIL"));
}

TEST_F(SmallStation, EndsWhereAStageCannotGoOn) {
  ASSERT_EQ(calibrate().exit_code, 0);
  for (const auto& image : fs::directory_iterator(folder / "a station/rotation")) {
    if (image.path().filename() != "0000.png") fs::remove(image.path());
  }
  const auto run = calibrate();
  EXPECT_EQ(run.exit_code, 3) << run.output;
  EXPECT_THAT(run.errors, HasSubstr("vlp-rotation: error: "));
  EXPECT_THAT(run.errors, HasSubstr("calibrate.sh: rotation ended with exit code 3"));
  EXPECT_TRUE(fs::exists(folder / "a station/results/lens.yaml"));
  EXPECT_FALSE(fs::exists(folder / "a station/results/report.html")) << "of the captures before";
  EXPECT_FALSE(fs::exists(folder / "a station/results/calibration.yaml"));
}

TEST_F(Chain, SaysWhatIsMissing) {
  const auto none = run_program(VLP_SOURCE_DIR "/scripts/calibrate.sh");
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_THAT(none.errors, HasSubstr("which STATION_DIR?"));
  fs::create_directory(folder / "a station");
  const auto empty = calibrate();
  EXPECT_EQ(empty.exit_code, 2);
  EXPECT_THAT(empty.errors, HasSubstr("a station/lamps.yaml: missing"));
  EXPECT_THAT(calibrate("--nonsense").errors, HasSubstr("unknown option --nonsense"));
  EXPECT_THAT(calibrate("--row-time-s").errors, HasSubstr("--row-time-s wants a value"));
}

}  // namespace
}  // namespace vlp
