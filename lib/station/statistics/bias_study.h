// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace vlp {

/// A value of a reference unit, whose figure is known from elsewhere.
struct ReferenceValue {
  std::string unit;
  double reference, value;
};

/// An estimate, and whether chance explains that it is not 0: t = value / standard error, p = P(|T|
/// > |t|) with `dof` degrees of freedom, and a 95 % interval. Without scatter p is 0, or 1 of a
/// value of 0.
struct TestedEstimate {
  double value = 0, standard_error = 0, dof = 0, t = 0, p = 1, low = 0, high = 0;

  /// At the 5 % level.
  bool shows() const;
};

/// Of the values of one unit.
struct UnitBias {
  std::string unit;
  double reference = 0;
  std::size_t count = 0;
  double mean = 0, sd = 0;
  TestedEstimate bias;
};

/// The bias of each value as a line over the reference: value - reference = intercept + slope *
/// reference + e, by least squares over all values.
struct Linearity {
  TestedEstimate slope, intercept;
  /// s of the residuals; the share of the variance that the line explains.
  double residual_sd = 0, r_squared = 0;
  double count = 0, mean_reference = 0, squares_of_references = 0;

  double bias_at(double reference) const;
  /// Half of the 95 % confidence band of the line there: t s sqrt(1 / n + (x - mean)^2 / S_xx).
  double band_at(double reference) const;
};

/// Bias and linearity of a measuring system against reference units (AIAG MSA, 4th ed., chapter III
/// section B: independent sample method and linearity): a t-test of each unit's mean difference,
/// with its standard deviation, one of the mean of all differences, with that of repeats, pooled
/// over the units, and the regression where there are two references or more that differ.
struct BiasStudy {
  /// In the order of their references.
  std::vector<UnitBias> units;
  /// Of all values: what it tells when the slope does not show.
  TestedEstimate all;
  std::optional<Linearity> linearity;
};

/// Throws std::invalid_argument, which says what is missing: no value, or a unit with one.
BiasStudy bias_study(const std::vector<ReferenceValue>& values);

/// The differences over the references, the mean of each unit, the line and its band, as .png or
/// .svg. Throws InputError.
void draw_bias(const std::filesystem::path& picture, const std::string& title,
               const std::vector<ReferenceValue>& values, const BiasStudy& study);

}  // namespace vlp
