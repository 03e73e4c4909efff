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
  /// Other captures, of the scene as it is now, with the boards that are there.
  void render_after_the_boards(const std::string& only) const {
    fs::rename(folder / "unit/boards", folder / "boards");
    fs::remove_all(folder / "unit");
    render(only);
    fs::rename(folder / "boards", folder / "unit/boards");
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
                    ContainsRegex("nominal_difference_px +[0-9.e-]+ px"),
                    HasSubstr("images     48, 48 used")));
  const auto exported = folder / "runs.json", picture = folder / "trend.svg";
  EXPECT_EQ(records("export -o " + exported.string()).exit_code, 0);
  EXPECT_THAT(TemporaryFolder::read_content(exported), HasSubstr("vlp-calibration/1"));
  EXPECT_EQ(problems_by_schema("runs", {exported}), "");
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

/// Runs on the same images count once, independently of the verdict.
TEST_F(VlpStation, RejectsAlreadyJudgedImagesUntilRunIsVoided) {
  render();
  ASSERT_EQ(run_program(batch()).exit_code, 0);
  const std::string first = only_results("0001").filename().string();
  const auto again = run_program(batch());
  EXPECT_EQ(again.exit_code, 3);
  EXPECT_THAT(again.errors,
              HasSubstr("camera 0001 is not judged: all images are those of run " + first +
                        ", which is no repetition: take new ones, or 'vlp-station void " + first));
  EXPECT_THAT(records("list").output,
              HasSubstr("2 runs, 1 passed, 0 failed, 1 invalid: yield 100.0 % of 1"));
  ASSERT_EQ(records("void " + first + " --operator Ann --reason 'wrong lamps'").exit_code, 0);
  EXPECT_FALSE(fs::exists(folder / "station/results/0001" / first / "calibration.yaml"));
  EXPECT_TRUE(fs::exists(folder / "station/results/0001" / first / "voided-calibration.yaml"));
  EXPECT_EQ(run_program(batch()).exit_code, 0) << "it is the only one that counts";
}

/// The station feeds images one by one to the steps that vlp-calibrate takes a folder through.
TEST_F(VlpStation, MetricsEqualThoseOfVlpCalibrate) {
  render();
  folder.file("unit/check/captures.csv", with_inclinations("check"));
  ASSERT_EQ(run_program(batch()).exit_code, 0);
  for (const char* name : {"lamps.yaml", "board.yaml"}) {
    fs::copy_file(folder / "station" / name, folder / "unit" / name,
                  fs::copy_options::overwrite_existing);
  }
  const auto calibrated = run_program(
      "vlp-calibrate " + (folder / "unit").string() + " -o " + (folder / "results").string() +
      " --no-report --camera-id 0001 --row-time-s 3e-5 --readout rows");
  ASSERT_EQ(calibrated.exit_code, 0) << calibrated.errors;
  // What only one of them knows: what was done, and the size of the pixels.
  const auto comparable = [](std::string calibration) {
    calibration = calibration.substr(calibration.find("\ncamera:"));
    return std::regex_replace(calibration, std::regex("\n  pixel_pitch_m: [0-9.e-]+"), "");
  };
  EXPECT_EQ(comparable(result("0001", "calibration.yaml")),
            comparable(TemporaryFolder::read_content(folder / "results/calibration.yaml")));

  using Json = nlohmann::json;
  ASSERT_EQ(records("export -o " + (folder / "runs.json").string()).exit_code, 0);
  const Json figures =
      Json::parse(TemporaryFolder::read_content(folder / "runs.json")).at(0).at("metrics");
  const auto of_station = [&](const std::string& name) {
    return figures.at(name).at("value").get<double>();
  };
  const auto of_session = [&](const char* file) {
    return Json::parse(TemporaryFolder::read_content(folder / "results" / file));
  };
  const Json session = of_session("session.json");
  int same = 0;
  for (const Json& metric : session.at("metrics")) {
    const auto name = metric.at("name").get<std::string>();
    // The session measures the row time from the rotation, the station from all steps.
    if (!figures.contains(name) || name.starts_with("row_time")) continue;
    EXPECT_EQ(of_station(name), metric.at("value").get<double>()) << name;
    ++same;
  }
  EXPECT_EQ(same, 20);  // of lens, sharpness, rotation and dispersion
  // The errors have the station's names, and there their fixes go through a table of nanometers.
  const auto horizontal = of_session("evaluation.json").at("horizontal");
  EXPECT_NEAR(of_station("check_mean_mm"), horizontal.at("mean_mm").get<double>(), 1e-6);
}

TEST_F(VlpStation, NamesMovedLampSwappedLampsAndWrongBoard) {
  render();
  const auto lamps = TemporaryFolder::read_content(folder / "station/lamps.yaml");
  change("lamps.yaml", "[0, 0.28, 1.6]", "[0.05, 0.27, 1.6]");
  const auto loose = run_program(batch("loose"));
  EXPECT_EQ(loose.exit_code, 3);
  EXPECT_THAT(loose.errors, HasSubstr("not judged: lamp 5 hangs"));
  EXPECT_THAT(loose.output, HasSubstr("INVALID   camera loose"));
  EXPECT_EQ(result("loose", "calibration.yaml"), "");
  EXPECT_NE(result("loose", "invalid-calibration.yaml"), "");
  EXPECT_THAT(result("loose", "report.html"), HasSubstr("<strong>INVALID</strong><p>lamp 5 hangs"));

  folder.file("station/lamps.yaml", lamps);
  change("lamps.yaml", "frequency_hz: 2000", "frequency_hz: 9999");
  change("lamps.yaml", "frequency_hz: 3800", "frequency_hz: 2000");
  change("lamps.yaml", "frequency_hz: 9999", "frequency_hz: 3800");
  take_again();
  const auto swapped = run_program(batch("swapped"));
  EXPECT_EQ(swapped.exit_code, 3);
  EXPECT_THAT(swapped.errors, HasSubstr("not judged: lamps 2 and 5 seem to be swapped"));

  folder.file("station/lamps.yaml", lamps);
  change("board.yaml", "first_id: 0", "first_id: 100");
  take_again();
  const auto board = run_program(batch("board"));
  EXPECT_EQ(board.exit_code, 3);
  EXPECT_THAT(board.errors, HasSubstr("not judged: wrong board"));
  EXPECT_THAT(records("list").output, AllOf(HasSubstr("3 runs, 0 passed, 0 failed, 3 invalid\n"),
                                            HasSubstr("lamps 2 and 5 seem to be swapped")));
  EXPECT_THAT(records("trend rms_px").errors, HasSubstr("0 of the runs have rms_px"));
}

/// Faults of the operator or the station do not fail a unit.
TEST_F(VlpStation, ReturnsInvalidNotFailForWrongPositionsOrImagesInWrongFolder) {
  render();
  const auto table = folder / "unit/check/captures.csv", truth = folder / "unit/check/truth.csv";
  fs::rename(table, folder / "captures.csv");
  if (fs::exists(truth)) fs::rename(truth, folder / "truth.csv");
  const auto places = run_program(batch());
  EXPECT_EQ(places.exit_code, 3);
  EXPECT_THAT(places.errors, HasSubstr("not judged: check: 8 of the 8 captures have no position"));
  fs::rename(folder / "captures.csv", table);

  // One capture of the check beside where its table has it.
  const std::string said = TemporaryFolder::read_content(table);
  std::smatch x_m;
  ASSERT_TRUE(std::regex_search(said, x_m, std::regex("0003\\.png,[^,]*,([^,]*),")));
  std::string moved = said;
  moved.replace(static_cast<std::size_t>(x_m.position(1)), x_m.str(1).size(),
                std::to_string(std::stod(x_m.str(1)) + 0.02));
  folder.file("unit/check/captures.csv", moved);
  const auto elsewhere = run_program(batch());
  EXPECT_EQ(elsewhere.exit_code, 3);
  EXPECT_THAT(
      elsewhere.errors,
      HasSubstr(
          "not judged: 0003.png was not taken at the position in its table: its error is 20.0 mm"));
  folder.file("unit/check/captures.csv", said);

  // Images of one step in the folder of another.
  const auto boards = folder / "unit/boards", check = folder / "unit/check";
  fs::rename(boards, folder / "unit/kept");
  fs::copy(check, boards);
  const auto lamps_as_boards = run_program(batch());
  EXPECT_EQ(lamps_as_boards.exit_code, 3);
  EXPECT_THAT(lamps_as_boards.errors,
              HasSubstr("not judged: boards (0/16): 8 of 8 images refused"));
  fs::remove_all(boards);
  fs::rename(folder / "unit/kept", boards);
  fs::remove_all(check);
  fs::copy(boards, check);
  const auto boards_as_check = run_program(batch());
  EXPECT_EQ(boards_as_check.exit_code, 3);
  EXPECT_THAT(boards_as_check.errors, HasSubstr("not judged: check"));
  EXPECT_THAT(records("list").output, HasSubstr("4 runs, 0 passed, 0 failed, 4 invalid\n"));
}

/// Row times with which lamps are still identified, with which none is, and with which each is
/// taken for its neighbor.
TEST_F(VlpStation, ReturnsInvalidAndMeasuredRowTimeForWrongRowTimeOfCameraType) {
  render();
  std::string stated = "row_time_s: 3.0e-05";
  for (const char* wrong_us : {"28.5", "33", "37.5"}) {
    const std::string wrong = "row_time_s: " + std::string(wrong_us) + "e-06";
    change("camera_type.yaml", stated, wrong);
    stated = wrong;
    const auto run = run_program(batch());
    EXPECT_EQ(run.exit_code, 3);
    EXPECT_THAT(run.errors,
                AllOf(HasSubstr("not judged: row time is " + std::string(wrong_us) +
                                " us in camera_type.yaml, but the stripes of 6 lamps measure "),
                      ContainsRegex("measure (29[.]9|30[.]0)[0-9] [+]- 0[.]0[0-9] us; correct it")))
        << wrong_us;
  }
  EXPECT_THAT(records("show").output, HasSubstr("row_time_sd_us"));
}

TEST_F(VlpStation, VerifyReportsWrongRowTimeInGoldenCalibration) {
  render("check");
  const std::string right = TemporaryFolder::read_content(folder / "unit/true_calibration.yaml");
  const std::string stated = "row_time_s: 0.00003";
  ASSERT_NE(right.find(stated), std::string::npos);
  change("station.yaml", "# The images of a unit",
         "golden: {camera_id: golden, calibration: golden.yaml, gates: {check_mean_mm: 0.5}}\n"
         "# The images of a unit");
  for (const std::string wrong_us : {"28.5", "37.5"}) {
    std::string wrong = right;
    wrong.replace(wrong.find(stated), stated.size(), "row_time_s: " + wrong_us + "e-06");
    folder.file("station/golden.yaml", wrong);
    const auto verified = records("verify --batch " + (folder / "unit").string());
    EXPECT_EQ(verified.exit_code, 3);
    EXPECT_THAT(verified.errors,
                ContainsRegex("not judged: row time is " + wrong_us +
                              " us in the calibration of the golden unit, but the stripes of [56] "
                              "lamps measure (29[.]9|30[.]0)"));
  }
}

/// One unit's images, as another's.
TEST_F(VlpStation, RejectsImagesUsedForAnotherSerial) {
  render_four_boards();
  EXPECT_EQ(run_program(batch("0001")).exit_code, 3);
  EXPECT_EQ(run_program(batch("0001")).exit_code, 3);  // its own, again
  const auto result = run_program(batch("0002"));
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.errors,
              ContainsRegex("4 of 4 images refused: 4 already of camera 0001, run (20[0-9TZ]+-"
                            "[0-9a-f]{16}): if its serial was wrong, 'vlp-station void 20"));
  EXPECT_THAT(records("show --camera-id 0001").output, HasSubstr("4, 4 used"));
  EXPECT_THAT(records("show --camera-id 0002").output, HasSubstr("4, 0 used"));
}

/// The way out that is named after images went under a wrong serial.
TEST_F(VlpStation, AcceptsImagesForOtherSerialAfterRunIsVoided) {
  render_four_boards();
  EXPECT_EQ(run_program(batch("MIX")).exit_code, 3);
  const std::string errors = run_program(batch("0002")).errors;
  std::smatch way_out;
  ASSERT_TRUE(std::regex_search(errors, way_out, std::regex("'vlp-station (void 20[^ ]+) ")));
  ASSERT_EQ(records(way_out.str(1) + " --operator Ann --reason 'wrong serial'").exit_code, 0);
  EXPECT_THAT(run_program(batch("0002")).errors, Not(HasSubstr("already of")));
}

/// Before the first image is looked at.
TEST_F(VlpStation, RejectsUnwritableResultsFolder) {
  folder.file("station/results", "a file");
  const auto result = run_program(run("0001", "--idle-s 60"));
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.errors, HasSubstr("results: cannot be made"));
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

/// Repetitions of evaluated units are found in the records.
TEST_F(VlpStation, WarnsThatReuseOfImagesIsUncheckedWhileRecordsAreOffline) {
  change("station.yaml", "records: records.db", "records: share/records.db");
  render();
  const auto passed = run_program(batch());
  EXPECT_EQ(passed.exit_code, 0) << passed.errors;
  const std::string unchecked =
      "the records are offline: whether an earlier run used the same images was not checked";
  EXPECT_THAT(passed.errors, HasSubstr("warning: " + unchecked + "\n"));
  EXPECT_THAT(records("show").output, ContainsRegex("unchecked +20[^ ]+ .*" + unchecked));
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
  EXPECT_TRUE(fs::is_empty(folder / "station/spool"));
}

/// Saturation hides edges and stripes.
TEST_F(VlpStation, RefusesOverexposedBoardImages) {
  change("scene.yaml", "white_e_per_s: 2.4e+6", "white_e_per_s: 2.4e+8");
  render_four_boards();
  const auto boards = run_program(batch("0001"));
  EXPECT_EQ(boards.exit_code, 3);
  EXPECT_THAT(boards.output, HasSubstr("images refused: 4 overexposed"));
}

/// Lamps below the noise, and a saturated ceiling.
TEST_F(VlpStation, RefusesOverexposedAndTooDarkLampImages) {
  render("boards");
  change("scene.yaml", "ambient_e_per_s: 1.0e+6", "ambient_e_per_s: 1.0e+10");
  render_after_the_boards("rotation");
  EXPECT_THAT(run_program(batch("0001")).errors,
              HasSubstr("camera 0001 is not judged: rotation (0/12): 12 of 12 images refused: 12 "
                        "overexposed: less exposure, gain or light"));
  change("scene.yaml", "ambient_e_per_s: 1.0e+10", "ambient_e_per_s: 1.0e+4");
  for (int lamp = 0; lamp < 6; ++lamp) change("scene.yaml", "s: 2.0e+8", "s: 1.5e+6");
  render_after_the_boards("rotation");
  EXPECT_THAT(run_program(batch("0001")).errors,
              HasSubstr("camera 0001 is not judged: rotation (0/12): 12 of 12 images refused: 12 "
                        "too dark: more exposure, gain or light"));
}

/// The lamps do not turn about one axis, and the fixes scatter: because of that.
TEST_F(VlpStation, ReturnsInvalidWhenLampImagesAreOfOtherLensThanBoardImages) {
  render("boards");
  change("scene.yaml", "[520, 520.6, 402.3, 297.4", "[508, 508.4, 407.3, 304.4");
  render_after_the_boards("rotation,dispersion,check");
  const auto result = run_program(batch("0001"));
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.errors,
              ContainsRegex("is not judged: lamps and boards are imaged by different lenses: the "
                            "lamps fit a focal length of 508[.].* px and the center [(]407"));
}

/// Images of another unit among those of the boards.
TEST_F(VlpStation, ReturnsInvalidAndNamesBoardImagesOfAnotherUnit) {
  render("boards");
  fs::rename(folder / "unit", folder / "first");
  change("scene.yaml", "[520, 520.6, 402.3, 297.4", "[508, 508.4, 407.3, 304.4");
  change("scene.yaml", "seed: 1", "seed: 2");
  render("boards");
  for (const char* image : {"0003.png", "0008.png"}) {
    fs::copy_file(folder / "unit/boards" / image, folder / "first/boards" / image,
                  fs::copy_options::overwrite_existing);
  }
  fs::remove_all(folder / "unit");
  fs::rename(folder / "first", folder / "unit");
  const auto result = run_program(batch());
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.errors, HasSubstr("camera 0001 is not judged: boards: 2 board images do not "
                                       "fit the other 14: 0003.png, 0008.png"));
  // The shared step warns.
  fs::copy_file(folder / "station/board.yaml", folder / "unit/board.yaml",
                fs::copy_options::overwrite_existing);
  EXPECT_THAT(
      run_program("vlp-intrinsics " + (folder / "unit/boards").string() + " --board " +
                  (folder / "station/board.yaml").string() + " -o " + (folder / "c.yaml").string())
          .errors,
      HasSubstr("warning: 2 board images do not fit the other 14: 0003.png, 0008.png"));
}

/// Images of another unit among those of the check, or all of them.
TEST_F(VlpStation, ReturnsInvalidWhenSomeOrAllCheckImagesAreOfAnotherUnit) {
  render();
  fs::rename(folder / "unit", folder / "first");
  change("scene.yaml", "[520, 520.6, 402.3, 297.4", "[516, 516.5, 399.1, 301.0");
  render("check");
  for (const char* image : {"0000.png", "0001.png", "0002.png"}) {
    fs::copy_file(folder / "unit/check" / image, folder / "first/check" / image,
                  fs::copy_options::overwrite_existing);
  }
  fs::rename(folder / "unit/check", folder / "check");
  fs::remove_all(folder / "unit");
  fs::rename(folder / "first", folder / "unit");
  const auto some = run_program(batch());
  EXPECT_EQ(some.exit_code, 3);
  EXPECT_THAT(some.errors,
              ContainsRegex("camera 0001 is not judged: captures 0000.png to 0002.png have errors "
                            "up to [0-9.]+ mm, the others 0[.]0[0-9]+ mm"));
  // The shared step warns.
  EXPECT_THAT(
      run_program("vlp-calibrate " + (folder / "unit").string() + " -o " +
                  (folder / "results").string() + " --no-report --row-time-s 3e-5 --readout rows")
          .errors,
      HasSubstr("captures 0000.png to 0002.png have errors up to "));
  fs::remove_all(folder / "unit/check");
  fs::rename(folder / "check", folder / "unit/check");
  const auto all = run_program(batch());
  EXPECT_EQ(all.exit_code, 3);
  EXPECT_THAT(
      all.errors,
      ContainsRegex("camera 0001 is not judged: the images of check are of another camera: its "
                    "focal length differs: the heights have an error of [+-][0-9.]+ mm"));
}

/// Images of another unit that the fits reject as outliers.
TEST_F(VlpStation, ReturnsInvalidAndNamesLampImagesOfAnotherUnit) {
  render();
  fs::rename(folder / "unit", folder / "first");
  change("scene.yaml", "[520, 520.6, 402.3, 297.4", "[508, 508.4, 407.3, 304.4");
  change("scene.yaml", "tilt_deg: 0.4", "tilt_deg: 0.9");
  render("rotation,dispersion");
  fs::rename(folder / "unit", folder / "other");
  for (const char* step : {"rotation", "dispersion"}) {
    fs::remove_all(folder / "unit");
    fs::copy(folder / "first", folder / "unit", fs::copy_options::recursive);
    for (const char* image : {"0003.png", "0004.png"}) {
      fs::copy_file(folder / "other" / step / image, folder / "unit" / step / image,
                    fs::copy_options::overwrite_existing);
    }
    const auto result = run_program(batch());
    EXPECT_EQ(result.exit_code, 3) << step;
    EXPECT_THAT(result.errors, HasSubstr("the lamps in captures 0003.png, 0004.png do not fit lens "
                                         "and tilt of the others"))
        << step;
  }
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
  EXPECT_THAT(
      result.errors,
      AllOf(ContainsRegex("camera 0001 fails: all 8 captures of the check are off by "
                          "[0-9.]+ mm in one direction of the camera"),
            HasSubstr(
                "loose in its housing or on its mount, or the captures are of another camera")));
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

TEST_F(VlpStation, NamesUnknownOrMissingCommand) {
  for (const char* words : {"diff", "diff --operator Ann", "diff run-1 run-2"}) {
    const auto refused = run_program(std::string("vlp-station ") + words);
    EXPECT_EQ(refused.exit_code, 2) << words;
    EXPECT_THAT(refused.errors,
                testing::MatchesRegex("vlp-station: error: there is no command 'diff'; the "
                                      "commands are: run, verify, .*list, show, .*study; see "
                                      "vlp-station --help\n"))
        << words;
  }
  EXPECT_THAT(run_program("vlp-station").errors,
              HasSubstr("a command is missing; the commands are: run, verify,"));
  EXPECT_THAT(run_program("vlp-station --oprator Ann").errors, HasSubstr("unknown: --oprator"));
}

TEST_F(VlpStation, RejectsMissingFoldersRunsMetricsAndRecords) {
  EXPECT_EQ(run_program(batch()).exit_code, 2);  // no folders
  EXPECT_EQ(run_program(run("../up", "--batch " + folder.file("a", "").string())).exit_code, 2);
  EXPECT_THAT(records("show").errors, HasSubstr("no such run"));
  EXPECT_THAT(records("trend rms_um").errors, HasSubstr("rms_px"));
  EXPECT_EQ(records("trend rms_px").exit_code, 3);
  EXPECT_THAT(records("verify --batch unit").errors, HasSubstr("golden"));
  EXPECT_THAT(run_program("vlp-station list --records " + (folder / "typo.db").string()).errors,
              HasSubstr("typo.db: there are no records"));
  EXPECT_FALSE(fs::exists(folder / "typo.db"));
}

}  // namespace
}  // namespace vlp
