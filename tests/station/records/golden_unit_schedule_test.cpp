// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/golden_unit_schedule.h"

#include <gmock/gmock.h>
#include <sys/resource.h>

#include <csignal>
#include <set>

#include "rig/input_error.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

using testing::HasSubstr;
using testing::StartsWith;

/// Full disk: no file can be written.
class FullDisk {
 public:
  FullDisk() {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit none{0, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &none);
  }
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int) = std::signal(SIGXFSZ, SIG_IGN);
};

class DescribeGoldenProblem : public testing::Test {
 protected:
  DescribeGoldenProblem() {
    config.station = "a/station";
    config.spool = folder / "spool";
    config.nominal_camera.imager_px = {800, 600};
    config.nominal_camera.lens_model = LensModel::opencv8;
    config.nominal_camera.intrinsics = {520, 520, 399.5, 299.5, 0, 0, 0, 0, 0, 0, 0, 0};
    config.verification_interval = VerificationInterval{24, 2};
  }
  void note(const std::string& kind, const std::string& verdict,
            const std::string& ended_utc = get_current_utc()) const {
    RunRecord run;
    run.run = "RUN";
    run.kind = kind;
    run.verdict = verdict;
    run.ended_utc = ended_utc;
    record_golden_run(config, run);
  }
  std::string problem() const { return describe_golden_problem(config); }

  TemporaryFolder folder;
  StationConfig config{};
};

TEST_F(DescribeGoldenProblem, ReportsUnmeasuredGoldenUnitUntilItPassesOnThisStation) {
  note("unit", "PASS");
  EXPECT_THAT(problem(), StartsWith("the golden unit was not measured here yet: "));
  note("golden", "INVALID");
  EXPECT_THAT(problem(), HasSubstr("not measured"));
  note("golden", "PASS");
  EXPECT_EQ(problem(), "");
  config.station = "another";
  EXPECT_THAT(problem(), HasSubstr("not measured"));
}

TEST_F(DescribeGoldenProblem, ReportsReachedUnitLimitUntilGoldenUnitPasses) {
  note("golden", "PASS");
  note("unit", "FAIL");
  note("unit", "INVALID");
  EXPECT_EQ(problem(), "");
  note("unit", "PASS");
  EXPECT_THAT(problem(), StartsWith("2 units since the golden unit was measured (run RUN)"));
  note("golden", "INVALID");
  EXPECT_THAT(problem(), StartsWith("2 units since"));
  note("golden", "PASS");
  EXPECT_EQ(problem(), "");
}

TEST_F(DescribeGoldenProblem, ReportsPassOlderThanHourLimitOrInFuture) {
  note("golden", "PASS", "2026-01-01T00:00:00Z");
  EXPECT_THAT(problem(), HasSubstr("measured 2026-01-01T00:00:00Z (run RUN), not within 24 h"));
  note("golden", "PASS", "9999-01-01T00:00:00Z");  // with a clock that was set back later
  EXPECT_THAT(problem(), HasSubstr("not within 24 h"));
  config.verification_interval->hours.reset();
  EXPECT_EQ(problem(), "");
}

/// The unit was started before the limits expired.
TEST_F(DescribeGoldenProblem, IgnoresExpiredLimitsButNotFailureAtVerdict) {
  const auto at_verdict = [&] { return describe_golden_problem(config, GoldenCheckTime::verdict); };
  EXPECT_THAT(at_verdict(), HasSubstr("not measured"));
  note("golden", "PASS", "2026-01-01T00:00:00Z");
  EXPECT_THAT(problem(), HasSubstr("not within 24 h"));
  EXPECT_EQ(at_verdict(), "");
  note("golden", "PASS");
  note("unit", "PASS");
  note("unit", "PASS");
  EXPECT_THAT(problem(), StartsWith("2 units since"));
  EXPECT_EQ(at_verdict(), "");
  config.lamps.lamps.push_back({1, {0, 0, 2}, make_disc_lamp_shape(0.18), 1600, 0.5});
  EXPECT_THAT(at_verdict(), StartsWith("station.yaml or a file that it names was changed"));
  note("golden", "FAIL");
  note("golden", "INVALID");
  EXPECT_THAT(at_verdict(), StartsWith("the golden unit failed"));
  config.verification_interval.reset();
  EXPECT_EQ(at_verdict(), "");
}

/// A golden run with another lamp map does not qualify the station.
TEST_F(DescribeGoldenProblem, ReportsChangedLampMapUntilReverted) {
  note("golden", "PASS");
  ASSERT_EQ(problem(), "");
  config.sha256 = "of other comments";
  EXPECT_EQ(problem(), "");
  config.lamps.lamps.push_back({1, {0, 0, 2}, make_disc_lamp_shape(0.18), 1600, 0.5});
  EXPECT_EQ(problem(),
            "station.yaml or a file that it names was changed in a way that affects measurements "
            "after the golden unit was measured (run RUN): 'vlp-station verify' is due");
  note("unit", "FAIL");
  EXPECT_THAT(problem(), StartsWith("station.yaml or a file that it names was changed"));
  config.lamps.lamps.clear();
  EXPECT_EQ(problem(), "") << "as it was again";
  config.lamps.lamps.push_back({1, {0, 0, 2}, make_disc_lamp_shape(0.18), 1600, 0.5});
  note("golden", "PASS");
  EXPECT_EQ(problem(), "");
}

/// An earlier PASS is not valid after a run that could not be noted.
TEST_F(DescribeGoldenProblem, ReportsUnmeasuredGoldenUnitWhenNoteCouldNotBeWritten) {
  for (const std::string kind : {"golden", "unit"}) {
    note("golden", "PASS");
    ASSERT_EQ(problem(), "");
    {
      const FullDisk full;
      EXPECT_THROW(note(kind, "FAIL"), InputError) << kind;
    }
    EXPECT_THAT(problem(), HasSubstr("not measured here yet")) << kind;
  }
}

TEST_F(DescribeGoldenProblem, ReportsUnknownResultForDamagedNote) {
  note("golden", "PASS");
  ASSERT_EQ(problem(), "");
  const auto file = std::filesystem::directory_iterator(config.spool)->path();
  const std::string name = "spool/" + file.filename().string();
  for (const std::string text : {"", "RUN", "RUN PASS\n", "RUN PASS 2026-01-01T00:00:00Z",
                                 "RUN PASS 2026-01-01T00:00:00Z\n", "RUN PASS "}) {
    folder.file(name, text);
    EXPECT_THAT(problem(), StartsWith("the result of the golden unit is unknown")) << text;
  }
  folder.file(name, "RUN PASS " + get_current_utc() + " aa\nunit\nun");
  EXPECT_THAT(problem(), HasSubstr("is the file cut short?"));
  std::filesystem::remove(file);
  std::filesystem::create_directory(file);
  EXPECT_THAT(problem(), HasSubstr("the result of the golden unit is unknown"));
}

TEST_F(DescribeGoldenProblem, RejectsSymbolicLinkAsNote) {
  note("golden", "PASS");
  const auto file = std::filesystem::directory_iterator(config.spool)->path();
  std::filesystem::remove(file);
  const auto mine = folder.file("mine.txt", "mine\n");
  std::filesystem::create_symlink(mine, file);
  EXPECT_THAT(problem(), HasSubstr("is a symbolic link"));
  EXPECT_THROW(note("unit", "PASS"), InputError);
  std::filesystem::create_symlink(mine, file);
  EXPECT_FALSE(delete_golden_note(config, "RUN"));
  note("golden", "PASS");
  EXPECT_EQ(problem(), "");
  EXPECT_EQ(TemporaryFolder::read_content(mine), "mine\n");
}

TEST_F(DescribeGoldenProblem, ReportsUnmeasuredGoldenUnitWhenItsRunIsVoided) {
  note("golden", "PASS");
  delete_golden_note(config, "another");
  EXPECT_EQ(problem(), "");
  delete_golden_note(config, "RUN");
  EXPECT_THAT(problem(), HasSubstr("not measured here yet"));
  delete_golden_note(config, "RUN");
}

/// The station in datasets/station, with a golden unit.
class HashSettings : public testing::Test {
 protected:
  HashSettings() {
    for (const char* name : {"station.yaml", "camera_type.yaml", "board.yaml", "lamps.yaml"}) {
      fs::copy_file(fs::path(VLP_SOURCE_DIR) / "datasets/station" / name, folder / name);
    }
    fs::copy_file(fs::path(VLP_SOURCE_DIR) / "datasets/example/calibration.yaml",
                  folder / "golden.yaml");
    change("station.yaml", "captures: captures",
           "golden: {camera_id: golden, calibration: golden.yaml, gates: {check_mean_mm: 0.5}}\n"
           "captures: captures");
  }
  void change(const std::string& file, const std::string& from, const std::string& to) {
    std::string text = TemporaryFolder::read_content(folder / file);
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    folder.file(file, text.replace(at, from.size(), to));
  }
  std::string digest() const { return hash_settings(read_station_config(folder / "station.yaml")); }
  /// Returns the digest with a temporary change.
  std::string digest_with(const std::string& file, const std::string& from, const std::string& to) {
    const std::string before = TemporaryFolder::read_content(folder / file);
    change(file, from, to);
    std::string changed = digest();
    folder.file(file, before);
    return changed;
  }

  TemporaryFolder folder;
};

TEST_F(HashSettings, ChangesWithSettingsThatAffectMeasurements) {
  std::set<std::string> digests{digest()};
  const auto is_new = [&](const char* file, const char* from, const char* to) {
    EXPECT_TRUE(digests.insert(digest_with(file, from, to)).second) << from << " -> " << to;
  };
  is_new("lamps.yaml", "[0, 0.28, 1.6]", "[0, 0.281, 1.6]");
  is_new("lamps.yaml", "frequency_hz: 1600", "frequency_hz: 1601");
  is_new("lamps.yaml", "diameter_m: 0.18", "diameter_m: 0.19");
  is_new("lamps.yaml", "duty: 0.5", "duty: 0.4");
  is_new("lamps.yaml", "lamps:", "sd_m: 0.001\nlamps:");
  is_new("board.yaml", "tag_size_m: 0.02", "tag_size_m: 0.0201");
  is_new("board.yaml", "first_id: 0", "first_id: 30");
  is_new("board.yaml", "tag_size_m:", "print_sd: 0.001\ntag_size_m:");
  is_new("camera_type.yaml", "row_time_s: 3.0e-05", "row_time_s: 3.1e-05");
  is_new("camera_type.yaml", "-0.25", "-0.24");
  is_new("station.yaml", "board_views: 36", "board_views: 35");
  is_new("station.yaml", "check_captures: 36", "check_captures: 30");
  is_new("station.yaml", "rejection: {blur_fraction: 0.003", "rejection: {blur_fraction: 0.004");
  is_new("station.yaml", "check_worst_mm: 3", "check_worst_mm: 4");
  is_new("station.yaml", "gates: {check_mean_mm: 0.5}", "gates: {check_mean_mm: 0.6}");
  is_new("station.yaml", "camera_id: golden", "camera_id: other");
  is_new("station.yaml", "captures: captures",
         "captures: captures\ndispersion_position_m: [0, 0.001]");
  is_new("station.yaml", "captures: captures",
         "captures: captures\n"
         "guard_bands: {k: 2, standard_uncertainties: {check_mean_mm: 0.02}}");
  is_new("golden.yaml", "403, 296", "403, 297");
}

TEST_F(HashSettings, IsUnchangedByCommentsFileNamesAndOtherSettings) {
  const std::string before = digest();
  const std::string config_sha256 = read_station_config(folder / "station.yaml").sha256;
  const auto is_same = [&](const char* file, const std::string& from, const std::string& to) {
    EXPECT_EQ(digest_with(file, from, to), before) << from << " -> " << to;
  };
  is_same("station.yaml", "station: station-1", "# as of today\nstation: station-1");
  is_same("station.yaml", "board_coverage: 0.7", "board_coverage: 0.70");
  is_same("station.yaml", "records: records.db",
          "records: others.db\nspool: elsewhere\nserial_pattern: '[0-9]{4}'\n"
          "hook: {command: [./label.sh]}\nretention: {images_days: 90}\n"
          "verify_due: {hours: 24}");
  is_same("station.yaml", "results: results", "results: other");
  is_same("lamps.yaml", "[0, 0.28, 1.6]", "[0.0, 0.280, 1.6e0]");
  is_same("lamps.yaml", "lamps:", "# surveyed again\nlamps:");
  const std::string second =
      "  - {id: 2, position_m: [0, -0.32, 1.6], diameter_m: 0.18, frequency_hz: 2000, duty: 0.5}\n";
  const std::string third =
      "  - {id: 3, position_m: [0.6, -0.3, 1.6], diameter_m: 0.18, frequency_hz: 2500, duty: "
      "0.5}\n";
  is_same("lamps.yaml", second + third, third + second);
  is_same("board.yaml", "tag_size_m: 0.02", "tag_size_m: 2.0e-2");
  is_same("camera_type.yaml", "3.0e-05", "0.00003");
  change("station.yaml", "captures: captures", "captures: captures  # a comment");
  EXPECT_EQ(digest(), before);
  EXPECT_NE(read_station_config(folder / "station.yaml").sha256, config_sha256)
      << "records have the files as they are";
  // Another name of a file with the same content.
  fs::rename(folder / "lamps.yaml", folder / "ceiling.yaml");
  change("station.yaml", "lamps: lamps.yaml", "lamps: ceiling.yaml");
  EXPECT_EQ(digest(), before);
}

}  // namespace
}  // namespace vlp
