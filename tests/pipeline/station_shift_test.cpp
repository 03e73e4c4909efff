// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-station: a shift, the golden unit that is due, hooks.
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>

#include "small_station.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

class VlpStationShift : public SmallStation {};

/// Unit after unit without a terminal: a line each. What becomes of one ends nothing.
TEST_F(VlpStationShift, MeasuresUnitsFromStdinSequentiallyDespiteFaults) {
  render();
  change("station.yaml", "records: records.db",
         "records: records.db\nserial_pattern: '[0-9]{4}'\nhook: {command: [\"false\"]}");
  prepare("0001");
  drop_all("0001");
  const auto shift = run_program(
      "printf 'Ann\\n\\nx1\\n0001\\n0002\\nq\\n0003\\n' | vlp-station run "
      "--station " +
      station.string() + " --idle-s 0.5");
  EXPECT_EQ(shift.exit_code, 0) << shift.errors;
  EXPECT_THAT(shift.output,
              AllOf(HasSubstr("PASS   camera 0001   station-1\nHook     failed: exit code 1"),
                    HasSubstr("INVALID   camera 0002"), Not(HasSubstr("camera 0003")),
                    testing::EndsWith("2 units: 1 passed, 0 failed, 1 invalid\n")));
  EXPECT_THAT(shift.errors, HasSubstr("error: 'x1' is not of the form [0-9]{4}\n"));
  EXPECT_THAT(records("show").output,
              AllOf(HasSubstr("operator   Ann\n"), Not(HasSubstr("\nshift  "))));
  const auto said = run_program(run("0001", "--operator Bob --shift night -q --idle-s 0.1"));
  EXPECT_EQ(said.exit_code, 3);
  EXPECT_THAT(records("show").output,
              AllOf(HasSubstr("operator   Bob\n"), HasSubstr("shift      night\n")));
  EXPECT_THAT(run_program(run("x1", "")).errors, HasSubstr("--camera-id: 'x1' is not of the form"));
  EXPECT_EQ(run_program("vlp-station run --station " + station.string()).output,
            "0 units: 0 passed, 0 failed, 0 invalid\n");
}

/// The golden unit's serial is a `verify` of what has arrived, and no unit of the shift.
TEST_F(VlpStationShift, ScannedGoldenUnitIsVerifiedAndNotCountedAsUnit) {
  render("check");
  fs::copy_file(folder / "unit/true_calibration.yaml", folder / "station/golden.yaml");
  change("station.yaml", "# The images of a unit",
         "golden: {camera_id: golden, calibration: golden.yaml, gates: {check_mean_mm: 0.5}}\n"
         "verify_due: {hours: 24}\nserial_pattern: '[0-9]{4}'\n# The images of a unit");
  fs::create_directory(folder / "station/captures");
  fs::create_directory(captures("golden"));
  fs::copy(folder / "unit/check", captures("golden") / "check");
  const auto shift = run_program(
      "printf '0001\\ngolden\\n0002\\ngolden\\nq\\n' | vlp-station run --operator Ann --shift late "
      "--station " +
      station.string() + " --idle-s 0.1");
  EXPECT_EQ(shift.exit_code, 0) << shift.errors;
  const auto at = [&](const std::string& text) { return shift.output.find(text); };
  EXPECT_LT(at("Cause    the golden unit was not measured here yet"), at("PASS   camera golden"));
  EXPECT_LT(at("PASS   camera golden"), at("INVALID   camera 0002"));
  EXPECT_EQ(at("Cause    the golden unit"), shift.output.rfind("Cause    the golden unit"))
      << "it is due no more";
  EXPECT_THAT(shift.output, testing::EndsWith("2 units: 0 passed, 0 failed, 2 invalid\n"));
  // Its images are put away: the next time there are none.
  EXPECT_FALSE(fs::exists(captures("golden")));
  EXPECT_THAT(shift.errors, AllOf(HasSubstr("captures/golden/check"), HasSubstr("no unit passes")));
  EXPECT_THAT(records("show --kind golden").output,
              AllOf(HasSubstr("operator   Ann\n"), HasSubstr("shift      late\n")));
  EXPECT_THAT(records("verify --batch " + (folder / "unit").string()).errors,
              ContainsRegex("is not judged: image check/[^ ]+ was used in golden run [0-9TZa-f-]+: "
                            "measure it again"));
}

/// From a tenth of the units to the last of them, of which VLP_STATION_UNITS may say another
/// number.
TEST_F(VlpStationShift, MemoryGrowsLessThan10PercentOverUnits) {
  const char* said = std::getenv("VLP_STATION_UNITS");
  const std::string units = said == nullptr ? "20" : said;
  const auto shift = run_program(
      "cd " + (folder / "station").string() +
      "; mkfifo in; vlp-station run --station station.yaml --operator a --shift b --idle-s 0.01 "
      "<in >out 2>&1 & cd " +
      (folder / "station").string() + "; exec 3>in; i=0; while [ $i -lt " + units +
      " ]; do i=$((i + 1)); echo u$i >&3; until ls captures 2>&- | grep -q \"^u$i[.]\"; do sleep "
      "0.02; done; if [ $((10 * i)) = " +
      units + " ] || [ $i = " + units +
      " ]; then sleep 0.2; awk '/RssAnon/ {print $2}' /proc/$!/status; fi; done; exec 3>&-; wait "
      "$!");
  ASSERT_EQ(shift.exit_code, 0) << shift.errors;
  std::istringstream figures(shift.output);
  double early_kb = 0, late_kb = 0;
  figures >> early_kb >> late_kb;
  EXPECT_GT(early_kb, 1000);
  EXPECT_LT(late_kb, 1.1 * early_kb);
  EXPECT_THAT(TemporaryFolder::read_content(folder / "station/out"),
              HasSubstr(units + " units: 0 passed, 0 failed, " + units + " invalid"));
}

/// A hook gets each run; that it fails is recorded and said, and it can be run again.
TEST_F(VlpStationShift, ReportsFailedHookAndHookCommandRerunsIt) {
  render_four_boards();
  change("station.yaml", "records: records.db",
         "records: records.db\nhook: {command: [sh, hook.sh], time_limit_s: 20}");
  folder.file("station/hook.sh", "cat >seen.json; echo no labels; exit 3\n");
  const auto first = run_program(batch());
  EXPECT_EQ(first.exit_code, 3) << first.errors;
  EXPECT_THAT(first.output,
              HasSubstr("INVALID   camera 0001   station-1\nHook     failed: exit code 3: no "
                        "labels; 'vlp-station hook' runs it again\n"));
  const auto seen =
      nlohmann::json::parse(TemporaryFolder::read_content(folder / "station/seen.json"));
  EXPECT_EQ(seen["camera"], "0001");
  EXPECT_EQ(seen["verdict"], "INVALID");
  EXPECT_EQ(seen["images"].size(), 4U);
  EXPECT_THAT(records("list").output,
              HasSubstr("1 of them with a hook that failed or did not finish"));
  EXPECT_THAT(
      records("show").output,
      AllOf(ContainsRegex("hook wanted 20[0-9TZ:-]+ [^ ]+@[^ ]*: sh hook.sh\n"),
            ContainsRegex("hook failed 20[0-9TZ:-]+ [^ ]+@[^ ]*: exit code 3: no labels\n")));
  const auto again = records("hook");
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.errors, HasSubstr("the hook failed for 1 of 1 runs"));

  folder.file("station/hook.sh", "cat >seen.json; echo label 7\n");
  const auto mended = records("hook");
  EXPECT_EQ(mended.exit_code, 0) << mended.errors;
  EXPECT_THAT(mended.output, HasSubstr(" 0001 INVALID: done\n"));
  EXPECT_THAT(records("list").output, Not(HasSubstr("hook")));
  EXPECT_THAT(records("show").output,
              ContainsRegex("hook done +20[0-9TZ:-]+ [^ ]+@[^ ]*: label 7\n"));
  EXPECT_EQ(records("hook").output, "");
  EXPECT_THAT(spooled_files(), testing::ElementsAre("outbox.db"));
}

}  // namespace
}  // namespace vlp
