// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/station_config.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <regex>

#include "support/datasets.h"
#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;
using testing::SizeIs;

class ReadStationConfig : public testing::Test {
 protected:
  ReadStationConfig() {
    for (const char* name : {"station.yaml", "camera_type.yaml", "board.yaml", "lamps.yaml"}) {
      folder.file(name, TemporaryFolder::read_content(std::filesystem::path(VLP_SOURCE_DIR) /
                                                      "datasets/station" / name));
    }
  }
  void change(const std::string& name, const std::string& from, const std::string& to) const {
    std::string text = TemporaryFolder::read_content(folder / name);
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    folder.file(name, text.replace(at, from.size(), to));
  }
  std::string rejection_message() const {
    return vlp::rejection_message([&] { read_station_config(folder / "station.yaml"); });
  }
  TemporaryFolder folder;
};

TEST_F(ReadStationConfig, ReturnsContentOfReferencedFiles) {
  const StationConfig config = read_station_config(folder / "station.yaml");
  EXPECT_EQ(config.station, "station-1");
  EXPECT_EQ(config.nominal_camera.imager_px[0], 800);
  EXPECT_THAT(config.lamps.lamps, SizeIs(6));
  EXPECT_EQ(config.board.cols, 6);
  EXPECT_EQ(config.completion.dispersion_captures, 40);
  EXPECT_EQ(config.records, (folder / "records.db").string());
  EXPECT_FALSE(config.golden_unit);
}

/// The keys commented out with '#' are valid.
TEST_F(ReadStationConfig, AcceptsOptionalKeysOfExampleWhenUncommented) {
  folder.file("golden.yaml", TemporaryFolder::read_content(kExample + "calibration.yaml"));
  folder.file(
      "station.yaml",
      std::regex_replace(
          TemporaryFolder::read_content(folder / "station.yaml"),
          std::regex(
              "\n# (golden:|verify_due:|serial_pattern:|void_operators:|hook:|retention:| {9})"),
          "\n$1"));
  const StationConfig config = read_station_config(folder / "station.yaml");
  ASSERT_TRUE(config.golden_unit);
  EXPECT_THAT(config.golden_unit->gates, SizeIs(7));
  ASSERT_TRUE(config.verification_interval);
  EXPECT_EQ(config.verification_interval->units, 200);
  EXPECT_EQ(describe_serial_problem(config, "0001"), "");
  EXPECT_NE(describe_serial_problem(config, "x1"), "");
  EXPECT_EQ(config.void_operators, (std::vector<std::string>{"Ann", "Bea"}));
  ASSERT_TRUE(config.hook);
  EXPECT_THAT(config.hook->command, SizeIs(3));
  EXPECT_EQ(config.retention.images_days, 90);
}

TEST_F(ReadStationConfig, ReadsGuardBandsAndHook) {
  change("station.yaml", "\nrecords: records.db",
         "\nguard_bands: {standard_uncertainties: {check_mean_mm: 0.02}}"
         "\nrecords: records.db\nhook: {command: [./label, --to, it's]}");
  const StationConfig config = read_station_config(folder / "station.yaml");
  for (const Gate& gate : config.gates) {
    ASSERT_EQ(gate.guard_band.has_value(), gate.metric == "check_mean_mm") << gate.metric;
    if (!gate.guard_band) continue;
    EXPECT_EQ(gate.guard_band->standard_uncertainty, 0.02);
    EXPECT_EQ(gate.guard_band->k, 1.645);
  }
  ASSERT_TRUE(config.hook);
  EXPECT_THAT(config.hook->command,
              testing::ElementsAre((folder / "./label").string(), "--to", "it's"));
  EXPECT_EQ(config.hook->time_limit_s, 30);
  change("station.yaml", "[./label, --to, it's]", "[label], time_limit_s: 0.5");
  const auto hook = read_station_config(folder / "station.yaml").hook;
  ASSERT_TRUE(hook);
  EXPECT_THAT(hook->command, testing::ElementsAre("label"));
  EXPECT_EQ(hook->time_limit_s, 0.5);
}

struct Refusal {
  const char *file, *from, *to, *key;
};

constexpr const char* kRecords = "records: records.db";
constexpr const char* kGolden =
    "golden: {camera_id: g, calibration: golden.yaml, gates: {tilt_deg: 1}}\n";

/// Each change is rejected with file, line and key.
TEST_F(ReadStationConfig, RejectsInvalidValues) {
  folder.file("golden.yaml", TemporaryFolder::read_content(kExample + "calibration.yaml"));
  change("station.yaml", kRecords,
         kGolden + std::string("guard_bands: {k: 2, standard_uncertainties: {check_mean_mm: 0.02}}"
                               "\nhook: {command: [label], time_limit_s: 1}\n"
                               "retention: {images_days: 90}\nverify_due: {hours: 24, units: 200}\n"
                               "serial_pattern: 'SN'\nrecords: records.db"));
  const StationConfig config = read_station_config(folder / "station.yaml");
  ASSERT_TRUE(config.golden_unit);
  EXPECT_EQ(config.verification_interval->hours, 24);
  EXPECT_EQ(config.verification_interval->units, 200);
  EXPECT_EQ(config.retention.images_days, 90);
  EXPECT_FALSE(config.retention.results_days);
  for (const auto& [file, from, to, key] : std::vector<Refusal>{
           {"station.yaml", "rms_px: 0.014", "rms_mm: 0.014", "gates"},
           {"station.yaml", "coverage: 0.7\n", "coverage: 7\n", "gates.coverage"},
           {"station.yaml", "check_fix_fraction: 0.9", "check_fix_fraction: 1.9",
            "gates.check_fix_fraction"},
           {"station.yaml", "rms_px: 0.014", "rms_px: -0.014", "gates.rms_px"},
           {"station.yaml", "board_coverage: 0.7", "board_coverage: 70",
            "completion.board_coverage"},
           {"station.yaml", "board_views: 36", "board_views: 0", "completion.board_views"},
           {"station.yaml", "turn_captures: 12", "turn_captures: 10001",
            "completion.turn_captures"},
           {"station.yaml", "turn_arc_deg: 300", "turn_arc_deg: 361", "completion.turn_arc_deg"},
           {"station.yaml", "check_captures: 36", "check_captures: 3.6",
            "completion.check_captures"},
           {"station.yaml", "{blur_fraction: 0.003", "{blur_fraction: 2",
            "rejection.blur_fraction"},
           {"station.yaml", "dark_fraction: 0.1", "dark_fraction: 1.1", "rejection.dark_fraction"},
           {"station.yaml", "same_pose_fraction: 0.01", "same_pose_fraction: -0.01",
            "rejection.same_pose_fraction"},
           {"station.yaml", "max_consecutive_rejections: 12", "max_consecutive_rejections: 0",
            "rejection.max_consecutive_rejections"},
           {"station.yaml", "{check_mean_mm: 0.02}", "{check_offset_mm: 0.02}",
            "guard_bands.standard_uncertainties"},
           {"station.yaml", "{check_mean_mm: 0.02}", "{}", "guard_bands.standard_uncertainties"},
           {"station.yaml", "{check_mean_mm: 0.02}", "{check_mean_mm: 0}",
            "guard_bands.standard_uncertainties.check_mean_mm"},
           // No value is left within the gate.
           {"station.yaml", "{check_mean_mm: 0.02}", "{check_mean_mm: 0.52}",
            "guard_bands.standard_uncertainties.check_mean_mm"},
           {"station.yaml", "{check_mean_mm: 0.02}", "{check_lamp_inlier_fraction: 0.04}",
            "guard_bands.standard_uncertainties.check_lamp_inlier_fraction"},
           {"station.yaml", "time_limit_s: 1", "time_limit_s: 0", "hook.time_limit_s"},
           {"station.yaml", "[label]", "[]", "hook.command"},
           {"station.yaml", "'SN'", "'SN-[0-9'", "serial_pattern"},
           {"station.yaml", "{hours: 24, units: 200}", "{}", "verify_due"},
           {"station.yaml", "hours: 24", "hours: 0", "verify_due"},
           {"station.yaml", "images_days: 90", "images_days: 0", "retention.images_days"},
           {"station.yaml", kRecords, "records: mysql://server/records", "records"}}) {
    const std::string before = TemporaryFolder::read_content(folder / file);
    change(file, from, to);
    const std::string above = before.substr(0, before.find(from));
    const auto line = 1 + std::count(above.begin(), above.end(), '\n');
    EXPECT_THAT(rejection_message(),
                HasSubstr(file + (":" + std::to_string(line)) + ": " + key + ": "))
        << to;
    folder.file(file, before);
  }
  // Keys of the station that need something elsewhere.
  for (const auto& [file, from, to, key] :
       std::vector<Refusal>{{"station.yaml", kGolden, "", "verify_due"},
                            {"camera_type.yaml", "  row_time_s: 3.0e-05\n", "", "camera_type"},
                            {"golden.yaml", "  row_time_s: 0.00003\n", "", "golden.calibration"}}) {
    const std::string before = TemporaryFolder::read_content(folder / file);
    change(file, from, to);
    EXPECT_THAT(rejection_message(),
                testing::ContainsRegex("station.yaml:[0-9]+: " + std::string(key) + ": "));
    folder.file(file, before);
  }
}

TEST_F(ReadStationConfig, SerialPatternRestrictsAcceptedSerials) {
  StationConfig config = read_station_config(folder / "station.yaml");
  EXPECT_EQ(describe_serial_problem(config, "anything"), "");
  EXPECT_THAT(describe_serial_problem(config, "a/b"), HasSubstr("a camera's id has letters"));
  change("station.yaml", "records: records.db",
         "records: records.db\nserial_pattern: 'SN-[0-9]{4}'");
  config = read_station_config(folder / "station.yaml");
  EXPECT_EQ(describe_serial_problem(config, "SN-0123"), "");
  EXPECT_EQ(describe_serial_problem(config, "SN-01234"),
            "'SN-01234' is not of the form SN-[0-9]{4}");
  EXPECT_THAT(describe_serial_problem(config, ""), HasSubstr("a camera's id has letters"));
}

/// Nested repetitions can match in exponentially many combinations.
TEST(DescribeSerialProblem, ReportsPatternWhoseComparisonIsTooSlow) {
  StationConfig config{};
  config.serial_pattern = "(a+)+b";
  EXPECT_EQ(describe_serial_problem(config, "aaab"), "");
  EXPECT_THAT(describe_serial_problem(config, std::string(60, 'a')),
              HasSubstr("serial_pattern: the comparison is too slow for"));
  config.serial_pattern = "[A-Za-z0-9_.-]{1,64}";
  EXPECT_EQ(describe_serial_problem(config, std::string(64, 'a')), "");
}

TEST_F(ReadStationConfig, DigestChangesWithReferencedFile) {
  const std::string before = read_station_config(folder / "station.yaml").sha256;
  EXPECT_EQ(read_station_config(folder / "station.yaml").sha256, before);
  change("lamps.yaml", "-0.32", "-0.33");
  EXPECT_NE(read_station_config(folder / "station.yaml").sha256, before);
}

}  // namespace
}  // namespace vlp
