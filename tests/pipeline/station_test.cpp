// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-station: units to their verdicts, from full folders; the records.
#include <nlohmann/json.hpp>
#include <regex>

#include "small_station.h"
#include "support/schema.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::AnyOf;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

class VlpStation : public SmallStation {
 protected:
  /// The folder with the results of the one run of a camera.
  fs::path only_results(const std::string& camera) const {
    return fs::directory_iterator(folder / "station/results" / camera)->path();
  }
};

TEST_F(VlpStation, PassesGoodUnitAndKeepsRecord) {
  render();
  const auto result = run_program(batch());
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.output, AllOf(HasSubstr("PASS   camera 0001"), Not(HasSubstr("NOT MET"))));
  const std::string calibration = this->result("0001", "calibration.yaml");
  EXPECT_THAT(calibration, AllOf(HasSubstr("rotation_center"), HasSubstr("dispersion")));
  EXPECT_THAT(this->result("0001", "report.html"),
              AllOf(HasSubstr("<strong>PASS"), HasSubstr("check_mean_mm"), HasSubstr("LENSMODEL"),
                    // the captions of the pictures of lens, rotation center and dispersion
                    HasSubstr("Coverage: the corners"), HasSubstr("Left: the lamps"),
                    HasSubstr("Fixes minus reference point")));
  // A unit calibrated again keeps its history, and gives the same calibration.
  take_again();
  change(
      "station.yaml", "# The images of a unit",
      "guard_bands: {k: 2, standard_uncertainties: {check_mean_mm: 0.01}}\n# The images of a unit");
  const auto guarded = run_program(batch("0002") + " --threads 1");
  EXPECT_EQ(guarded.exit_code, 0);
  EXPECT_THAT(guarded.output, ContainsRegex("check_mean_mm +[0-9.e-]+ +<= 0.98 mm +met, p 1.000"));
  EXPECT_THAT(this->result("0002", "report.html"),
              AllOf(HasSubstr("less a guard band of 0.02 mm"), HasSubstr("conforms with p")));
  EXPECT_EQ(comparable_calibration("0002"), comparable_calibration("0001"));

  EXPECT_THAT(records("list").output,
              HasSubstr("2 runs, 2 passed, 0 failed, 0 invalid: yield 100.0 % of 2"));
  // The files of a run come back from its record.
  const fs::path files = only_results("0001");
  fs::remove_all(files);
  EXPECT_EQ(records("restore " + files.filename().string()).output, files.string() + "\n");
  EXPECT_EQ(this->result("0001", "calibration.yaml"), calibration);
  EXPECT_THAT(this->result("0001", "report.html"), HasSubstr("<strong>PASS"));
  const auto certified = records("certificate " + files.filename().string());
  EXPECT_EQ(certified.output, (files / "certificate.html").string() + "\n") << certified.errors;
  EXPECT_THAT(this->result("0001", "certificate.html"),
              AllOf(HasSubstr("Calibration certificate: camera 0001"),
                    ContainsRegex("focal length x</th><td>[0-9.]+ \u00b1 0[.][0-9]+\u00a0px"),
                    HasSubstr("lamp map")));
  EXPECT_THAT(records("list --camera-id 0002").output, HasSubstr("1 runs, 1 passed"));
  EXPECT_THAT(records("show --camera-id 0001").output,
              AllOf(ContainsRegex("check_mean_mm +[0-9.e-]+ +<= 1 mm +met"),
                    ContainsRegex("rotation_spread_px +[0-9.e-]+ px"),
                    HasSubstr("images     48, 48 used")));
  const auto exported = folder / "runs.json", picture = folder / "trend.svg";
  EXPECT_EQ(records("export -o " + exported.string()).exit_code, 0);
  EXPECT_THAT(TemporaryFolder::read_content(exported), HasSubstr("vlp-calibration/1"));
  const auto runs = nlohmann::json::parse(TemporaryFolder::read_content(exported));
  ASSERT_EQ(runs.size(), 2U);
  EXPECT_EQ(problems_by_schema("run", {folder.file("run.json", runs[0].dump())}), "");
  EXPECT_THAT(records("trend rms_px -o " + picture.string()).output, HasSubstr("limits"));
  EXPECT_THAT(TemporaryFolder::read_content(picture), HasSubstr("<svg"));

  // The golden unit on the station as it was, and after a lamp has moved.
  folder.file("station/golden.yaml", calibration);
  change("station.yaml", "# The images of a unit",
         "golden: {camera_id: \"0001\", calibration: golden.yaml, gates: {check_mean_mm: 0.5, "
         "check_lamp_inlier_fraction: 0.95, world_offset_mm: 1, principal_point_px: 1}}\n# The "
         "images of a unit");
  // A lamp that is out of the golden unit's view is for a gate to ask for (check_lamps_seen).
  change("lamps.yaml", "  - {id: 1,",
         "  - {id: 7, position_m: [3, 3, 1.6], diameter_m: 0.18, frequency_hz: 6000, duty: 0.5}\n"
         "  - {id: 1,");
  const std::string verify = "verify --batch " + (folder / "unit").string();
  const auto steady = records(verify);
  EXPECT_EQ(steady.exit_code, 0) << steady.output << steady.errors;
  change("lamps.yaml", "[0, 0.28, 1.6]", "[0.06, 0.28, 1.6]");
  const auto moved = records(verify);
  EXPECT_EQ(moved.exit_code, 1);
  EXPECT_THAT(moved.errors, HasSubstr("lamp 5 hangs"));
  EXPECT_THAT(records("list --kind golden").output, HasSubstr("2 runs, 1 passed"));

  // From where its images arrive, like any unit's; they are put away.
  fs::create_directories(captures("0001"));
  fs::copy(folder / "unit/check", captures("0001") / "check");
  EXPECT_EQ(records("verify").exit_code, 1);
  EXPECT_FALSE(fs::exists(captures("0001")));
  EXPECT_THAT(records("list --kind golden").output, HasSubstr("3 runs, 1 passed"));
  EXPECT_THAT(records("verify").errors, HasSubstr("check"));
}

TEST_F(VlpStation, ReturnsInvalidAndNamesMovedLamp) {
  render();
  change("lamps.yaml", "[0, 0.28, 1.6]", "[0.05, 0.27, 1.6]");
  const auto loose = run_program(batch("loose"));
  EXPECT_EQ(loose.exit_code, 3);
  EXPECT_THAT(loose.errors, HasSubstr("not judged: lamp 5 hangs"));
  EXPECT_THAT(loose.output, HasSubstr("INVALID   camera loose"));
  EXPECT_EQ(result("loose", "calibration.yaml"), "");
  EXPECT_NE(result("loose", "invalid-calibration.yaml"), "");
  EXPECT_THAT(result("loose", "report.html"), HasSubstr("<strong>INVALID</strong><p>lamp 5 hangs"));
  EXPECT_THAT(records("list").output, HasSubstr("1 runs, 0 passed, 0 failed, 1 invalid\n"));
}

/// A row time with which each lamp is taken for its neighbor.
TEST_F(VlpStation, ReturnsInvalidAndMeasuredRowTimeForWrongRowTimeOfCameraType) {
  render();
  change("camera_type.yaml", "row_time_s: 3.0e-05", "row_time_s: 37.5e-06");
  const auto run = run_program(batch());
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(
      run.errors,
      ContainsRegex("not judged: row time is 37.5 us in camera_type.yaml, but the stripes of "
                    "6 lamps measure (29[.]9|30[.]0)[0-9] [+]- 0[.]0[0-9] us; correct it"));
}

/// One unit's images, as another's, until the run under the wrong serial is voided.
TEST_F(VlpStation, RejectsImagesUsedForAnotherSerialUntilRunIsVoided) {
  render_four_boards();
  EXPECT_EQ(run_program(batch("MIX")).exit_code, 3);
  const auto result = run_program(batch("0002"));
  EXPECT_EQ(result.exit_code, 3);
  std::smatch way_out;
  ASSERT_TRUE(std::regex_search(
      result.errors, way_out,
      std::regex("4 of 4 images refused: 4 already of camera MIX, run 20[0-9TZ]+-[0-9a-f]{16}: if "
                 "its serial was wrong, 'vlp-station (void 20[^ ]+) ")));
  EXPECT_THAT(records("show --camera-id 0002").output, HasSubstr("4, 0 used"));
  ASSERT_EQ(records(way_out.str(1) + " --operator Ann --reason 'wrong serial'").exit_code, 0);
  EXPECT_THAT(run_program(batch("0002")).errors, Not(HasSubstr("already of")));
}

/// Whatever cannot be written, the verdict is on the screen, in the record, and can be restored.
TEST_F(VlpStation, RecordsVerdictAndRestoresFilesThatCouldNotBeWritten) {
  render_four_boards();
  fs::create_directories(captures("0001"));
  fs::copy(folder / "unit/boards", captures("0001") / "boards");
  // While it waits for images, a file takes the place of the folder.
  const auto results = folder / "station/results";
  const std::string there = results.string();
  const auto result =
      run_program("(until [ -d " + there + "/0001 ]; do sleep 0.05; done; sleep 0.5; mv " + there +
                  " " + there + "-old; touch " + there + ") & " + run("0001", "--idle-s 3") +
                  "; code=$?; wait; exit $code");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.output, HasSubstr("INVALID   camera 0001"));
  EXPECT_THAT(result.errors,
              AllOf(HasSubstr("cannot be made"), HasSubstr("the verdict INVALID is recorded"),
                    HasSubstr("vlp-station restore 20")));
  fs::remove(results);
  const std::string listed = records("list").output;
  const auto at = listed.find("\n20");
  ASSERT_NE(at, std::string::npos);
  EXPECT_EQ(records("restore " + listed.substr(at + 1, 33)).exit_code, 0);
  EXPECT_THAT(this->result("0001", "report.html"), HasSubstr("<strong>INVALID"));
  const auto certified = records("certificate " + listed.substr(at + 1, 33));
  EXPECT_EQ(certified.exit_code, 2);
  EXPECT_THAT(certified.errors, HasSubstr("was not judged (boards"));
}

/// Records away: units get their verdicts all the same, and nothing is lost.
TEST_F(VlpStation, SpoolsRunsAndDeliversThemWhenRecordsReturn) {
  change("station.yaml", "records: records.db", "records: share/records.db");
  render_four_boards();
  const auto first = run_program(batch("0001"));
  EXPECT_EQ(first.exit_code, 3);
  const auto is_short = Not(AnyOf(HasSubstr("share/records.db"), HasSubstr("kept here")));
  EXPECT_THAT(
      first.errors,
      AllOf(HasSubstr("warning: records are offline; runs are kept, delivered automatically"),
            is_short));
  EXPECT_THAT(first.output,
              AllOf(HasSubstr("INVALID   camera 0001"),
                    HasSubstr("Records  records are offline; 1 run kept, delivered automatically"),
                    is_short));
  // Guards go on with what is kept here.
  const auto second = run_program(batch("0002"));
  EXPECT_THAT(second.errors, HasSubstr("4 of 4 images refused: 4 already of camera 0001"));
  EXPECT_THAT(second.output, HasSubstr("2 runs kept, delivered automatically"));
  const auto listed = records("list");
  EXPECT_EQ(listed.exit_code, 2) << "these may not be all";
  EXPECT_THAT(listed.output,
              AllOf(HasSubstr("(waits here) boards"), HasSubstr("2 runs, 0 passed")));
  const std::string offline = "records are offline; 2 runs kept, delivered automatically\n";
  EXPECT_EQ(listed.errors, "vlp-station: error: " + offline);
  EXPECT_THAT(
      records("list --verbose").errors,
      AllOf(HasSubstr("share/records.db"), HasSubstr("runs are queued in the spool, 2 waiting")));
  EXPECT_EQ(records("export -o " + (folder / "runs.csv").string()).exit_code, 2);
  const auto shown = records("show --camera-id 0002");
  EXPECT_EQ(shown.exit_code, 0);
  EXPECT_THAT(shown.output, HasSubstr("INVALID   camera 0002"));
  EXPECT_EQ(shown.errors, "vlp-station: warning: " + offline);

  fs::create_directory(folder / "station/share");
  EXPECT_EQ(records("list").exit_code, 2);
  EXPECT_FALSE(fs::exists(folder / "station/share/records.db")) << "a station makes it";
  EXPECT_EQ(run_program(batch("0001")).exit_code, 3);
  const auto there = records("list");
  EXPECT_EQ(there.exit_code, 0) << there.errors;
  EXPECT_THAT(there.output, AllOf(HasSubstr("3 runs, 0 passed"), Not(HasSubstr("waits"))));
  EXPECT_THAT(spooled_files(), testing::ElementsAre("outbox.db"));
}

/// A camera that tilts in its housing after the turn.
TEST_F(VlpStation, FailsUnitWhoseTiltChangesBeforeCheck) {
  render();
  fs::rename(folder / "unit/check", folder / "check");
  fs::rename(folder / "unit", folder / "first");
  change("scene.yaml", "tilt_deg: 0.4", "tilt_deg: 0.8");
  render("check");
  fs::rename(folder / "unit/check", folder / "first/check");
  fs::remove_all(folder / "unit");
  fs::rename(folder / "first", folder / "unit");
  const auto result = run_program(batch());
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.errors,
              ContainsRegex("camera 0001 fails: the camera moved on its mount: in the "
                            "check, it is .* tilted by 0\\.[34][0-9] degrees"));
}

struct LensFault {
  const char* name;
  std::string from, to, cause;

  friend void PrintTo(const LensFault& fault, std::ostream* out) { *out << fault.name; }
};
class VlpStationFaultyLens : public SmallStation, public testing::WithParamInterface<LensFault> {};

TEST_P(VlpStationFaultyLens, FirstCauseNamesFaultOfLens) {
  change("scene.yaml", GetParam().from, GetParam().to);
  change("scene.yaml", "count: 16", "count: 12");
  change("station.yaml", "board_views: 16", "board_views: 12");
  render("boards");
  const auto result = run_program(batch());
  // Too little light is the station's, and so is the board.
  const bool invalid =
      GetParam().cause.starts_with("boards") || GetParam().cause.starts_with("the board");
  EXPECT_EQ(result.exit_code, invalid ? 3 : 1);
  EXPECT_THAT(result.output, HasSubstr(invalid ? "INVALID   camera" : "FAIL   camera"));
  // The cause is the first that is named, before what follows from it.
  EXPECT_THAT(result.errors,
              HasSubstr(std::string("camera 0001 ") + (invalid ? "is not judged: " : "fails: ") +
                        GetParam().cause));
  EXPECT_THAT(records("show").output, HasSubstr("Cause    " + GetParam().cause));
}

INSTANTIATE_TEST_SUITE_P(
    VlpStation, VlpStationFaultyLens,
    testing::Values(LensFault{"decentered", "402.3, 297.4", "418.3, 285.4",
                              "the lens is decentered"},
                    LensFault{"blurred", "blur_px: 0.7", "blur_px: 2.5", "the lens is blurred"},
                    LensFault{"wrong", "[520, 520.6", "[480, 480.5", "wrong lens"},
                    LensFault{"bent", "warp_m: [0.0003, -0.0002]", "warp_m: [0.01, -0.0002]",
                              "the board is warped"},
                    LensFault{"dark",
                              "white_e_per_s: 2.4e+6\n  black_e_per_s: 1.5e+5\n"
                              "  surround_e_per_s: 6.0e+5",
                              "white_e_per_s: 2.4e+4\n  black_e_per_s: 1.5e+3\n"
                              "  surround_e_per_s: 6.0e+3",
                              "boards (0/12): 12 of 12 images refused: 12 too dark"}),
    [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace vlp
