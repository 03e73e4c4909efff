// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/errors/systematic_errors.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include "geometry/angles.h"
#include "geometry/median.h"

namespace vlp {
namespace {

using Complex = std::complex<double>;

constexpr std::size_t kMinFixes = 6;
/// Maximum ratio of the remaining to the original error.
constexpr double kMaxRemainingRatio = 0.05;
/// Minimum errors that are examined.
constexpr double kMinPositionError_m = 5e-3, kMinHeightError_m = 1e-2;
constexpr double kMinYawError_rad = std::numbers::pi / 180;
/// Minimum error of the scale that is named.
constexpr double kMinScaleError = 0.01;

Complex to_complex(const Eigen::Vector2d& xy) { return {xy.x(), xy.y()}; }

/// Returns the quantile of the magnitudes that a fifth of wrong fixes does not change much.
double compute_quantile(std::vector<double> magnitudes) {
  constexpr double fraction = 0.8;
  const auto place =
      static_cast<std::ptrdiff_t>(fraction * static_cast<double>(magnitudes.size() - 1));
  std::ranges::nth_element(magnitudes, magnitudes.begin() + place);
  return magnitudes[static_cast<std::size_t>(place)];
}

double compute_magnitude_quantile(const std::vector<Complex>& errors) {
  std::vector<double> magnitudes;
  magnitudes.reserve(errors.size());
  for (const Complex& error : errors) magnitudes.push_back(std::abs(error));
  return compute_quantile(std::move(magnitudes));
}

Complex compute_mean(const std::vector<Complex>& values) {
  Complex sum = 0;
  for (const Complex& value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

Complex compute_median(const std::vector<Complex>& values) {
  std::vector<double> x, y;
  for (const Complex& value : values) {
    x.push_back(value.real());
    y.push_back(value.imag());
  }
  return {lower_median(std::move(x)), lower_median(std::move(y))};
}

/// Transformation of the positions of a truth that explains the fixes, and the error that remains.
struct Explanation {
  std::string description;
  double error_m;
};

Explanation fit_offset(const std::vector<Complex>& errors_m) {
  const Complex offset_m = compute_median(errors_m);
  std::vector<Complex> remaining_m = errors_m;
  for (Complex& error_m : remaining_m) error_m -= offset_m;
  return {fmt::format("moved by x {:+.1f} mm, y {:+.1f} mm", 1e3 * offset_m.real(),
                      1e3 * offset_m.imag()),
          compute_magnitude_quantile(remaining_m)};
}

/// Returns, for example, "mirrored (y reversed), turned by 90 degrees, multiplied by 0.001".
std::string describe_similarity(Complex factor, bool is_mirrored) {
  const double angle_rad = std::arg(factor), scale = std::abs(factor);
  std::string description = is_mirrored ? "mirrored (y reversed)" : "";
  const auto add = [&](const std::string& part) {
    description += (description.empty() ? "" : ", ") + part;
  };
  if (std::abs(angle_rad) > kMinYawError_rad) {
    add(fmt::format("turned by {:.3g} degrees", deg_from_rad(angle_rad)));
  }
  if (std::abs(scale - 1) > kMinScaleError) add(fmt::format("multiplied by {:.3g}", scale));
  return description.empty() ? "moved" : description;
}

Explanation fit_similarity(std::vector<Complex> truth_m, std::vector<Complex> fixes_m,
                           bool is_mirrored) {
  if (is_mirrored) {
    for (Complex& place_m : truth_m) place_m = std::conj(place_m);
  }
  const Complex truth_mean_m = compute_mean(truth_m), fix_mean_m = compute_mean(fixes_m);
  Complex product = 0;
  double square = 0;
  for (std::size_t i = 0; i < truth_m.size(); ++i) {
    product += std::conj(truth_m[i] - truth_mean_m) * (fixes_m[i] - fix_mean_m);
    square += std::norm(truth_m[i] - truth_mean_m);
  }
  const Complex factor = square > 0 ? product / square : 1;
  std::vector<Complex> remaining_m;
  for (std::size_t i = 0; i < truth_m.size(); ++i) {
    remaining_m.push_back(fixes_m[i] - fix_mean_m - factor * (truth_m[i] - truth_mean_m));
  }
  // Fixes at one place agree with any truth that is multiplied by 0.
  for (Complex& place_m : fixes_m) place_m -= fix_mean_m;
  const double error_m = compute_magnitude_quantile(remaining_m);
  const bool is_explained = error_m < kMaxRemainingRatio * compute_magnitude_quantile(fixes_m);
  return {describe_similarity(factor, is_mirrored),
          is_explained ? error_m : std::numeric_limits<double>::infinity()};
}

/// Returns the errors against the truth of another row, `shift` rows further.
Explanation fit_shifted_rows(const std::vector<Complex>& fixes_m,
                             const std::vector<FixError>& errors,
                             const std::vector<TruthRow>& truth, std::ptrdiff_t shift) {
  std::vector<Complex> remaining_m;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(errors[i].truth) + shift;
    if (row < 0 || row >= std::ssize(truth)) continue;
    remaining_m.push_back(fixes_m[i] - to_complex(truth[static_cast<std::size_t>(row)].xy_m));
  }
  return {shift > 0 ? "those of the next row" : "those of the previous row",
          compute_magnitude_quantile(remaining_m)};
}

std::string describe_positions(const FileRows<FixRow>& fixes, const FileRows<TruthRow>& truth,
                               const std::vector<FixError>& errors) {
  std::vector<Complex> errors_m, truth_m, fixes_m;
  for (const FixError& error : errors) {
    errors_m.push_back(to_complex(error.horizontal_m));
    truth_m.push_back(to_complex(truth.rows[error.truth].xy_m));
    fixes_m.push_back(to_complex(fixes.rows[error.fix].fix->pose.position_m.head<2>()));
  }
  const double error_m = compute_magnitude_quantile(errors_m);
  if (error_m < kMinPositionError_m) return "";
  for (const Explanation& found :
       {fit_shifted_rows(fixes_m, errors, truth.rows, 1),
        fit_shifted_rows(fixes_m, errors, truth.rows, -1), fit_offset(errors_m),
        fit_similarity(truth_m, fixes_m, false), fit_similarity(truth_m, fixes_m, true)}) {
    if (found.error_m >= kMaxRemainingRatio * error_m) continue;
    return fmt::format(
        "{}: the positions agree with the fixes to {:.3g} mm, in place of {:.3g} mm, if they are "
        "{}: "
        "check order, axes, origin and units of its rows, and those of the lamp map",
        truth.file.filename().string(), 1e3 * found.error_m, 1e3 * error_m, found.description);
  }
  return "";
}

std::string describe_heights(const FileRows<TruthRow>& truth, const std::vector<FixError>& errors) {
  auto errors_m =
      collect_component(errors, [](const FixError& error) { return error.height_m; }).values;
  if (errors_m.size() < kMinFixes) return "";
  const double offset_m = lower_median(errors_m);
  std::vector<double> remaining_m;
  remaining_m.reserve(errors_m.size());
  for (const double error_m : errors_m) remaining_m.push_back(std::abs(error_m - offset_m));
  if (std::abs(offset_m) < kMinHeightError_m ||
      compute_quantile(std::move(remaining_m)) >= kMaxRemainingRatio * std::abs(offset_m))
    return "";
  return fmt::format(
      "{}: z_m: the heights of the fixes differ by {:+.1f} mm in all captures: check from where it "
      "and the heights of the lamps are measured, and the focal length",
      truth.file.filename().string(), 1e3 * offset_m);
}

std::string describe_yaw(const FileRows<FixRow>& fixes, const FileRows<TruthRow>& truth,
                         const std::vector<FixError>& errors) {
  std::vector<double> fix_rad, truth_rad, error_rad;
  for (const FixError& error : errors) {
    if (!error.yaw_rad) continue;
    fix_rad.push_back(fixes.rows[error.fix].fix->pose.yaw_rad);
    truth_rad.push_back(*truth.rows[error.truth].yaw_rad);
    error_rad.push_back(std::abs(*error.yaw_rad));
  }
  if (error_rad.size() < kMinFixes) return "";
  const double magnitude_rad = compute_quantile(std::move(error_rad));
  if (magnitude_rad < kMinYawError_rad) return "";
  for (const double sense : {1.0, -1.0}) {
    Complex sum = 0;
    for (std::size_t i = 0; i < fix_rad.size(); ++i) {
      sum += std::polar(1.0, fix_rad[i] - sense * truth_rad[i]);
    }
    const double offset_rad = std::arg(sum);
    std::vector<double> remaining_rad;
    for (std::size_t i = 0; i < fix_rad.size(); ++i) {
      remaining_rad.push_back(
          std::abs(wrap_angle_rad(fix_rad[i] - sense * truth_rad[i] - offset_rad)));
    }
    if (compute_quantile(std::move(remaining_rad)) >= kMaxRemainingRatio * magnitude_rad) continue;
    return fmt::format(
        "{}: yaw_rad: it agrees with the fixes if {}{:+.1f} degrees are added: check "
        "its zero and sense, and whether images are turned",
        truth.file.filename().string(), sense < 0 ? "its sign is changed and " : "",
        deg_from_rad(offset_rad));
  }
  return "";
}

}  // namespace

std::vector<std::string> describe_systematic_errors(const FileRows<FixRow>& fixes,
                                                    const FileRows<TruthRow>& truth,
                                                    const std::vector<FixError>& errors) {
  if (errors.size() < kMinFixes) return {};
  std::vector<std::string> found{describe_positions(fixes, truth, errors),
                                 describe_heights(truth, errors),
                                 describe_yaw(fixes, truth, errors)};
  std::erase(found, std::string());
  return found;
}

}  // namespace vlp
