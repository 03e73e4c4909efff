// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/statistics/bias_study.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::SizeIs;

std::vector<ReferenceValue> values_of_unit(const std::string& unit, double reference,
                                           const std::vector<double>& values) {
  std::vector<ReferenceValue> all;
  all.reserve(values.size());
  for (const double value : values) all.push_back({unit, reference, value});
  return all;
}

/// AIAG, Measurement Systems Analysis, the linearity example: 5 parts, 12 readings each.
std::vector<ReferenceValue> linearity_example() {
  const std::vector<std::vector<double>> readings{
      {2.7, 2.5, 2.4, 2.5, 2.7, 2.3, 2.5, 2.5, 2.4, 2.4, 2.6, 2.4},
      {5.1, 3.9, 4.2, 5.0, 3.8, 3.9, 3.9, 3.9, 3.9, 4.0, 4.1, 3.8},
      {5.8, 5.7, 5.9, 5.9, 6.0, 6.1, 6.0, 6.1, 6.4, 6.3, 6.0, 6.1},
      {7.6, 7.7, 7.8, 7.7, 7.8, 7.8, 7.8, 7.7, 7.8, 7.5, 7.6, 7.7},
      {9.1, 9.3, 9.5, 9.3, 9.4, 9.5, 9.5, 9.5, 9.6, 9.2, 9.3, 9.4}};
  std::vector<ReferenceValue> all;
  for (std::size_t part = 0; part < readings.size(); ++part) {
    const auto of_part = values_of_unit("part " + std::to_string(part + 1),
                                        2 * (static_cast<double>(part) + 1), readings[part]);
    all.insert(all.end(), of_part.begin(), of_part.end());
  }
  return all;
}

/// The regression of the manual and of SPC for Excel's worked example of it ("Linearity and Bias
/// Study", its biases with the sample's standard deviation), to their printed digits.
TEST(BiasStudy, LinearityMatchesExampleOfAiagManual) {
  const BiasStudy study = analyze_bias(linearity_example());
  ASSERT_TRUE(study.linearity);
  const Linearity& line = *study.linearity;
  EXPECT_NEAR(line.slope.value, -0.131667, 5e-7);
  EXPECT_NEAR(line.intercept.value, 0.737, 5e-4);
  EXPECT_NEAR(line.slope.standard_error, 0.0109, 5e-5);
  EXPECT_NEAR(line.intercept.standard_error, 0.0725, 5e-5);
  EXPECT_NEAR(line.slope.t, -12.04, 0.005);
  EXPECT_NEAR(line.intercept.t, 10.16, 0.005);
  EXPECT_NEAR(line.slope.low, -0.154, 5e-4);
  EXPECT_NEAR(line.slope.high, -0.110, 5e-4);
  EXPECT_NEAR(line.intercept.low, 0.591, 5e-4);
  EXPECT_NEAR(line.intercept.high, 0.882, 5e-4);
  EXPECT_LT(line.slope.p, 5e-4);
  EXPECT_TRUE(line.slope.is_significant());
  EXPECT_NEAR(line.residual_sd, 0.240, 5e-4);
  EXPECT_NEAR(100 * line.r_squared, 71.43, 0.005);
  EXPECT_EQ(line.slope.dof, 58);

  struct Printed {
    double bias, standard_error, t, p;
  };
  const std::vector<Printed> printed{{0.492, 0.0358, 13.73, 0.000},
                                     {0.125, 0.129, 0.968, 0.354},
                                     {0.0250, 0.0566, 0.442, 0.667},
                                     {-0.292, 0.0288, -10.14, 0.000},
                                     {-0.617, 0.0423, -14.56, 0.000}};
  ASSERT_THAT(study.units, SizeIs(printed.size()));
  for (std::size_t i = 0; i < printed.size(); ++i) {
    const EstimateTest& bias = study.units[i].bias;
    EXPECT_NEAR(bias.value, printed[i].bias, 5e-4);
    EXPECT_NEAR(bias.standard_error, printed[i].standard_error,
                printed[i].standard_error > 0.1 ? 5e-4 : 5e-5);
    EXPECT_NEAR(bias.t, printed[i].t, std::abs(printed[i].t) < 1 ? 5e-4 : 0.005);
    EXPECT_NEAR(bias.p, printed[i].p, 5e-4);
    EXPECT_EQ(bias.is_significant(), printed[i].p < 0.05);
    EXPECT_EQ(study.units[i].reference, 2 * (static_cast<double>(i) + 1));
    EXPECT_EQ(study.units[i].count, 12U);
  }
  // Bias of all values together; its interval is that of JMP's documentation on the same data.
  EXPECT_NEAR(study.overall_bias.value, -0.0533, 5e-5);
  EXPECT_NEAR(study.overall_bias.standard_error, 0.0308, 5e-5);
  EXPECT_NEAR(study.overall_bias.t, -1.729, 2e-3);
  EXPECT_NEAR(study.overall_bias.p, 0.089, 5e-4);
  EXPECT_NEAR(study.overall_bias.low, -0.1152, 1e-4);
  EXPECT_NEAR(study.overall_bias.high, 0.0085, 1e-4);
  EXPECT_FALSE(study.overall_bias.is_significant());
  // Narrowest at the mean. At both ends 0 is outside the band, as in the manual's figure.
  EXPECT_LT(line.half_width_at(6), line.half_width_at(2));
  EXPECT_NEAR(line.half_width_at(2), line.half_width_at(10), 1e-12);
  EXPECT_GT(line.predict_bias_at(2), line.half_width_at(2));
  EXPECT_LT(line.predict_bias_at(10), -line.half_width_at(10));
}

/// AIAG, Measurement Systems Analysis, 4th ed., the independent sample method: 15 readings of a
/// part of 6.00.
TEST(BiasStudy, BiasMatchesExampleOfAiagManual) {
  const BiasStudy study = analyze_bias(values_of_unit(
      "part", 6, {5.8, 5.7, 5.9, 5.9, 6.0, 6.1, 6.0, 6.1, 6.4, 6.3, 6.0, 6.1, 6.2, 5.6, 6.0}));
  ASSERT_THAT(study.units, SizeIs(1));
  const UnitBias& part = study.units[0];
  EXPECT_NEAR(part.mean, 6.0067, 5e-5);
  EXPECT_NEAR(part.bias.value, 0.0067, 5e-5);
  EXPECT_EQ(part.bias.dof, 14);
  EXPECT_NEAR(part.sd, 0.2120, 5e-5);
  EXPECT_NEAR(part.bias.standard_error, 0.0547, 5e-5);
  EXPECT_NEAR(part.bias.t, 0.1218, 5e-5);
  EXPECT_NEAR(part.bias.low, -0.1107, 1e-4);
  EXPECT_NEAR(part.bias.high, 0.1241, 5e-5);
  EXPECT_FALSE(part.bias.is_significant());
  EXPECT_FALSE(study.linearity) << "of one reference";
}

TEST(BiasStudy, PValueIsZeroForConstantBiasAndOneWithoutBias) {
  const BiasStudy study = analyze_bias(values_of_unit("a", 1, {1.5, 1.5, 1.5}));
  EXPECT_EQ(study.overall_bias.p, 0);
  EXPECT_EQ(study.overall_bias.t, std::numeric_limits<double>::infinity());
  EXPECT_EQ(study.overall_bias.low, 0.5);
  EXPECT_TRUE(study.overall_bias.is_significant());
  // Ten times 0.9 does not add up to 9.
  const BiasStudy none = analyze_bias(values_of_unit("a", 0.9, std::vector<double>(10, 0.9)));
  EXPECT_EQ(none.units[0].bias.value, 0);
  EXPECT_EQ(none.units[0].bias.p, 1);
  EXPECT_EQ(none.overall_bias.p, 1);
}

TEST(BiasStudy, ThrowsWithoutValuesOrForUnitWithOneRun) {
  EXPECT_THAT(rejection_message<std::invalid_argument>([] { analyze_bias({}); }),
              HasSubstr("needs runs of reference units"));
  EXPECT_THAT(rejection_message<std::invalid_argument>([] {
                analyze_bias({{"a", 1, 1}, {"a", 1, 2}, {"b", 2, 2}});
              }),
              HasSubstr("unit b has one run: a bias study needs two or more of each"));
}

TEST(WriteBiasPlot, ShowsBandForLinearityOnly) {
  const TemporaryFolder folder;
  const auto values = linearity_example();
  write_bias_plot(folder / "bias.svg", "tilt_deg", values, analyze_bias(values));
  EXPECT_THAT(TemporaryFolder::read_content(folder / "bias.svg"),
              AllOf(HasSubstr("<svg"), HasSubstr("95 % band"), HasSubstr("no bias"),
                    HasSubstr("tilt_deg, measured - reference")));
  const auto one = values_of_unit("a", 1, {1.5, 1.4});
  write_bias_plot(folder / "one.svg", "tilt_deg", one, analyze_bias(one));
  EXPECT_THAT(TemporaryFolder::read_content(folder / "one.svg"), testing::Not(HasSubstr("band")));
}

}  // namespace
}  // namespace vlp
