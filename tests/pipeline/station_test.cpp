// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-station: units to their verdicts, from full folders; the records.
#include <nlohmann/json.hpp>
#include <regex>

#include "small_station.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

class Station : public SmallStation {};

TEST_F(Station, PassesAGoodUnitAndKeepsItsRecord) {
  render();
  const auto result = run_program(batch());
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.output, AllOf(HasSubstr("PASS   camera 0001"), Not(HasSubstr("NOT MET"))));
  const std::string calibration = this->result("0001", "calibration.yaml");
  EXPECT_THAT(calibration, AllOf(HasSubstr("rotation_center"), HasSubstr("dispersion")));
  EXPECT_THAT(this->result("0001", "report.html"),
              AllOf(HasSubstr("<strong>PASS"), HasSubstr("check_mean_mm"), HasSubstr("LENSMODEL"),
                    // the captions of the pictures of lens, rotation centre and dispersion
                    HasSubstr("Coverage: the corners"), HasSubstr("Left: the lamps"),
                    HasSubstr("Fixes at a known station minus")));
  // A unit calibrated again keeps its history, and gives the same calibration.
  EXPECT_EQ(run_program(batch("0002") + " --threads 1").exit_code, 0);
  EXPECT_EQ(comparable_calibration("0002"), comparable_calibration("0001"));

  EXPECT_THAT(records("list").output, HasSubstr("2 runs, 2 passed"));
  EXPECT_THAT(records("list --camera-id 0002").output, HasSubstr("1 runs, 1 passed"));
  EXPECT_THAT(
      records("show --camera-id 0001").output,
      AllOf(ContainsRegex("check_mean_mm +[0-9.e-]+ +<= 1 mm +met"),
            ContainsRegex("nominal_px +[0-9.e-]+ px"), HasSubstr("images     48, 48 used")));
  const auto exported = folder / "runs.json", picture = folder / "trend.svg";
  EXPECT_EQ(records("export -o " + exported.string()).exit_code, 0);
  EXPECT_THAT(TemporaryFolder::content_of(exported), HasSubstr("vlp-calibration/1"));
  EXPECT_THAT(records("trend rms_px -o " + picture.string()).output, HasSubstr("limits"));
  EXPECT_THAT(TemporaryFolder::content_of(picture), HasSubstr("<svg"));

  // The golden unit on the station as it was, and after a lamp has moved.
  folder.file("station/golden.yaml", calibration);
  change("station.yaml", "# The images of a unit",
         "golden: {camera_id: \"0001\", calibration: golden.yaml, gates: {check_mean_mm: 0.5, "
         "check_lamps: 0.95, world_mm: 1, center_px: 1}}\n# The images of a unit");
  const std::string verify = "verify --batch " + (folder / "unit").string();
  const auto steady = records(verify);
  EXPECT_EQ(steady.exit_code, 0) << steady.output << steady.errors;
  change("lamps.yaml", "[0, 0.28, 1.6]", "[0.06, 0.28, 1.6]");
  const auto moved = records(verify);
  EXPECT_EQ(moved.exit_code, 1);
  EXPECT_THAT(moved.errors, HasSubstr("lamp 5 is loose"));
  EXPECT_THAT(records("list --kind golden").output, HasSubstr("2 runs, 1 passed"));

  // From where its images arrive, like any unit's; they are put away.
  fs::create_directories(captures("0001"));
  fs::copy(folder / "unit/check", captures("0001") / "check");
  EXPECT_EQ(records("verify").exit_code, 1);
  EXPECT_FALSE(fs::exists(captures("0001")));
  EXPECT_THAT(records("list --kind golden").output, HasSubstr("3 runs, 1 passed"));
  EXPECT_THAT(records("verify").errors, HasSubstr("check"));
}

/// The station feeds images one by one to the steps that vlp-calibrate takes a folder through.
TEST_F(Station, GivesWhatVlpCalibrateGives) {
  render();
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
            comparable(TemporaryFolder::content_of(folder / "results/calibration.yaml")));

  using Json = nlohmann::json;
  ASSERT_EQ(records("export -o " + (folder / "runs.json").string()).exit_code, 0);
  const Json figures =
      Json::parse(TemporaryFolder::content_of(folder / "runs.json")).at(0).at("figures");
  const auto of_station = [&](const std::string& name) {
    return figures.at(name).at("value").get<double>();
  };
  const auto of_session = [&](const char* file) {
    return Json::parse(TemporaryFolder::content_of(folder / "results" / file));
  };
  const Json session = of_session("session.json");
  int same = 0;
  for (const Json& metric : session.at("metrics")) {
    const auto name = metric.at("name").get<std::string>();
    if (!figures.contains(name)) continue;
    EXPECT_EQ(of_station(name), metric.at("value").get<double>()) << name;
    ++same;
  }
  EXPECT_EQ(same, 12);  // of lens, rotation and dispersion
  // The errors have the station's names, and there their fixes go through a table of nanometres.
  const auto horizontal = of_session("evaluation.json").at("horizontal");
  EXPECT_NEAR(of_station("check_mean_mm"), horizontal.at("mean_mm").get<double>(), 1e-6);
}

TEST_F(Station, NamesWhatIsWrongWithLampsAndBoard) {
  render();
  const auto lamps = TemporaryFolder::content_of(folder / "station/lamps.yaml");
  change("lamps.yaml", "[0, 0.28, 1.6]", "[0.05, 0.27, 1.6]");
  const auto loose = run_program(batch("loose"));
  EXPECT_EQ(loose.exit_code, 1);
  EXPECT_THAT(loose.errors, HasSubstr("fails: lamp 5 is loose"));
  EXPECT_EQ(result("loose", "calibration.yaml"), "");
  EXPECT_NE(result("loose", "failed-calibration.yaml"), "");
  EXPECT_THAT(result("loose", "report.html"),
              AllOf(HasSubstr("<strong>FAIL"), HasSubstr("lamp 5 is loose")));

  folder.file("station/lamps.yaml", lamps);
  change("lamps.yaml", "frequency_hz: 2000", "frequency_hz: 9999");
  change("lamps.yaml", "frequency_hz: 3800", "frequency_hz: 2000");
  change("lamps.yaml", "frequency_hz: 9999", "frequency_hz: 3800");
  const auto swapped = run_program(batch("swapped"));
  EXPECT_EQ(swapped.exit_code, 1);
  EXPECT_THAT(swapped.errors, HasSubstr("fails: lamps 2 and 5 look swapped"));

  folder.file("station/lamps.yaml", lamps);
  change("board.yaml", "first_id: 0", "first_id: 100");
  const auto board = run_program(batch("board"));
  EXPECT_EQ(board.exit_code, 1);
  EXPECT_THAT(board.errors, HasSubstr("fails: wrong board"));
  EXPECT_THAT(records("list").output, HasSubstr("3 runs, 0 passed"));
}

struct LensFault {
  const char* name;
  std::string from, to, cause;

  friend void PrintTo(const LensFault& fault, std::ostream* out) { *out << fault.name; }
};
class FaultyLens : public SmallStation, public testing::WithParamInterface<LensFault> {};

TEST_P(FaultyLens, FailsWithItsCause) {
  change("scene.yaml", GetParam().from, GetParam().to);
  change("scene.yaml", "count: 16", "count: 12");
  change("station.yaml", "board_views: 16", "board_views: 12");
  render("boards");
  const auto result = run_program(batch());
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.output, HasSubstr("FAIL   camera"));
  // The cause is the first that is named, before what follows from it.
  EXPECT_THAT(result.errors, HasSubstr("camera 0001 fails: " + GetParam().cause));
  EXPECT_THAT(records("show").output, HasSubstr("Cause    " + GetParam().cause));
}

INSTANTIATE_TEST_SUITE_P(
    Station, FaultyLens,
    testing::Values(LensFault{"decentred", "402.3, 297.4", "418.3, 285.4", "the lens is decentred"},
                    LensFault{"blurred", "blur_px: 0.7", "blur_px: 2.5", "the lens is blurred"},
                    LensFault{"wrong", "[520, 520.6", "[480, 480.5", "wrong lens"},
                    LensFault{"dark",
                              "white_e_per_s: 2.4e+6\n  black_e_per_s: 1.5e+5\n"
                              "  surround_e_per_s: 6.0e+5",
                              "white_e_per_s: 2.4e+4\n  black_e_per_s: 1.5e+3\n"
                              "  surround_e_per_s: 6.0e+3",
                              "boards (0/12): 12 of 12 images refused: 12 too dark"}),
    [](const auto& instance) { return instance.param.name; });

TEST_F(Station, RefusesWhatItCannotUse) {
  EXPECT_EQ(run_program(batch()).exit_code, 2);  // no folders
  EXPECT_EQ(run_program(run("../up", "--batch " + folder.file("a", "").string())).exit_code, 2);
  EXPECT_THAT(records("show").errors, HasSubstr("no such run"));
  EXPECT_THAT(records("trend rms_mm").errors, HasSubstr("rms_px"));
  EXPECT_EQ(records("trend rms_px").exit_code, 3);
  EXPECT_THAT(records("verify --batch unit").errors, HasSubstr("golden"));
  EXPECT_THAT(run_program("vlp-station list --records " + (folder / "typo.db").string()).errors,
              HasSubstr("typo.db: there are no records"));
  EXPECT_FALSE(fs::exists(folder / "typo.db"));
}

}  // namespace
}  // namespace vlp
