// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace vlp {

/// Measured value of a reference unit and its known reference value.
struct ReferenceValue {
  std::string unit;
  double reference, value;
};

/// Estimated value with its standard error and t-test against 0. All but `dof`, `t` and `p` are in
/// the unit of the value.
///
///   t = value / standard_error,   p = P(|T| > |t|) with `dof` degrees of freedom
///
/// `low` to `high` is the 95 % confidence interval. Without scatter p is 0, or 1 for a value of 0.
struct EstimateTest {
  double value = 0, standard_error = 0, dof = 0, t = 0, p = 1, low = 0, high = 0;

  /// Returns true if the value differs significantly from 0 (p < 0.05).
  bool is_significant() const;
};

/// Bias of the measured values of one reference unit. `mean` and `sd` are those of its values.
struct UnitBias {
  std::string unit;
  double reference = 0;
  std::size_t count = 0;
  double mean = 0, sd = 0;
  EstimateTest bias;
};

/// Regression of the bias on the reference value, by least squares over all values:
///
///   value - reference = intercept + slope * reference + e.
struct Linearity {
  EstimateTest slope, intercept;
  /// Standard deviation s of the residuals, and fraction of the variance that the line explains.
  double residual_sd = 0, r_squared = 0;
  double count = 0, mean_reference = 0, reference_squares = 0;

  double predict_bias_at(double reference) const;
  /// Returns half of the 95 % confidence band of the line at a reference x: t s sqrt(1 / n + (x -
  /// mean)^2 / S_xx).
  double half_width_at(double reference) const;
};

/// Bias and linearity of a measurement system against reference units (AIAG MSA, 4th ed., chapter
/// III section B: independent sample method and linearity).
///
///   units      t-test of each unit's mean difference, with the unit's standard deviation
///   all        t-test of the mean of all differences, with the repeatability pooled over the units
///   linearity  regression, if there are two or more different reference values
struct BiasStudy {
  /// Biases by unit, by increasing reference.
  std::vector<UnitBias> units;
  /// Bias of all values. It is meaningful only if the slope is not significant.
  EstimateTest overall_bias;
  std::optional<Linearity> linearity;
};

/// Computes bias and linearity. Throws std::invalid_argument if there is no value, or a unit with a
/// single value; the message names what is missing.
BiasStudy analyze_bias(const std::vector<ReferenceValue>& values);

/// Plots the differences over the references, the mean of each unit, the line and its band, as .png
/// or .svg. Throws InputError.
void write_bias_plot(const std::filesystem::path& file, const std::string& title,
                     const std::vector<ReferenceValue>& values, const BiasStudy& study);

}  // namespace vlp
