// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/certificate.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "rig/calibration_error.h"
#include "station/station_config.h"
#include "support/datasets.h"

namespace vlp {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// Returns the example calibration with covariances.
Calibration measured() {
  Calibration calibration = read_calibration(kExample + "calibration.yaml");
  const auto size = static_cast<Eigen::Index>(calibration.camera.intrinsics.size());
  Eigen::VectorXd corner_sds_px = Eigen::VectorXd::Constant(size, 1e-3);
  corner_sds_px.head<4>() << 0.01, 0.02, 0.03, 0.04;
  calibration.intrinsics_report = IntrinsicsReport{36, 4000, 0, 0.1, {}, {}};
  calibration.intrinsics_report->covariance = MatrixX(corner_sds_px.cwiseAbs2().asDiagonal());
  RotationCenter& center = *calibration.rotation_center;
  center.lever_arm_m = Eigen::Vector2d(1e-3, -2e-3);
  calibration.covariance = make_lens_covariance(calibration);
  // The zenith compensates the error of the principal point.
  MatrixX jacobian = MatrixX::Zero(2, size);
  jacobian.middleCols<2>(2) = Eigen::Vector2d(-1 / 520., -1 / 522.).asDiagonal();
  append_parameters(
      *calibration.covariance, list_pair_names(kZenithParameter), jacobian,
      Eigen::Vector2d(0.05 / 520, 0.06 / 522).cwiseAbs2().asDiagonal().toDenseMatrix());
  append_parameters(*calibration.covariance, list_pair_names(kLeverArmParameter),
                    MatrixX::Zero(2, size + 2),
                    Eigen::Vector2d(1e-8, 4e-8).asDiagonal().toDenseMatrix());
  calibration.history = {{"camera", "vlp-station", "0", "", {{"station", std::string(64, 'a')}}}};
  return calibration;
}

RunRecord certified_run() {
  RunRecord record;
  record.run = "20261121T134501Z-0001";
  record.kind = "unit";
  record.camera = "<0001>";
  record.station = "station-1";
  record.ended_utc = "2026-11-21T13:50:01Z";
  record.program = "vlp-station 0";
  record.config_sha256 = std::string(64, 'a');
  record.calibration = "format: vlp-calibration/1\n";
  record.verdict = verdict_name(Verdict::pass);
  record.metrics = check_against_gates(
      {{"rms_px", 0.3}, {"check_mean_mm", 1, GuardBand{0.02, 1.645}}},
      {{"rms_px", 0.123456}, {"check_mean_mm", 0.9600001}}, list_unit_metrics());
  return record;
}

TEST(FormatValueWithExpandedUncertainty, StatesTwiceTheSdWithTwoDigits) {
  const auto words = [](double value, std::optional<double> u) {
    return format_value_with_expanded_uncertainty(CertifiedValue{"", "px", value, u});
  };
  EXPECT_EQ(words(520.12345, 0.006), "520.123 \u00b1 0.012\u00a0px");
  EXPECT_EQ(words(520.12345, 0.0498), "520.12 \u00b1 0.10\u00a0px");  // not 0.0996, nor 0.100
  EXPECT_EQ(words(-0.00123, 0.5), "-0.0 \u00b1 1.0\u00a0px");
  EXPECT_EQ(words(1234.6, 20), "1235 \u00b1 40\u00a0px");
  EXPECT_EQ(words(520.12345, std::nullopt), "520.123\u00a0px, uncertainty not stated");
  EXPECT_EQ(words(520.12345, 0), words(520.12345, std::nullopt));
}

TEST(ListCertifiedValues, ReturnsStandardUncertaintiesOfCalibration) {
  const Calibration calibration = measured();
  const auto values = list_certified_values(calibration);
  ASSERT_EQ(values.size(), 10u);
  const std::vector<double> u{0.01, 0.02, 0.03, 0.04, 0.05, 0.06};
  for (std::size_t i = 0; i < u.size(); ++i) {
    EXPECT_NEAR(values[i].standard_uncertainty.value(), u[i], 1e-4) << values[i].name;
  }
  EXPECT_EQ(values[0].value, 520);
  EXPECT_EQ(values[3].value, 296);
  EXPECT_NEAR(values[6].standard_uncertainty.value(),
              std::hypot(0.05, 0.03) / 520 * 180 / std::numbers::pi, 1e-12);
  EXPECT_EQ(values[8].name, "lever arm x");
  EXPECT_NEAR(values[8].value, 1, 1e-12);
  EXPECT_NEAR(values[9].standard_uncertainty.value(), 0.2, 1e-12);
  // The effect of the lens on the zenith is unknown.
  Calibration unknown = calibration;
  unknown.covariance = {{}, {"zenith_x", "zenith_y"}, Matrix2::Identity()};
  EXPECT_FALSE(list_certified_values(unknown)[6].standard_uncertainty);
  // A calibration without uncertainties.
  for (const CertifiedValue& value :
       list_certified_values(read_calibration(kExample + "calibration.yaml"))) {
    EXPECT_FALSE(value.standard_uncertainty) << value.name;
  }
}

TEST(MakeCertificate, ContainsMetricsGatesAndDecisionsOfRun) {
  const std::string page = make_certificate(certified_run(), measured());
  EXPECT_EQ(make_certificate(certified_run(), measured()), page);
  EXPECT_THAT(
      page, AllOf(HasSubstr("Calibration certificate: camera &lt;0001&gt;"), HasSubstr("conforms"),
                  HasSubstr("20261121T134501Z-0001"), HasSubstr("2026-11-21T13:50:01Z"),
                  HasSubstr("station-1"), HasSubstr("vlp-station 0"),
                  HasSubstr(std::string(64, 'a')), HasSubstr("520.000 \u00b1 0.020\u00a0px")));
  // A gate with a guard band, and one without.
  EXPECT_THAT(page, HasSubstr("<td>0.960 \u00b1 0.040\u00a0mm</td><td>at most 1\u00a0mm</td>"
                              "<td>0.9671\u00a0mm</td><td>yes, p = 0.977</td>"
                              "<td>guard band of 1.645 u</td>"));
  EXPECT_THAT(page, HasSubstr("<td>0.1235\u00a0px</td><td>at most 0.3\u00a0px</td>"
                              "<td>0.3\u00a0px</td><td>yes</td><td>simple</td>"));
  EXPECT_THAT(page, HasSubstr("<div class=\"signature\">signature</div>"));
  EXPECT_THAT(page, HasSubstr("counter(pages)"));
}

TEST(MakeCertificate, ContainsCorrelationsOfCalibration) {
  Calibration calibration = measured();
  Matrix2 covariance;
  covariance << 4, 1.5, 1.5, 9;
  calibration.covariance = {{}, {"zenith_x", "zenith_y"}, covariance};
  EXPECT_THAT(make_certificate(certified_run(), calibration),
              HasSubstr("zenith_y</th><td>0.25</td><td>1.00</td>"));
  calibration.covariance.reset();
  EXPECT_THAT(make_certificate(certified_run(), calibration), Not(HasSubstr("Correlations")));
}

TEST(MakeCertificate, StatesNonconformityAndPrintOfBoard) {
  RunRecord record = certified_run();
  record.metrics[0].value = 0.4;
  record.metrics.push_back({"board_print_px", "px", 0.0625, {}, Direction::at_most});
  record.set_causes({{"the lens is poor", true}});
  EXPECT_THAT(make_certificate(record, measured()),
              AllOf(HasSubstr("FAIL"), HasSubstr("the lens is poor."), HasSubstr("<td>no</td>"),
                    HasSubstr("0.0625 px, rms"), Not(HasSubstr("conforms with all"))));
}

TEST(MakeCertificate, ThrowsForGoldenInvalidOrEditedRuns) {
  for (const auto& change : {+[](RunRecord& run) { run.kind = "golden"; },
                             +[](RunRecord& run) {
                               run.set_causes({{"loose", false}});
                             },
                             +[](RunRecord& run) { run.metrics[0].value = 0.4; },
                             +[](RunRecord& run) { run.calibration.clear(); }}) {
    RunRecord record = certified_run();
    change(record);
    EXPECT_THROW(make_certificate(record, measured()), InputError) << record.kind;
  }
}

}  // namespace
}  // namespace vlp
