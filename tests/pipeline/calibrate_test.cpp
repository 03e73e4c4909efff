// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-calibrate: the whole procedure, from a folder of images to a verdict.
#include <fmt/core.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "calibration/intrinsics/projection_difference.h"
#include "captures/truth_table.h"
#include "geometry/angles.h"
#include "rig/calibration.h"
#include "support/program.h"
#include "support/schema.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

const std::string kDatasets = VLP_SOURCE_DIR "/datasets/";

class VlpCalibrate : public testing::Test {
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
                                    path("a session") + "'");
    ASSERT_EQ(result.exit_code, 0) << result.errors;
  }
  ProgramResult calibrate(const std::string& options = "--row-time-s 3e-5 --readout rows") const {
    return run_program("vlp-calibrate '" + path("a session") + "' -o '" + path("results") + "' " +
                       options);
  }
  std::string result(const std::string& name) const {
    return TemporaryFolder::read_content(folder / ("results/" + name));
  }
  void expect_documents_as_their_schemas_say() const {
    EXPECT_EQ(problems_by_schema("session", {folder / "results/session.json"}), "");
    const auto evaluation = folder / "results/evaluation.json";
    if (fs::exists(evaluation)) {
      EXPECT_EQ(problems_by_schema("evaluation", {evaluation}), "");
    }
    std::vector<fs::path> steps;
    for (const auto& file : fs::directory_iterator(folder / "results/steps")) {
      if (file.path().extension() == ".json") steps.push_back(file.path());
    }
    EXPECT_FALSE(steps.empty());
    EXPECT_EQ(problems_by_schema("step", steps), "");
  }
  const TemporaryFolder folder;
};

class VlpCalibrateAccuracy : public VlpCalibrate,
                             public testing::WithParamInterface<const char*> {};

/// The gates are 1.5 times what was measured when they were written.
TEST_P(VlpCalibrateAccuracy, RenderedSessionPassesGatesOfItsDataset) {
  const std::string rig = kDatasets + GetParam();
  render(rig + "/scene.yaml", "boards,rotation,dispersion,check");
  fs::copy(rig + "/gates.yaml", folder / "a session/gates.yaml");
  const auto run = calibrate();
  EXPECT_EQ(run.exit_code, 0) << run.output << run.errors;
  EXPECT_THAT(result("evaluation.json"), HasSubstr("vlp-evaluation/4"));
  EXPECT_THAT(result("report.html"), HasSubstr("PASS"));
}

INSTANTIATE_TEST_SUITE_P(Rigs, VlpCalibrateAccuracy,
                         testing::Values("paper-rig", "paper-rig-faulty"));

/// The fixes at the dispersion's place reject different lamps, so that no offset explains them.
TEST_F(VlpCalibrate, ReportsMovedLampInSeveralSteps) {
  render(kDatasets + "paper-rig/scene.yaml", "rotation,dispersion,check");
  Calibration known;
  known.camera = read_calibration(folder / "a session/true_calibration.yaml").camera;
  write_calibration(folder / "a session/camera.yaml", known);
  const std::string lamps = TemporaryFolder::read_content(folder / "a session/lamps.yaml");
  const auto expect_lines = [&](const std::string& moved_to, const std::string& line) {
    folder.file("a session/lamps.yaml",
                std::regex_replace(lamps, std::regex("\\[0, -0.32, 1.6\\]"), moved_to));
    const std::string errors = calibrate("--no-report").errors;
    std::size_t count = 0;
    for (auto at = errors.find(line); at != std::string::npos; at = errors.find(line, at + 1)) {
      ++count;
    }
    EXPECT_GE(count, 2U) << "rotation, dispersion, and check unless dispersion fails";
    EXPECT_THAT(errors, Not(HasSubstr("no offset explains")));
    EXPECT_THAT(result("junit.xml"), HasSubstr(line));
  };
  expect_lines("[-0.03, -0.32, 1.6]",
               "lamp 2 hangs 30 mm from where the map has it (x +30 mm, y +0 mm)");
  expect_lines("[0, -0.35, 1.6]",
               "lamp 2 hangs 30 mm from where the map has it (x +0 mm, y +30 mm)");
}

// From boards that are seen beyond 90 degrees off the axis.
TEST_F(VlpCalibrate, Calibrates190DegreeLensWithinTenthOfPixel) {
  std::string scene = TemporaryFolder::read_content(kDatasets + "fisheye/scene.yaml");
  for (const auto& [what, by] : std::vector<std::pair<std::string, std::string>>{
           {"turn: \\{count: 40, jitter_deg: 4\\}", "turn: {count: 12, jitter_deg: 4}"},
           {"columns: 6, rows: 6", "columns: 3, rows: 2"}}) {
    scene = std::regex_replace(scene, std::regex(what), by);
  }
  render(folder.file("scene.yaml", scene).string(), "boards,rotation,dispersion,check");
  const Camera truth = read_calibration(folder / "a session/true_calibration.yaml").camera;
  const Lens lens(truth.lens_model, truth.intrinsics);
  for (const std::string model :
       {"OPENCV_FISHEYE", "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=17_Ny=17_fov_x_deg=215"}) {
    const auto run = calibrate("--no-report --row-time-s 2.5e-5 --readout columns --lens " + model);
    ASSERT_EQ(run.exit_code, 0) << run.errors;
    const Camera found = read_calibration(folder / "results/calibration.yaml").camera;
    const auto up_to = [&](double degrees) {
      return compute_projection_difference(
          lens, Lens(found.lens_model, found.intrinsics), truth.imager_px, [&](const auto& pixel) {
            const auto ray = lens.unproject_pixel(pixel);
            const double least = std::cos(rad_from_deg(degrees));
            return ray && ray->direction.normalized().z() > least ? 1.0 : INFINITY;
          });
    };
    ASSERT_TRUE(up_to(90) && up_to(94));
    EXPECT_LT(up_to(90)->mean_px, 0.03);
    EXPECT_LT(up_to(94)->worst_px, 0.1);
    RecordProperty(model.substr(0, 16) + "_mean_px", std::to_string(up_to(90)->mean_px));
    RecordProperty(model.substr(0, 16) + "_worst_px", std::to_string(up_to(94)->worst_px));
    const auto json = nlohmann::json::parse(result("session.json"));
    EXPECT_NEAR(json["calibration"]["tilt_deg"].get<double>(), 0.9, 0.01);
    const auto evaluation = nlohmann::json::parse(result("evaluation.json"));
    EXPECT_LT(evaluation["horizontal"]["mean_mm"].get<double>(), 0.05);
    RecordProperty(model.substr(0, 16) + "_mean_mm",
                   std::to_string(evaluation["horizontal"]["mean_mm"].get<double>()));
  }
}

/// Small images, few captures; a line of the paper's.
class VlpCalibrateSmallSession : public VlpCalibrate {
 protected:
  void SetUp() override {
    VlpCalibrate::SetUp();
    if (IsSkipped()) return;
    const std::string scene =
        TemporaryFolder::read_content(kDatasets + "archive/scene.yaml") +
        "  - folder: line-x\n"
        "    exposure_s: 5.0e-5\n"
        "    drive: {from_m: [-0.35, 0], to_m: [0.35, 0], speed_m_per_s: 0.1}\n"
        "    heights_m: [0]\n"
        "    yaws_deg: [0]\n"
        "    interval_s: 0.25\n";
    render(folder.file("scene.yaml", scene).string(), "boards,rotation,dispersion,check,line-x");
  }
};

TEST_F(VlpCalibrate, RunsOnlyStepsWhoseInputChanged) {
  // Stripes enough to find the row time; fewer check captures than the scene has.
  std::string scene = TemporaryFolder::read_content(kDatasets + "paper-rig/scene.yaml");
  const std::string grid = "columns: 6, rows: 6}\n    heights_m: [0, 0.1, 0.2, 0.3]";
  ASSERT_NE(scene.find(grid), std::string::npos);
  scene.replace(scene.find(grid), grid.size(), "columns: 3, rows: 2}\n    heights_m: [0]");
  render(folder.file("scene.yaml", scene).string(), "boards,rotation,dispersion,check,line-x");
  const auto first = calibrate("--readout rows");  // and finds the row time
  ASSERT_EQ(first.exit_code, 0) << first.output << first.errors;
  EXPECT_THAT(first.output, Not(HasSubstr("up to date")));
  EXPECT_THAT(first.output, HasSubstr("row-time"));
  EXPECT_THAT(result("report.html"), HasSubstr("line-x-fixes.csv"));
  const std::string calibration = result("calibration.yaml"), report = result("report.html");

  const auto again = calibrate("--readout rows");
  EXPECT_EQ(again.exit_code, 0);
  EXPECT_THAT(again.output, Not(ContainsRegex("[0-9] s\n"))) << "a step was run again";
  EXPECT_EQ(result("report.html"), report);

  // A step that something ended in the middle left nothing that says how it ended.
  fs::remove(folder / "results/steps/rotation.json");
  // And a capture less in check.
  fs::remove(folder / "a session/check/0000.png");
  const auto changed = calibrate("--readout rows");
  EXPECT_EQ(changed.exit_code, 0) << changed.output << changed.errors;
  EXPECT_THAT(changed.output, HasSubstr("lens          up to date"));
  EXPECT_THAT(changed.output, Not(HasSubstr("rotation      up to date")));
  EXPECT_THAT(changed.output,
              HasSubstr("dispersion    up to date"));  // its input has the same bytes
  EXPECT_THAT(changed.output, Not(HasSubstr("check         up to date")));
  EXPECT_EQ(result("calibration.yaml"), calibration);
  EXPECT_THAT(result("evaluation.json"), HasSubstr("\"missing\""));
}

TEST_F(VlpCalibrateSmallSession, ReportsFailedGatesAgainWhenRepeated) {
  folder.file("a session/gates.yaml",
              "format: vlp-gates/1\ngates:\n  mean_mm: 1e-6\n  tilt_deg: 1e-6\n");
  for (int run = 0; run < 2; ++run) {
    const auto result = calibrate();
    EXPECT_EQ(result.exit_code, 1) << result.output << result.errors;
    EXPECT_THAT(result.output, HasSubstr("a gate is not met"));
    EXPECT_THAT(result.output, HasSubstr("NOT MET     mean_mm is "));
    EXPECT_THAT(result.output, HasSubstr("NOT MET     tilt_deg is "));
  }
  EXPECT_THAT(result("report.html"), HasSubstr("FAIL"));
  EXPECT_THAT(result("junit.xml"),
              testing::ContainsRegex("<failure message=\"[^\"]*\\(tilt_deg is "));
  expect_documents_as_their_schemas_say();
  // Another limit measures nothing again.
  folder.file("a session/gates.yaml", "format: vlp-gates/1\ngates:\n  tilt_deg: 90\n");
  const auto passed = calibrate();
  EXPECT_EQ(passed.exit_code, 0) << passed.output << passed.errors;
  EXPECT_THAT(passed.output, HasSubstr("rotation      up to date"));
  folder.file("a session/gates.yaml", "format: vlp-gates/1\ngates:\n  coverage: 7\n");
  const auto refused = calibrate();
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.errors, HasSubstr("gates.yaml:3: gates.coverage: should be a fraction"));
}

TEST_F(VlpCalibrateSmallSession, BatchStdinWritesSameResultsAsSingleRun) {
  ASSERT_EQ(calibrate("--no-report --row-time-s 3e-5 --readout rows").exit_code, 0);
  const nlohmann::json line{{"arguments",
                             {path("a session"), "-o", path("each"), "--no-report", "--row-time-s",
                              "3e-5", "--readout", "rows"}},
                            {"limit_s", 600}};
  folder.file("lines", line.dump() + "\n" + line.dump() + "\n");
  const auto each = run_program("vlp-calibrate --batch-stdin <'" + path("lines") + "'");
  EXPECT_EQ(each.exit_code, 0) << each.errors;
  std::istringstream answers(each.output);
  for (const bool as_before : {false, true}) {
    std::string answer;
    ASSERT_TRUE(std::getline(answers, answer));
    const auto json = nlohmann::json::parse(answer);
    EXPECT_EQ(json["exit_code"], 0) << answer;
    const std::string said = json["output"];
    EXPECT_EQ(said.find("verdict     pass"), said.rfind("verdict")) << said;
    EXPECT_EQ(said.find("lens          up to date") != std::string::npos, as_before) << said;
  }
  EXPECT_EQ(answers.get(), EOF);
  for (const char* file : {"calibration.yaml", "check-fixes.csv", "session.json"}) {
    EXPECT_EQ(TemporaryFolder::read_content(folder / (std::string("each/") + file)), result(file))
        << file;
  }
}

TEST_F(VlpCalibrateSmallSession, UpdatesResultsWhenSessionFilesChange) {
  ASSERT_EQ(calibrate().exit_code, 0);
  const std::string calibration = result("calibration.yaml");
  // Without the dispersion nothing of it is left, and with it again all is as it was.
  fs::rename(folder / "a session/dispersion", folder / "kept");
  ASSERT_EQ(calibrate().exit_code, 0);
  EXPECT_EQ(result("calibration.yaml"), result("rotated.yaml"));
  EXPECT_FALSE(fs::exists(folder / "results/dispersion.svg"));
  fs::rename(folder / "kept", folder / "a session/dispersion");
  ASSERT_EQ(calibrate().exit_code, 0);
  EXPECT_EQ(result("calibration.yaml"), calibration);
  // A camera that is known already, and then is not.
  fs::copy(folder / "a session/true_calibration.yaml", folder / "a session/camera.yaml");
  const auto known = calibrate();
  ASSERT_EQ(known.exit_code, 0) << known.errors;
  EXPECT_THAT(
      known.errors,
      HasSubstr(
          "camera.yaml takes precedence over options of the camera; ignored: row time, readout"));
  EXPECT_THAT(calibrate("--camera-id other --lens LENSMODEL_OPENCV5").errors,
              HasSubstr("ignored: name, lens model"));
  EXPECT_THAT(calibrate("").errors, Not(HasSubstr("camera.yaml takes precedence")));
  EXPECT_THAT(result("calibration.yaml"), HasSubstr("id: \"archive\""));
  EXPECT_FALSE(fs::exists(folder / "results/lens.yaml"));
  fs::remove(folder / "a session/camera.yaml");
  ASSERT_EQ(calibrate().exit_code, 0);
  EXPECT_EQ(result("calibration.yaml"), calibration);
  // A result that somebody changed, or took away, is made again.
  folder.file("results/rotated.yaml", "changed\n");
  EXPECT_THAT(calibrate().output, Not(HasSubstr("rotation      up to date")));
  EXPECT_EQ(result("calibration.yaml"), calibration);
  fs::remove(folder / "results/rotation.svg");
  fs::remove(folder / "results/evaluation.json");
  ASSERT_EQ(calibrate().exit_code, 0);
  EXPECT_TRUE(fs::exists(folder / "results/rotation.svg"));
  EXPECT_TRUE(fs::exists(folder / "results/evaluation.json"));
  // A drive that cannot be taken costs the report, not the calibration.
  folder.file("a session/line-x/truth.csv", "image,x_m,y_m\n0000.png,0,0\n");
  const auto bad_line = calibrate();
  EXPECT_EQ(bad_line.exit_code, 2);
  EXPECT_THAT(bad_line.errors, HasSubstr("line-x/truth.csv: start and end of the drive are equal"));
  EXPECT_EQ(result("calibration.yaml"), calibration);
  EXPECT_FALSE(fs::exists(folder / "results/report.html"));
}

TEST_F(VlpCalibrateSmallSession, SelectsOpencvModelWithOptionLensAuto) {
  const std::string chosen = "--row-time-s 3e-5 --readout rows --lens auto";
  const auto run = calibrate(chosen);
  EXPECT_LE(run.exit_code, 1) << run.errors;
  EXPECT_THAT(run.errors, HasSubstr("lens model: LENSMODEL_OPENCV"));
  EXPECT_THAT(result("lens.yaml"), HasSubstr("--lens auto"));
  EXPECT_TRUE(fs::exists(folder / "results/lens.cameramodel"));
  EXPECT_THAT(calibrate(chosen).output, HasSubstr("lens          up to date"));
  EXPECT_THAT(calibrate().output, Not(HasSubstr("lens          up to date")));
}

TEST_F(VlpCalibrateSmallSession, ReturnsOneWhenGateOfLensFails) {
  std::size_t views = 0;
  for (const auto& image : fs::directory_iterator(folder / "a session/boards")) {
    if (image.path().extension() == ".png" && ++views > 5) fs::remove(image.path());
  }
  const auto run = calibrate();
  EXPECT_EQ(run.exit_code, 1) << run.output << run.errors;
  EXPECT_THAT(run.output, HasSubstr("a gate is not met"));
  EXPECT_THAT(result("report.html"), HasSubstr("FAIL"));
}

TEST_F(VlpCalibrateSmallSession, WritesNoCalibrationWhenRotationStepFails) {
  ASSERT_EQ(calibrate().exit_code, 0);
  for (const auto& image : fs::directory_iterator(folder / "a session/rotation")) {
    if (image.path().filename() != "0000.png") fs::remove(image.path());
  }
  const auto run = calibrate();
  EXPECT_EQ(run.exit_code, 3) << run.output;
  EXPECT_THAT(run.errors, HasSubstr("vlp-calibrate: error: rotation: "));
  EXPECT_THAT(result("session.json"), HasSubstr("\"verdict\": \"no result\""));
  EXPECT_THAT(result("session.json"), HasSubstr("\"failure\": \"undetermined\""));
  expect_documents_as_their_schemas_say();
  EXPECT_TRUE(fs::exists(folder / "results/lens.yaml"));
  EXPECT_FALSE(fs::exists(folder / "results/report.html")) << "of the captures before";
  EXPECT_FALSE(fs::exists(folder / "results/calibration.yaml"));
}

/// The same session through the programs of single steps, by hand.
class SingleStepPrograms : public VlpCalibrateSmallSession {
 protected:
  const std::string how = "--row-time-s 3e-5 --readout rows --camera-id unit";

  std::string by_hand(const std::string& name) const {
    return TemporaryFolder::read_content(folder / name);
  }
  static std::string without_history(const std::string& calibration) {
    return calibration.substr(calibration.find("\ncamera:"));
  }
  /// `lens` comes before: the session's, or that of its boards, found here.
  void run_steps(const std::string& lens, const std::string& truth,
                 const std::string& options = "") const {
    const std::string in = "'" + path("a session") + "/", out = "'" + path("");
    const std::string lamps = " --lamps " + in + "lamps.yaml' " + options + " --calibration ";
    for (const std::string& command :
         {"vlp-rotation " + in + "rotation'" + lamps + lens + " -o " + out + "rotated.yaml'",
          "vlp-dispersion " + in + "dispersion'" + lamps + out + "rotated.yaml' -o " + out +
              "calibration.yaml'",
          "vlp-locate " + in + "check'" + lamps + out + "calibration.yaml' -o " + out +
              "fixes.csv'",
          "vlp-evaluate " + out + "fixes.csv' --truth " + in + "check/" + truth +
              "' --calibration " + out + "calibration.yaml' --json " + out + "evaluation.json'"}) {
      const auto run = run_program(command);
      ASSERT_EQ(run.exit_code, 0) << command << run.errors;
    }
  }
  std::string lens_by_hand() const {
    const std::string in = "'" + path("a session") + "/", lens = "'" + path("lens.yaml'");
    const auto run = run_program("vlp-intrinsics " + in + "boards' --board " + in + "board.yaml' " +
                                 how + " -o " + lens);
    EXPECT_EQ(run.exit_code, 0) << run.errors;
    return lens;
  }
  void expect_same_results() const {
    EXPECT_EQ(by_hand("fixes.csv"), result("check-fixes.csv"));
    EXPECT_EQ(by_hand("evaluation.json"), result("evaluation.json"));
    EXPECT_EQ(without_history(by_hand("calibration.yaml")),
              without_history(result("calibration.yaml")));
  }
};

TEST_F(SingleStepPrograms, WriteSameResultsAsVlpCalibrate) {
  ASSERT_EQ(calibrate("--no-report " + how).exit_code, 0);
  run_steps(lens_by_hand(), "truth.csv");
  expect_same_results();
  EXPECT_EQ(by_hand("lens.cameramodel"), result("lens.cameramodel"));
}

TEST_F(SingleStepPrograms, WriteSameResultsAsVlpCalibrateWithInclinationSensor) {
  // One that reads a little, and a table of places without truth.csv.
  std::string captures = "image,x_m,y_m,z_m,roll_rad,pitch_rad\n";
  for (const TruthRow& row : read_truth_table(folder / "a session/check/truth.csv")) {
    captures +=
        fmt::format("{},{},{},{},0.001,-0.002\n", row.image, row.xy_m.x(), row.xy_m.y(), *row.z_m);
  }
  fs::remove(folder / "a session/check/truth.csv");
  folder.file("a session/check/captures.csv", captures);
  ASSERT_EQ(calibrate("--no-report " + how).exit_code, 0);
  run_steps(lens_by_hand(), "captures.csv");
  expect_same_results();
  // The inclination counts: without it the fixes are others.
  folder.file("a session/check/captures.csv",
              std::regex_replace(captures, std::regex("0.001,-0.002"), "0,0"));
  ASSERT_EQ(calibrate("--no-report " + how).exit_code, 0);
  EXPECT_NE(by_hand("fixes.csv"), result("check-fixes.csv"));
}

TEST_F(SingleStepPrograms, WriteSameResultsAsVlpCalibrateWithGivenLens) {
  fs::copy(folder / "a session/true_calibration.yaml", folder / "a session/camera.yaml");
  ASSERT_EQ(calibrate("--no-report").exit_code, 0);
  run_steps("'" + path("a session/camera.yaml'"), "truth.csv");
  expect_same_results();
}

TEST_F(SingleStepPrograms, WriteSameResultsAsVlpCalibrateWithClassifier) {
  const std::string in = path("a session");
  const auto trained = run_program("vlp-train '" + in + "/rotation' --lamps '" + in +
                                   "/lamps.yaml' --calibration '" + in +
                                   "/true_calibration.yaml' -o '" + in + "/classifier.yaml'");
  ASSERT_EQ(trained.exit_code, 0) << trained.errors;
  // Only the classifier identifies the lamps.
  const std::string map = TemporaryFolder::read_content(folder / "a session/lamps.yaml");
  folder.file("a session/lamps.yaml",
              std::regex_replace(map, std::regex(", frequency_hz: [0-9.e+]+"), ""));
  ASSERT_EQ(calibrate("--no-report " + how).exit_code, 0);
  run_steps(lens_by_hand(), "truth.csv", "--classifier '" + in + "/classifier.yaml'");
  expect_same_results();
}

TEST_F(VlpCalibrateSmallSession, RedoOptionRunsOnlyNamedStepAgain) {
  ASSERT_EQ(calibrate().exit_code, 0);
  const std::string session = result("session.json");
  const auto again = calibrate("--row-time-s 3e-5 --readout rows --redo check");
  EXPECT_EQ(again.exit_code, 0);
  EXPECT_THAT(again.output, HasSubstr("dispersion    up to date"));
  EXPECT_THAT(again.output, Not(HasSubstr("check         up to date")));
  EXPECT_THAT(again.output, HasSubstr("evaluate      up to date"));
  EXPECT_EQ(result("session.json"), session) << "whatever was as before";
  const auto unknown = calibrate("--redo checks");
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.errors, HasSubstr("no step checks; the steps are: lens, "));
  const auto known = calibrate("--row-time-s 3e-5 --readout rows --redo row-time");
  EXPECT_EQ(known.exit_code, 2);
  EXPECT_THAT(known.errors,
              HasSubstr("there is no step row-time in this session, as the row time is known"));
}

TEST_F(VlpCalibrateSmallSession, WritesSameResultsWhenResumedAfterKill) {
  ASSERT_EQ(calibrate().exit_code, 0);
  const std::string session = result("session.json"), report = result("report.html");
  int killed_in_time = 0;
  for (const char* moment : {"lens.yaml", "rotated.yaml", "check-fixes.csv"}) {
    fs::remove_all(folder / "results");
    // Killed as soon as the file is there.
    run_program("vlp-calibrate '" + path("a session") + "' -o '" + path("results") +
                "' --row-time-s 3e-5 --readout rows & until [ -e '" + path("results/") + moment +
                "' ] || ! kill -0 $!; do sleep 0.002; done; kill -9 $!; wait $!");
    killed_in_time += fs::exists(folder / "results/session.json") ? 0 : 1;
    const auto on = calibrate();
    EXPECT_EQ(on.exit_code, 0) << moment << on.errors;
    // The lens may not have said yet that it ended.
    if (moment != std::string("lens.yaml")) {
      EXPECT_THAT(on.output, HasSubstr("lens          up to date")) << moment;
    }
    EXPECT_EQ(result("session.json"), session) << moment;
    EXPECT_EQ(result("report.html"), report) << moment;
  }
  EXPECT_GE(killed_in_time, 1) << "a busy machine may be late for the last moments";
}

TEST_F(VlpCalibrateSmallSession, RejectsResultFolderThatContainsForeignFile) {
  fs::create_directory(folder / "mine");
  folder.file("mine/calibration.yaml", "of somebody\n");
  const auto run =
      run_program("vlp-calibrate '" + path("a session") + "' -o '" + path("mine") + "'");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.errors, HasSubstr("mine: holds calibration.yaml, which is not of vlp-calibrate"));
  EXPECT_EQ(TemporaryFolder::read_content(folder / "mine/calibration.yaml"), "of somebody\n");
  EXPECT_FALSE(fs::exists(folder / "mine/steps"));
}

TEST_F(VlpCalibrateSmallSession, RemovesOldResultsWhenLampMapIsMissing) {
  ASSERT_EQ(calibrate().exit_code, 0);
  const std::string lamps = TemporaryFolder::read_content(folder / "a session/lamps.yaml");
  fs::remove(folder / "a session/lamps.yaml");
  EXPECT_EQ(calibrate().exit_code, 2);
  for (const char* name : {"calibration.yaml", "report.html", "line-x-fixes.csv", "lens.yaml"}) {
    EXPECT_FALSE(fs::exists(folder / "results" / name)) << name;
  }
  EXPECT_THAT(result("session.json"), HasSubstr("\"reason\": \"lamps.yaml: is missing\""));
  folder.file("a session/lamps.yaml", lamps);
  ASSERT_EQ(calibrate("--no-report --row-time-s 3e-5 --readout rows").exit_code, 0);
  // A drive's table that is cut costs the report, and is said.
  folder.file("a session/line-x/captures.csv", "image,x_m,y_m\n0000.png,1");
  fs::remove(folder / "a session/line-x/truth.csv");
  const auto cut = calibrate();
  EXPECT_EQ(cut.exit_code, 2);
  EXPECT_THAT(cut.errors, HasSubstr("line-x: line-x/captures.csv:2"));
  EXPECT_TRUE(fs::exists(folder / "results/calibration.yaml"));
  EXPECT_THAT(result("session.json"), HasSubstr("\"verdict\": \"no result\""));
}

TEST_F(VlpCalibrateSmallSession, ListsDamagedImagesAsSkippedInSessionJson) {
  folder.file("a session/rotation/0003.png", "no image");
  fs::resize_file(folder / "a session/check/0001.png", 100);
  const auto run = calibrate("--no-report --row-time-s 3e-5 --readout rows");
  EXPECT_EQ(run.exit_code, 0) << run.errors;
  EXPECT_THAT(run.errors, HasSubstr("0003.png: cannot be read as an image: it is not PNG"));
  const auto json = nlohmann::json::parse(result("session.json"));
  std::map<std::string, std::string> skipped;
  for (const auto& step : json["steps"]) {
    if (!step.contains("skipped")) continue;
    skipped[step["name"].get<std::string>()] = step["skipped"][0]["image"].get<std::string>();
  }
  EXPECT_EQ(skipped,
            (std::map<std::string, std::string>{{"rotation", "0003.png"}, {"check", "0001.png"}}));
  EXPECT_THAT(result("session.json"), Not(HasSubstr(path("")))) << "of no use elsewhere";
  expect_documents_as_their_schemas_say();
}

TEST_F(VlpCalibrateSmallSession, WritesCalibrationSdsAndLampOffsetsToSessionJson) {
  ASSERT_EQ(calibrate("--no-report --row-time-s 3e-5 --readout rows").exit_code, 0);
  const auto json = nlohmann::json::parse(result("session.json"));
  const auto& figures = json["calibration"];
  for (const char* name :
       {"focal_sd_px", "principal_point_sd_px", "zenith_sd_deg", "lever_arm_sd_mm"}) {
    ASSERT_EQ(figures[name].size(), 2) << name;
    for (const auto& sd : figures[name]) {
      EXPECT_GT(sd.get<double>(), 1e-4) << name;
      EXPECT_LT(sd.get<double>(), 1) << name;
    }
  }
  EXPECT_NEAR(
      std::hypot(figures["zenith_deg"][0].get<double>(), figures["zenith_deg"][1].get<double>()),
      figures["tilt_deg"].get<double>(), 1e-3);
  std::size_t lamps = 0;
  for (const auto& step : json["steps"]) {
    if (step.contains("lamp_offsets")) lamps += step["lamp_offsets"].size();
  }
  EXPECT_EQ(lamps, 6);
}

TEST_F(VlpCalibrateSmallSession, RejectsResultFolderOfAnotherSession) {
  ASSERT_EQ(calibrate("--no-report --row-time-s 3e-5 --readout rows").exit_code, 0);
  fs::copy(folder / "a session", folder / "another", fs::copy_options::recursive);
  const auto other = run_program("vlp-calibrate '" + path("another") + "' -o '" + path("results") +
                                 "' --row-time-s 3e-5 --readout rows");
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.errors, HasSubstr("contains the results of another session"));
  EXPECT_EQ(std::count(other.errors.begin(), other.errors.end(), '\n'), 1);
  const auto inside =
      run_program("vlp-calibrate '" + path("another") + "' -o '" + path("another/check") + "'");
  EXPECT_EQ(inside.exit_code, 2);
  EXPECT_THAT(inside.errors, HasSubstr("contains captures: choose another folder for the results"));
}

TEST_F(VlpCalibrate, ErrorNamesMissingFolderFileOrUnknownOption) {
  EXPECT_EQ(run_program("vlp-calibrate").exit_code, 2);
  const auto nowhere = calibrate();
  EXPECT_EQ(nowhere.exit_code, 2);
  EXPECT_THAT(nowhere.errors, HasSubstr("a session: is not a folder of captures"));
  const auto expect_junit_error = [&](const std::string& words) {
    EXPECT_THAT(result("junit.xml"), HasSubstr("errors=\"1\""));
    EXPECT_THAT(result("junit.xml"), HasSubstr(words));
  };
  expect_junit_error("a session: is not a folder of captures");
  fs::create_directory(folder / "a session");
  const auto empty = calibrate();
  EXPECT_EQ(empty.exit_code, 2);
  EXPECT_THAT(empty.errors, HasSubstr("lamps.yaml: is missing"));
  EXPECT_THAT(result("session.json"), HasSubstr("\"failure\": \"bad_input\""));
  EXPECT_THAT(result("junit.xml"),
              HasSubstr("<error type=\"bad_input\" message=\"lamps.yaml: is "));
  EXPECT_THAT(calibrate("--nonsense").errors, HasSubstr("unknown: --nonsense"));
  expect_junit_error("unknown: --nonsense; see vlp-calibrate --help");
  EXPECT_EQ(calibrate("--row-time-s").exit_code, 2);
  expect_junit_error("--row-time-s");
  folder.file("gates.yaml", "format: vlp-gates/1\ngates: {odd_mm: 1}\n");
  EXPECT_THAT(calibrate("--gates '" + path("gates.yaml") + "'").errors, HasSubstr("'odd_mm'"));
  expect_junit_error("odd_mm");
  // Folders of other files are not changed.
  const auto refused = run_program("vlp-calibrate --nonsense -o '" + path("") + "'");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_FALSE(fs::exists(folder / "junit.xml"));
}

}  // namespace
}  // namespace vlp
