// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-calibrate: the whole procedure, from a folder of images to a verdict.
#include <fmt/core.h>
#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
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
using testing::HasSubstr;

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
      return compare_projections(
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

TEST_F(VlpCalibrateSmallSession, ExitsWith1AndWritesReportWhenGatesFail) {
  folder.file("a session/gates.yaml",
              "format: vlp-gates/1\ngates:\n  mean_mm: 1e-6\n  tilt_deg: 1e-6\n");
  const auto failed = calibrate();
  EXPECT_EQ(failed.exit_code, 1) << failed.output << failed.errors;
  for (const char* line :
       {"a gate is not met", "NOT MET     mean_mm is ", "NOT MET     tilt_deg is "}) {
    EXPECT_THAT(failed.output, HasSubstr(line));
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

TEST_F(VlpCalibrateSmallSession, ExitsWith3AndWritesNoCalibrationWhenRotationStepFails) {
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
  EXPECT_FALSE(fs::exists(folder / "results/calibration.yaml"));
}

/// The same session through the programs of single steps, with an inclination sensor and a table of
/// places without truth.csv.
TEST_F(VlpCalibrateSmallSession, SingleStepProgramsWriteSameResultsAsVlpCalibrate) {
  std::string captures = "image,x_m,y_m,z_m,roll_rad,pitch_rad\n";
  for (const TruthRow& row : read_truth_table(folder / "a session/check/truth.csv")) {
    captures +=
        fmt::format("{},{},{},{},0.001,-0.002\n", row.image, row.xy_m.x(), row.xy_m.y(), *row.z_m);
  }
  fs::remove(folder / "a session/check/truth.csv");
  folder.file("a session/check/captures.csv", captures);
  const std::string how = "--row-time-s 3e-5 --readout rows --camera-id unit";
  ASSERT_EQ(calibrate("--no-report " + how).exit_code, 0);
  const std::string in_folder = "cd '" + path("") + "' && S='a session' && ";
  for (const std::string& command :
       {"vlp-intrinsics \"$S\"/boards --board \"$S\"/board.yaml -o lens.yaml " + how,
        std::string(
            "vlp-rotation \"$S\"/rotation --lamps \"$S\"/lamps.yaml --calibration lens.yaml "
            "-o rotated.yaml"),
        std::string("vlp-dispersion \"$S\"/dispersion --lamps \"$S\"/lamps.yaml --calibration "
                    "rotated.yaml -o calibration.yaml"),
        std::string("vlp-locate \"$S\"/check --lamps \"$S\"/lamps.yaml --calibration "
                    "calibration.yaml -o fixes.csv"),
        std::string("vlp-evaluate fixes.csv --truth \"$S\"/check/captures.csv --calibration "
                    "calibration.yaml --json evaluation.json")}) {
    const auto run = run_program(in_folder + command);
    ASSERT_EQ(run.exit_code, 0) << command << run.errors;
  }
  const auto by_hand = [&](const char* name) {
    return TemporaryFolder::read_content(folder / name);
  };
  const auto without_history = [](const std::string& calibration) {
    return calibration.substr(calibration.find("\ncamera:"));
  };
  EXPECT_NE(by_hand("fixes.csv"), "");
  EXPECT_EQ(by_hand("fixes.csv"), result("check-fixes.csv"));
  EXPECT_EQ(by_hand("evaluation.json"), result("evaluation.json"));
  EXPECT_EQ(by_hand("lens.cameramodel"), result("lens.cameramodel"));
  EXPECT_EQ(without_history(by_hand("calibration.yaml")),
            without_history(result("calibration.yaml")));
}

TEST_F(VlpCalibrateSmallSession, WritesSameResultsWhenResumedAfterKill) {
  ASSERT_EQ(calibrate().exit_code, 0);
  const std::string session = result("session.json"), report = result("report.html");
  int killed_in_time = 0;
  // Outputs get their names when all steps are done.
  for (const char* moment : {"steps/corners", "steps/check.json"}) {
    fs::remove_all(folder / "results");
    // Killed as soon as the file is there.
    run_program("vlp-calibrate '" + path("a session") + "' -o '" + path("results") +
                "' --row-time-s 3e-5 --readout rows & until [ -e '" + path("results/") + moment +
                "' ] || ! kill -0 $!; do sleep 0.002; done; kill -9 $!; wait $!");
    killed_in_time += fs::exists(folder / "results/session.json") ? 0 : 1;
    const auto on = calibrate();
    EXPECT_EQ(on.exit_code, 0) << moment << on.errors;
    if (moment == std::string("steps/check.json")) {
      EXPECT_THAT(on.output, HasSubstr("lens          up to date")) << moment;
    }
    EXPECT_EQ(result("session.json"), session) << moment;
    EXPECT_EQ(result("report.html"), report) << moment;
  }
  EXPECT_GE(killed_in_time, 1) << "a busy machine may be late for the last moment";
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
