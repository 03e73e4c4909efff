// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/session_file.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "geometry/angles.h"
#include "support/schema.h"
#include "support/synthetic_rig.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

StepResult sample() {
  StepResult result;
  result.metrics = {{"rms_px", 0.1 + 0.2},
                    {"expected_max_error_px", std::numeric_limits<double>::infinity()}};
  result.warnings = {"one \"lamp\""};
  result.notes = {"note"};
  result.skipped = {{"a.png", "is empty"}};
  result.rejected_lamps = {{2, 12}};
  result.lamp_offsets = {{3, 12, {-0.6, 0.3}, {1e-3, -2e-3}, {1e-4, 2e-4}}};
  result.set_step_failure(StepFailure::wrong_map, "seem to be swapped", "lamps.yaml");
  return result;
}

TEST(WriteStepRecord, RoundTripsAllFields) {
  const TemporaryFolder folder;
  write_step_record(folder / "s.json", {"key", "outputs", sample()});
  const auto kept = read_step_record(folder / "s.json");
  ASSERT_TRUE(kept);
  EXPECT_EQ(kept->key, "key");
  EXPECT_EQ(kept->outputs, "outputs");
  const StepResult& result = kept->result;
  EXPECT_EQ(result.metrics[0].value, 0.1 + 0.2);
  EXPECT_FALSE(std::isfinite(result.metrics[1].value));
  EXPECT_EQ(result.warnings, sample().warnings);
  EXPECT_EQ(result.skipped[0].reason, "is empty");
  EXPECT_EQ(result.rejected_lamps[0].captures, 12);
  ASSERT_EQ(result.lamp_offsets.size(), 1);
  const LampOffset& offset = result.lamp_offsets[0];
  EXPECT_EQ(offset.lamp, 3);
  EXPECT_EQ(offset.captures, 12);
  EXPECT_EQ(offset.map_m, Eigen::Vector2d(-0.6, 0.3));
  EXPECT_LT((offset.offset_m - Eigen::Vector2d(1e-3, -2e-3)).norm(), 1e-15);
  EXPECT_LT((offset.sd_m - Eigen::Vector2d(1e-4, 2e-4)).norm(), 1e-15);
  EXPECT_EQ(result.failure, StepFailure::wrong_map);
  EXPECT_EQ(format_failure_message(result), "lamps.yaml: seem to be swapped");
}

TEST(WriteStepRecord, MatchesJsonSchemaForEachFailure) {
  const TemporaryFolder folder;
  std::vector<std::filesystem::path> files;
  for (int failure = 0; !step_failure_name(static_cast<StepFailure>(failure)).empty(); ++failure) {
    StepResult result = sample();
    result.failure = static_cast<StepFailure>(failure);
    files.push_back(folder / (std::to_string(failure) + ".json"));
    write_step_record(files.back(), {"key", "outputs", result});
  }
  EXPECT_EQ(files.size(), 6U);
  EXPECT_EQ(problems_by_schema("step", files), "");
}

TEST(ReadStepRecord, ReturnsNulloptForMissingOrTruncatedFileOrOtherVersion) {
  const TemporaryFolder folder;
  EXPECT_FALSE(read_step_record(folder / "none.json"));
  write_step_record(folder / "s.json", {"key", "outputs", sample()});
  const std::string text = TemporaryFolder::read_content(folder / "s.json");
  for (std::size_t length = 0; length + 2 < text.size(); ++length) {
    EXPECT_FALSE(read_step_record(folder.file("cut.json", text.substr(0, length)))) << length;
  }
  std::string other = text;
  other.replace(other.find("vlp-step/1"), 10, "vlp-step/2");
  EXPECT_FALSE(read_step_record(folder.file("other.json", other)));
}

TEST(FormatSessionJson, ContainsLensSdsOnlyWithLensCovariance) {
  SessionResult result;
  result.calibration = Calibration{synthetic_camera(), {}, {}, {}, {}};
  const auto format_calibration = [&] {
    return nlohmann::json::parse(format_session_json(result, {}))["calibration"];
  };
  EXPECT_EQ(format_calibration()["focal_px"][0], synthetic_camera().focal_px().x());
  EXPECT_FALSE(format_calibration().contains("focal_sd_px"));
  IntrinsicsReport report{40, 4000, 0, 0.1, {}, {}};
  result.calibration->intrinsics_report = report;
  EXPECT_FALSE(format_calibration().contains("focal_sd_px"));
  report.covariance = Eigen::VectorXd::LinSpaced(8, 1, 8).cwiseAbs2().asDiagonal();
  result.calibration->intrinsics_report = report;
  EXPECT_EQ(format_calibration()["focal_sd_px"], nlohmann::json({1, 2}));
  EXPECT_EQ(format_calibration()["principal_point_sd_px"], nlohmann::json({3, 4}));
}

TEST(FormatSessionJson, StatesRotationCenterAndDispersionInMillimetersAndDegrees) {
  SessionResult result;
  Calibration& calibration =
      result.calibration.emplace(Calibration{synthetic_camera(), {}, {}, {}, {}});
  constexpr double tilt_rad = 0.02, azimuth_rad = 1;
  calibration.rotation_center = tilted_by(calibration.camera, tilt_rad, azimuth_rad);
  calibration.rotation_center->lever_arm_m = Eigen::Vector2d(0.002, -0.003);
  calibration.rotation_center->lever_arm_covariance =
      Eigen::Vector2d(1e-8, 4e-8).asDiagonal().toDenseMatrix();
  calibration.dispersion = Dispersion{{0.4, -0.3}, 0.001, {0, 0}, 12};
  const auto json = nlohmann::json::parse(format_session_json(result, {}))["calibration"];
  EXPECT_NEAR(json.at("tilt_deg"), deg_from_rad(tilt_rad), 1e-9);
  EXPECT_NEAR(json.at("tilt_azimuth_deg"), deg_from_rad(azimuth_rad), 1e-9);
  EXPECT_NEAR(json.at("lever_arm_mm")[0], 2, 1e-12);
  EXPECT_NEAR(json.at("lever_arm_mm")[1], -3, 1e-12);
  EXPECT_NEAR(json.at("lever_arm_sd_mm")[0], 0.1, 1e-12);
  EXPECT_NEAR(json.at("lever_arm_sd_mm")[1], 0.2, 1e-12);
  EXPECT_EQ(json.at("dispersion_offset_px"), nlohmann::json({0.4, -0.3}));
}

TEST(StepFailureFromName, InvertsStepFailureNameForEachValue) {
  for (const auto failure :
       {StepFailure::none, StepFailure::bad_input, StepFailure::undetermined,
        StepFailure::wrong_board, StepFailure::wrong_map, StepFailure::wrong_place}) {
    EXPECT_EQ(step_failure_from_name(step_failure_name(failure)), failure);
  }
  EXPECT_FALSE(step_failure_from_name("odd"));
}

}  // namespace
}  // namespace vlp
