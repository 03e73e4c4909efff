// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/renamed.h"

#include <gmock/gmock.h>

#include "rig/calibration.h"
#include "rig/samples.h"
#include "rig/yaml_reader.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

TEST(FindCurrentNameForFormer, ReturnsNewNameForFormerNameOfSameKind) {
  EXPECT_EQ(find_current_name_for_former(NameKind::key, "uncertainty_px"), "expected_max_error_px");
  EXPECT_EQ(find_current_name_for_former(NameKind::key, "fault_share"), "fault_fraction");
  EXPECT_EQ(find_current_name_for_former(NameKind::key, "red_share"), "red_to_green_ratio");
  EXPECT_EQ(find_current_name_for_former(NameKind::column, "spot"), "pivot");
  EXPECT_EQ(find_current_name_for_former(NameKind::column, "sd_x_m"), "x_sd_m");
  EXPECT_EQ(find_current_name_for_former(NameKind::metric, "center_px"), "principal_point_px");
  EXPECT_EQ(find_current_name_for_former(NameKind::option, "--of"), "--position-of");
  EXPECT_EQ(find_current_name_for_former(NameKind::option, "--marker-share"),
            "--marker-to-square-ratio");
  EXPECT_EQ(find_current_name_for_former(NameKind::value, "paper"), "chen-guan");
  EXPECT_EQ(find_current_name_for_former(NameKind::key, "spots_m"), "pivots_m");
  EXPECT_EQ(find_current_name_for_former(NameKind::key, "dispersion_station_m"),
            "dispersion_position_m");
  EXPECT_EQ(find_current_name_for_former(NameKind::option, "--station-mm"), "--same-point-mm");
  EXPECT_EQ(find_current_name_for_former(NameKind::key, "spot"), "");
  EXPECT_EQ(find_current_name_for_former(NameKind::key, "rms_px"), "");
}

TEST(FindFormerNameForCurrent, InvertsFindCurrentNameForFormer) {
  EXPECT_EQ(find_former_name_for_current(NameKind::metric, "missing_fraction"), "missing");
  EXPECT_EQ(find_former_name_for_current(NameKind::column, "missing_fraction"), "");
}

/// Message on reading the key `present` of a mapping.
std::string message_on(const std::string& content, const std::string& present) {
  const TemporaryFolder folder;
  const auto file = folder.file("some.yaml", content);
  return refusal(
      [&](const std::filesystem::path& path) {
        YamlMap map = read_yaml_file(path);
        map.get_optional_yaml_value(present);
        map.check_all_yaml_keys_read();
      },
      file);
}

TEST(YamlMap, ErrorNamesNewNameOfRenamedKey) {
  EXPECT_EQ(message_on("a: 1\nenough: 2\n", "completion"),
            "some.yaml:2: key 'enough' is now called 'completion'");
  EXPECT_EQ(message_on("completion: 1\nenough: 2\n", "completion"),
            "some.yaml:2: key 'enough' is now called 'completion'");
  EXPECT_EQ(message_on("center_px: 2\n", "principal_point_px"),
            "some.yaml:1: key 'center_px' is now called 'principal_point_px'");
  EXPECT_EQ(message_on("enough: 2\n", "retention"),
            "some.yaml:1: key 'enough' is unknown; the keys are: retention");
  EXPECT_EQ(message_on("enough: 2\n", "enough"), "");
  const TemporaryFolder folder;
  const auto file = folder.file("some.yaml", "keep: 1\n");
  const std::string problem = "some.yaml:1: key 'keep' is now called 'retention'";
  EXPECT_EQ(
      refusal([](const auto& path) { read_yaml_file(path).get_required_yaml_value("retention"); },
              file),
      problem);
  EXPECT_EQ(refusal([](const auto& path) { read_yaml_file(path).has_yaml_key("retention"); }, file),
            problem);
}

TEST(ReadCalibration, ErrorNamesNewNameOfRenamedKey) {
  const TemporaryFolder folder;
  const auto file =
      folder.file("c.yaml", changed(kCalibrationYaml, "valid_region_px", "region_px"));
  EXPECT_THAT(refusal(read_calibration, file),
              testing::HasSubstr("key 'region_px' is now called 'valid_region_px'"));
}

}  // namespace
}  // namespace vlp
