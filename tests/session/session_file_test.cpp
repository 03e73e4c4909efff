// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/session_file.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "geometry/angles.h"
#include "rig/calibration_error.h"
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

TEST(FormatSession, ContainsLensSdsOnlyWithLensCovariance) {
  SessionResult result;
  result.calibration = Calibration{synthetic_camera(), {}, {}, {}, {}};
  const auto format_calibration = [&] {
    return nlohmann::json::parse(format_session(result, {}))["calibration"];
  };
  EXPECT_EQ(format_calibration()["focal_px"][0], synthetic_camera().focal_px().x());
  EXPECT_EQ(format_calibration()["principal_point_px"][1],
            synthetic_camera().principal_point_px().y());
  result.calibration->camera.row_time_s = 3e-5;
  EXPECT_EQ(format_calibration()["row_time_s"], 3e-5);
  EXPECT_FALSE(format_calibration().contains("focal_sd_px"));
  IntrinsicsReport report{40, 4000, 0, 0.1, {}, {}};
  result.calibration->intrinsics_report = report;
  EXPECT_FALSE(format_calibration().contains("focal_sd_px"));
  report.covariance = Eigen::VectorXd::LinSpaced(8, 1, 8).cwiseAbs2().asDiagonal();
  result.calibration->intrinsics_report = report;
  EXPECT_EQ(format_calibration()["focal_sd_px"], nlohmann::json({1, 2}));
  EXPECT_EQ(format_calibration()["principal_point_sd_px"], nlohmann::json({3, 4}));
}

TEST(FormatSession, StatesRotationCenterAndDispersionInMillimetersAndDegrees) {
  SessionResult result;
  Calibration& calibration =
      result.calibration.emplace(Calibration{synthetic_camera(), {}, {}, {}, {}});
  constexpr double tilt_rad = 0.02, azimuth_rad = 1;
  calibration.rotation_center = tilted_by(calibration.camera, tilt_rad, azimuth_rad);
  calibration.rotation_center->lever_arm_m = Eigen::Vector2d(0.002, -0.003);
  append_parameters(calibration.covariance.emplace(), list_pair_names(kLeverArmParameter),
                    MatrixX(2, 0), Eigen::Vector2d(1e-8, 4e-8).asDiagonal().toDenseMatrix());
  calibration.dispersion = Dispersion{{0.4, -0.3}, 0.001, {0, 0}, 12};
  const auto json = nlohmann::json::parse(format_session(result, {}))["calibration"];
  EXPECT_NEAR(json.at("tilt_deg"), deg_from_rad(tilt_rad), 1e-9);
  EXPECT_NEAR(json.at("tilt_azimuth_deg"), deg_from_rad(azimuth_rad), 1e-9);
  EXPECT_NEAR(json.at("lever_arm_mm")[0], 2, 1e-12);
  EXPECT_NEAR(json.at("lever_arm_mm")[1], -3, 1e-12);
  EXPECT_NEAR(json.at("lever_arm_sd_mm")[0], 0.1, 1e-12);
  EXPECT_NEAR(json.at("lever_arm_sd_mm")[1], 0.2, 1e-12);
  EXPECT_EQ(json.at("dispersion_offset_px"), nlohmann::json({0.4, -0.3}));
}

TEST(FormatSession, StatesStandardDeviationsOfZenithAndOffset) {
  SessionResult result;
  Calibration& calibration =
      result.calibration.emplace(Calibration{synthetic_camera(), {}, {}, {}, {}});
  const Eigen::Vector2d focal_px = calibration.camera.focal_px();
  calibration.rotation_center = tilted_by(calibration.camera, 0.02, 0);
  calibration.dispersion = Dispersion{{0.4, -0.3}, 0.001, {0, 0}, 12};
  const auto format_calibration = [&] {
    return nlohmann::json::parse(format_session(result, {}))["calibration"];
  };
  for (const char* key : {"rotation_center_sd_px", "zenith_sd_deg", "dispersion_offset_sd_px"}) {
    EXPECT_TRUE(format_calibration().at(key).is_null()) << key;
  }
  // The lens is known, and exact.
  const auto count = static_cast<Eigen::Index>(calibration.camera.intrinsics.size());
  calibration.intrinsics_report.emplace().covariance = MatrixX::Zero(count, count);
  calibration.covariance = make_lens_covariance(calibration);
  const auto append = [&](std::string_view name, const Eigen::Vector2d& sd_px) {
    const Eigen::Vector2d variances = sd_px.cwiseQuotient(focal_px).cwiseAbs2();
    append_parameters(*calibration.covariance, list_pair_names(name),
                      MatrixX::Zero(2, calibration.covariance->matrix.rows()),
                      variances.asDiagonal().toDenseMatrix());
  };
  append(kZenithParameter, {0.1, 0.2});
  append(kOffsetParameter, {0.03, 0.04});
  const auto json = format_calibration();
  EXPECT_NEAR(json.at("rotation_center_sd_px")[0], 0.1, 1e-12);
  EXPECT_NEAR(json.at("rotation_center_sd_px")[1], 0.2, 1e-12);
  EXPECT_NEAR(json.at("zenith_sd_deg")[0], deg_from_rad(0.1 / focal_px.x()), 1e-9);
  EXPECT_NEAR(json.at("zenith_sd_deg")[1], deg_from_rad(0.2 / focal_px.y()), 1e-9);
  EXPECT_NEAR(json.at("zenith_deg")[0], deg_from_rad(std::tan(0.02)), 1e-9);
  EXPECT_NEAR(json.at("zenith_deg")[1], 0, 1e-9);
  EXPECT_NEAR(json.at("dispersion_offset_sd_px")[0], 0.03, 1e-12);
  EXPECT_NEAR(json.at("dispersion_offset_sd_px")[1], 0.04, 1e-12);
  EXPECT_NEAR(json.at("dispersion_radius_mm"), 1, 1e-12);
}

/// Result of a session with a passed and a failed gate, and a step with remarks.
SessionResult make_session_result() {
  SessionResult result;
  result.verdict = Verdict::fail;
  result.reason = "tilt_deg is 0.9";
  SessionStep lens{"lens", false, {}};
  lens.result.metrics = {{"rms_px", 0.25}};
  SessionStep rotation{"rotation", true, {}};
  rotation.result.metrics = {{"tilt_deg", 0.9}, {"rotation_px", 0.1}};
  rotation.result.gates =
      check_gates({{"tilt_deg", 0.5}, {"rotation_px", 1}}, rotation.result.metrics);
  rotation.result.warnings = {"a warning"};
  rotation.result.notes = {"a note"};
  rotation.result.skipped = {{"0003.png", "is empty"}};
  rotation.result.rejected_lamps = {{2, 5}};
  rotation.result.lamp_offsets = {{3, 12, {-0.6, 0.3}, {1e-3, -2e-3}, {1e-4, 2e-4}}};
  result.gates = rotation.result.gates;
  result.steps = {lens, rotation};
  return result;
}

TEST(FormatSession, ListsMetricsWithStepUnitAndGate) {
  SessionOptions options;
  options.camera_id = "unit-8";
  options.program = {"vlp-calibrate", "1.2"};
  const auto json = nlohmann::json::parse(format_session(make_session_result(), options));
  EXPECT_EQ(json["verdict"], "gate");
  EXPECT_EQ(json["reason"], "tilt_deg is 0.9");
  EXPECT_EQ(json["camera"], "unit-8") << "without a calibration";
  EXPECT_EQ(json["version"], "1.2");
  EXPECT_FALSE(json.contains("calibration"));
  const auto& metrics = json["metrics"];
  ASSERT_EQ(metrics.size(), 3U);
  EXPECT_EQ(metrics[0], nlohmann::json::parse(
                            R"({"name": "rms_px", "value": 0.25, "step": "lens", "unit": "px"})"));
  EXPECT_EQ(metrics[1],
            nlohmann::json::parse(R"({"name": "tilt_deg", "value": 0.9, "step": "rotation",
              "unit": "deg", "limit": 0.5, "direction": "at most", "passed": false})"));
  EXPECT_EQ(metrics[2],
            nlohmann::json::parse(R"({"name": "rotation_px", "value": 0.1, "step": "rotation",
              "unit": "px", "limit": 1.0, "direction": "at most", "passed": true})"));
  ASSERT_EQ(json["gates"].size(), 2U);
  EXPECT_EQ(json["gates"][0],
            nlohmann::json::parse(R"({"name": "tilt_deg", "unit": "deg", "value": 0.9,
              "limit": 0.5, "direction": "at most", "passed": false})"));
}

TEST(FormatSession, ListsStepsWithTheirRemarksOnly) {
  const auto json = nlohmann::json::parse(format_session(make_session_result(), {}));
  ASSERT_EQ(json["steps"].size(), 2U);
  EXPECT_EQ(json["steps"][0], nlohmann::json::parse(R"({"name": "lens", "failure": "none"})"));
  EXPECT_EQ(json["steps"][1]["warnings"], nlohmann::json({"a warning"}));
  EXPECT_EQ(json["steps"][1]["notes"], nlohmann::json({"a note"}));
  EXPECT_EQ(json["steps"][1]["skipped"],
            nlohmann::json::parse(R"([{"image": "0003.png", "reason": "is empty"}])"));
  EXPECT_EQ(json["steps"][1]["rejected_lamps"],
            nlohmann::json::parse(R"([{"lamp": 2, "captures": 5}])"));
  EXPECT_EQ(json["steps"][1]["lamp_offsets"],
            nlohmann::json::parse(R"([{"lamp": 3, "captures": 12, "map_m": [-0.6, 0.3],
              "offset_mm": [1.0, -2.0], "offset_sd_mm": [0.1, 0.2]}])"));
  EXPECT_FALSE(json["steps"][1].contains("message"));
}

TEST(FormatSession, ContainsHistoryOfCalibration) {
  SessionResult result;
  result.calibration = Calibration{synthetic_camera(), {}, {}, {}, {}};
  result.calibration->history = {
      {"camera", "vlp-calibrate", "1.2", "--lens auto", {{"boards", "abc"}, {"board.yaml", "d"}}}};
  const auto json = nlohmann::json::parse(format_session(result, {}));
  EXPECT_EQ(json["history"],
            nlohmann::json::parse(R"([{"part": "camera", "program": "vlp-calibrate",
              "version": "1.2", "options": "--lens auto", "inputs": [
                {"file": "boards", "sha256": "abc"}, {"file": "board.yaml", "sha256": "d"}]}])"));
}

TEST(FormatSessionJunit, ListsStepsAndGates) {
  SessionResult result = make_session_result();
  const std::string text = format_session_junit(result);
  EXPECT_THAT(text, testing::HasSubstr("tests=\"4\""));
  EXPECT_THAT(text, testing::HasSubstr("a warning"));
  EXPECT_THAT(text, testing::HasSubstr("<failure"));
  EXPECT_THAT(text, testing::Not(testing::HasSubstr("<error")));
  result.steps[1].result.set_step_failure(StepFailure::undetermined, "too few captures");
  EXPECT_THAT(format_session_junit(result),
              testing::HasSubstr("<error type=\"undetermined\" message=\"too few captures"));
}

TEST(FormatSessionJunit, StatesReasonIfThereIsNoStep) {
  SessionResult result;
  result.verdict = Verdict::invalid;
  result.failure = StepFailure::bad_input;
  result.reason = "lamps.yaml: is missing";
  const std::string text = format_session_junit(result);
  EXPECT_THAT(text, testing::HasSubstr("tests=\"1\""));
  EXPECT_THAT(text,
              testing::HasSubstr("<error type=\"bad_input\" message=\"lamps.yaml: is missing"));
}

}  // namespace
}  // namespace vlp
