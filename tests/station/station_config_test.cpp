// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/station_config.h"

#include <gmock/gmock.h>

#include <regex>

#include "support/datasets.h"
#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::AllOf;
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
  EXPECT_EQ(describe_serial_number_problem(config, "0001"), "");
  EXPECT_NE(describe_serial_number_problem(config, "x1"), "");
  EXPECT_EQ(config.void_operators, (std::vector<std::string>{"Ann", "Bea"}));
  ASSERT_TRUE(config.hook);
  EXPECT_THAT(config.hook->command, SizeIs(3));
  EXPECT_EQ(config.retention.images_days, 90);
}

TEST_F(ReadStationConfig, RejectsUnknownGateWithLine) {
  change("station.yaml", "  rms_px: 0.014", "  rms_mm: 0.014");
  EXPECT_THAT(rejection_message(), AllOf(HasSubstr("station.yaml:"), HasSubstr("rms_mm")));
}

TEST_F(ReadStationConfig, RejectsImplausibleValues) {
  struct Implausible {
    const char *message, *from, *to;
  };
  for (const auto& [message, from, to] :
       {Implausible{"gates.coverage: should be a fraction from 0 to 1, not 7", "\n  coverage: 0.7",
                    "\n  coverage: 7"},
        {"gates.check_fix_fraction", "check_fix_fraction: 0.9", "check_fix_fraction: 1.9"},
        {"gates.rms_px", "rms_px: 0.014", "rms_px: -0.014"},
        {"completion.board_coverage", "board_coverage: 0.7", "board_coverage: 70"},
        {"completion.board_views", "board_views: 36", "board_views: 0"},
        {"completion.turn_captures", "turn_captures: 12", "turn_captures: 10001"},
        {"completion.turn_arc_deg", "turn_arc_deg: 300", "turn_arc_deg: 361"},
        {"completion.check_captures", "check_captures: 36", "check_captures: 3.6"},
        {"rejection.blur_fraction", "{blur_fraction: 0.003", "{blur_fraction: 2"},
        {"rejection.dark_fraction", "dark_fraction: 0.1", "dark_fraction: 1.1"},
        {"rejection.same_pose_fraction", "same_pose_fraction: 0.01", "same_pose_fraction: -0.01"},
        {"rejection.max_consecutive_rejections", "max_consecutive_rejections: 12",
         "max_consecutive_rejections: 0"}}) {
    const std::string before = TemporaryFolder::read_content(folder / "station.yaml");
    change("station.yaml", from, to);
    EXPECT_THAT(rejection_message(), HasSubstr(message)) << to;
    folder.file("station.yaml", before);
  }
  EXPECT_NO_THROW(read_station_config(folder / "station.yaml"));

  change("station.yaml", "\n  coverage: 0.7", "\n  coverage: 7");
  EXPECT_THAT(rejection_message(),
              HasSubstr("gates.coverage: should be a fraction from 0 to 1, not 7"));
  change("station.yaml", "board_coverage: 0.7", "board_coverage: 70");
  EXPECT_THAT(rejection_message(), HasSubstr("completion.board_coverage"));
}

TEST_F(ReadStationConfig, RejectsCameraTypeWithoutRowTime) {
  change("camera_type.yaml", "  row_time_s: 3.0e-05\n", "");
  EXPECT_THAT(rejection_message(), AllOf(HasSubstr("camera_type"), HasSubstr("row_time_s")));
}

TEST_F(ReadStationConfig, ReadsGuardBandsAndRejectsUnsuitableOnes) {
  change("station.yaml", "\nrecords: records.db",
         "\nguard_bands: {k: 1.645, standard_uncertainties: {check_mean_mm: 0.02}}"
         "\nrecords: records.db");
  for (const Gate& gate : read_station_config(folder / "station.yaml").gates) {
    ASSERT_EQ(gate.guard_band.has_value(), gate.metric == "check_mean_mm") << gate.metric;
    if (!gate.guard_band) continue;
    EXPECT_EQ(gate.guard_band->standard_uncertainty, 0.02);
    EXPECT_EQ(gate.guard_band->k, 1.645);
  }
  const auto refused = [&](const std::string& from, const std::string& to) {
    const std::string before = TemporaryFolder::read_content(folder / "station.yaml");
    change("station.yaml", from, to);
    const std::string why = rejection_message();
    folder.file("station.yaml", before);
    return why;
  };
  EXPECT_THAT(refused("k: 1.645, standard", "standard"), HasSubstr("guard_bands: key 'k'"));
  EXPECT_THAT(refused("{check_mean_mm: 0.02}", "{check_offset_mm: 0.02}"),
              HasSubstr("check_offset_mm"));
  EXPECT_THAT(refused("{check_mean_mm: 0.02}", "{}"), HasSubstr("names no gate"));
  EXPECT_THAT(refused("check_mean_mm: 0.02", "check_mean_mm: 0"), HasSubstr("above 0"));
  EXPECT_THAT(refused("check_mean_mm: 0.02", "check_mean_mm: 0.62"),
              AllOf(HasSubstr("standard_uncertainties.check_mean_mm"),
                    HasSubstr("leaves no value within the gate")));
  EXPECT_THAT(refused("check_mean_mm: 0.02", "check_lamp_inlier_fraction: 0.04"),
              HasSubstr("leaves no value within the gate"));
}

TEST_F(ReadStationConfig, ReadsHookCommandAndTimeLimit) {
  EXPECT_FALSE(read_station_config(folder / "station.yaml").hook);
  change("station.yaml", "records: records.db",
         "records: records.db\nhook: {command: [./label, --to, it's]}");
  const auto hook = read_station_config(folder / "station.yaml").hook;
  ASSERT_TRUE(hook);
  EXPECT_THAT(hook->command, testing::ElementsAre((folder / "./label").string(), "--to", "it's"));
  EXPECT_EQ(hook->time_limit_s, 30);
  change("station.yaml", "[./label, --to, it's]", "[label], time_limit_s: 0.5");
  EXPECT_THAT(read_station_config(folder / "station.yaml").hook->command,
              testing::ElementsAre("label"));
  EXPECT_EQ(read_station_config(folder / "station.yaml").hook->time_limit_s, 0.5);
  change("station.yaml", "time_limit_s: 0.5", "time_limit_s: 0");
  EXPECT_THAT(rejection_message(), HasSubstr("hook.time_limit_s: should be above 0"));
  change("station.yaml", "[label], time_limit_s: 0", "[]");
  EXPECT_THAT(rejection_message(),
              HasSubstr("hook.command: should be a program and its arguments"));
}

TEST_F(ReadStationConfig, SerialPatternRestrictsAcceptedSerials) {
  StationConfig config = read_station_config(folder / "station.yaml");
  EXPECT_EQ(describe_serial_number_problem(config, "anything"), "");
  EXPECT_THAT(describe_serial_number_problem(config, "a/b"),
              HasSubstr("a camera's id has letters"));
  change("station.yaml", "records: records.db",
         "records: records.db\nserial_pattern: 'SN-[0-9]{4}'");
  config = read_station_config(folder / "station.yaml");
  EXPECT_EQ(describe_serial_number_problem(config, "SN-0123"), "");
  EXPECT_EQ(describe_serial_number_problem(config, "SN-01234"),
            "'SN-01234' is not of the form SN-[0-9]{4}");
  EXPECT_THAT(describe_serial_number_problem(config, ""), HasSubstr("a camera's id has letters"));
  change("station.yaml", "'SN-[0-9]{4}'", "'SN-[0-9'");
  EXPECT_THAT(rejection_message(), HasSubstr("serial_pattern: is no regular expression"));
}

/// Nested repetitions can match in exponentially many combinations.
TEST(DescribeSerialNumberProblem, ReportsPatternWhoseComparisonIsTooSlow) {
  StationConfig config{};
  config.serial_pattern = "(a+)+b";
  EXPECT_EQ(describe_serial_number_problem(config, "aaab"), "");
  EXPECT_THAT(describe_serial_number_problem(config, std::string(60, 'a')),
              HasSubstr("serial_pattern: the comparison is too slow for"));
  config.serial_pattern = "[A-Za-z0-9_.-]{1,64}";
  EXPECT_EQ(describe_serial_number_problem(config, std::string(64, 'a')), "");
}

TEST_F(ReadStationConfig, RejectsVerifyDueWithoutGoldenUnitAndZeroLimits) {
  change("station.yaml", "records: records.db",
         "records: records.db\nretention: {images_days: 90}\nverify_due: {hours: 24, units: 200}");
  EXPECT_THAT(rejection_message(), HasSubstr("verify_due: needs a golden unit"));
  folder.file("golden.yaml", TemporaryFolder::read_content(kExample + "calibration.yaml"));
  change("station.yaml", "records: records.db",
         "records: records.db\n"
         "golden: {camera_id: g, calibration: golden.yaml, gates: {tilt_deg: 1}}");
  const StationConfig config = read_station_config(folder / "station.yaml");
  EXPECT_EQ(config.verification_interval->hours, 24);
  EXPECT_EQ(config.verification_interval->units, 200);
  EXPECT_EQ(config.retention.images_days, 90);
  EXPECT_FALSE(config.retention.results_days);
  change("station.yaml", "{hours: 24, units: 200}", "{}");
  EXPECT_THAT(rejection_message(), HasSubstr("verify_due: should have hours or units"));
  change("station.yaml", "verify_due: {}", "verify_due: {hours: 0}");
  EXPECT_THAT(rejection_message(), HasSubstr("verify_due: hours should be above 0"));
  change("station.yaml", "verify_due: {hours: 0}", "verify_due: {}");
  change("station.yaml", "images_days: 90", "images_days: 0");
  EXPECT_THAT(rejection_message(), HasSubstr("verify_due"));
  change("station.yaml", "verify_due: {}", "verify_due: {units: 1}");
  EXPECT_THAT(rejection_message(), HasSubstr("retention.images_days"));
}

TEST_F(ReadStationConfig, RejectsGoldenCalibrationWithoutRowTime) {
  folder.file("golden.yaml", TemporaryFolder::read_content(kExample + "calibration.yaml"));
  change("station.yaml", "records: records.db",
         "records: records.db\n"
         "golden: {camera_id: g, calibration: golden.yaml, gates: {tilt_deg: 1}}");
  EXPECT_TRUE(read_station_config(folder / "station.yaml").golden_unit);
  change("golden.yaml", "  row_time_s: 0.00003\n", "");
  EXPECT_THAT(rejection_message(), AllOf(HasSubstr("golden.calibration"), HasSubstr("row_time_s")));
}

TEST_F(ReadStationConfig, RejectsUnknownKindOfDatabase) {
  change("station.yaml", "records: records.db", "records: mysql://server/records");
  EXPECT_THAT(rejection_message(), AllOf(HasSubstr("records"), HasSubstr("postgresql://")));
}

TEST_F(ReadStationConfig, DigestChangesWithReferencedFile) {
  const std::string before = read_station_config(folder / "station.yaml").sha256;
  EXPECT_EQ(read_station_config(folder / "station.yaml").sha256, before);
  change("lamps.yaml", "-0.32", "-0.33");
  EXPECT_NE(read_station_config(folder / "station.yaml").sha256, before);
}

}  // namespace
}  // namespace vlp
