// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/check_outliers.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>

#include "geometry/median.h"

namespace vlp {
namespace {

/// Minimum number of errors for a typical value.
constexpr std::size_t kMinErrors = 5;
/// Ratio to the median error.
constexpr double kMinRatio = 8;
constexpr double kMmPerM = 1e3;

/// Smaller residuals are acceptable: stations accept a rotation in place with this average.
constexpr double kMinResidual_px = 0.2;

/// Returns names of images with runs of successive captures joined: "0000.png to 0004.png,
/// 0010.png". A capture that is not listed ends a run.
std::string join_images(const std::vector<CaptureName>& captures) {
  constexpr std::size_t max_groups = 5;
  std::vector<std::string> groups;
  for (std::size_t begin = 0; begin < captures.size();) {
    std::size_t end = begin + 1;
    while (end < captures.size() && captures[end].index == captures[end - 1].index + 1) ++end;
    groups.push_back(captures[begin].image);
    if (end > begin + 1) {
      groups.back().append(end > begin + 2 ? " to " : ", ").append(captures[end - 1].image);
    }
    begin = end;
  }
  if (groups.size() <= max_groups) return fmt::format("{}", fmt::join(groups, ", "));
  const std::size_t more = groups.size() - max_groups;
  groups.resize(max_groups);
  return fmt::format("{} and {} more groups", fmt::join(groups, ", "), more);
}

/// Captures with gross errors, and the errors of all and of the other captures.
struct Outliers {
  std::vector<CaptureName> captures;
  double max = 0;
  std::vector<double> all, others;
};

/// Collects the captures whose `value` is at least `min_value` and kMinRatio times the median; none
/// of few captures.
template <typename Measured>
Outliers collect_outliers(const std::vector<Measured>& measured, double Measured::*value,
                          double min_value) {
  Outliers found;
  if (measured.size() < kMinErrors) return found;
  for (const Measured& each : measured) found.all.push_back(each.*value);
  const double limit = std::max(min_value, kMinRatio * upper_median(found.all));
  for (const Measured& each : measured) {
    if (each.*value < limit) {
      found.others.push_back(each.*value);
      continue;
    }
    found.captures.push_back(each.capture);
    found.max = std::max(found.max, each.*value);
  }
  return found;
}

/// Horizontal error of a fix from three lamps or more, m, and its yaw.
struct PositionError {
  std::size_t fix;
  Eigen::Vector2d horizontal_m;
  double yaw_rad;
};

std::vector<PositionError> list_position_errors(const EvaluationInput& input) {
  constexpr int min_lamps = 3;
  std::vector<PositionError> errors;
  if (input.fixes.rows.empty()) return errors;
  for (const FixError& error : compute_fix_errors(input, input.fixes).errors) {
    const FixRow& row = input.fixes.rows[error.fix];
    if (row.lamps >= min_lamps)
      errors.push_back({error.fix, error.horizontal_m, row.fix->pose.yaw_rad});
  }
  return errors;
}

/// Positions of the ground truth in another order or frame.
struct OtherTruth {
  const char* description;
  std::vector<Eigen::Vector2d> positions_m;
};

/// Returns the positions in reverse order, displaced by one row, and with exchanged coordinates.
std::vector<OtherTruth> list_other_truths(const std::vector<Eigen::Vector2d>& positions_m) {
  std::vector<OtherTruth> others{{"in reverse order", {positions_m.rbegin(), positions_m.rend()}},
                                 {"one row too early", positions_m},
                                 {"one row too late", positions_m},
                                 {"with x and y exchanged", positions_m}};
  auto &early_m = others[1].positions_m, &late_m = others[2].positions_m;
  std::rotate(early_m.begin(), early_m.end() - 1, early_m.end());
  std::rotate(late_m.begin(), late_m.begin() + 1, late_m.end());
  for (Eigen::Vector2d& position_m : others[3].positions_m) position_m.reverseInPlace();
  return others;
}

/// Describes ground truth that is in another order or frame than the captures: the median distance
/// from the fixes is then less than a tenth. Returns an empty string if there is no such order.
std::string describe_wrong_order(const EvaluationInput& input) {
  std::vector<Eigen::Vector2d> fixes_m, truth_m;
  if (input.fixes.rows.empty() || !input.truth) return "";
  for (const FixError& error : compute_fix_errors(input, input.fixes).errors) {
    fixes_m.emplace_back(input.fixes.rows[error.fix].fix->pose.position_m.head<2>());
    truth_m.push_back(fixes_m.back() - error.horizontal_m);
  }
  if (fixes_m.size() < kMinErrors) return "";
  const auto median_distance_m = [&](const std::vector<Eigen::Vector2d>& positions_m) {
    std::vector<double> distances_m;
    for (std::size_t i = 0; i < fixes_m.size(); ++i)
      distances_m.push_back((fixes_m[i] - positions_m[i]).norm());
    return upper_median(distances_m);
  };
  constexpr double max_ratio = 0.1;
  const double limit_m = max_ratio * median_distance_m(truth_m);
  if (limit_m < max_ratio * kMinOutlierError_m) return "";
  for (const OtherTruth& other : list_other_truths(truth_m)) {
    if (median_distance_m(other.positions_m) >= limit_m) continue;
    // [STATION-21] `if they are taken` | rows or columns of the table exchanged | correct it
    return fmt::format(
        "the known positions agree with the fixes if they are taken {}: correct the "
        "table",
        other.description);
  }
  return "";
}

}  // namespace

std::string describe_wrong_positions(const EvaluationInput& input, double min_error_m) {
  if (std::string order = describe_wrong_order(input); !order.empty()) return order;
  std::vector<CaptureError> errors;
  for (const PositionError& error : list_position_errors(input)) {
    errors.push_back({{input.fixes.rows[error.fix].image, error.fix}, error.horizontal_m.norm()});
  }
  return describe_error_outliers(errors, min_error_m);
}

std::optional<CommonOffset> find_common_offset(const EvaluationInput& input) {
  constexpr double max_ratio = 1.0 / 3;
  const std::vector<PositionError> errors = list_position_errors(input);
  if (errors.size() < kMinErrors) return std::nullopt;
  const auto count = static_cast<double>(errors.size());
  const auto in_camera = [](const PositionError& error) -> Eigen::Vector2d {
    return Eigen::Rotation2Dd(-error.yaw_rad) * error.horizontal_m;
  };
  Eigen::Vector2d camera_offset_m(0, 0), world_offset_m(0, 0);
  for (const PositionError& error : errors) {
    camera_offset_m += in_camera(error) / count;
    world_offset_m += error.horizontal_m / count;
  }
  double squares = 0, camera_squares = 0, world_squares = 0;
  for (const PositionError& error : errors) {
    squares += error.horizontal_m.squaredNorm();
    camera_squares += (in_camera(error) - camera_offset_m).squaredNorm();
    world_squares += (error.horizontal_m - world_offset_m).squaredNorm();
  }
  const auto explains = [&](double offset_m, double left, double other_left) {
    constexpr double max_square_ratio = max_ratio * max_ratio;
    return offset_m >= kMinOutlierError_m && left <= max_square_ratio * squares &&
           left <= max_square_ratio * other_left;
  };
  if (explains(camera_offset_m.norm(), camera_squares, world_squares)) {
    return CommonOffset{camera_offset_m, true, errors.size()};
  }
  if (explains(world_offset_m.norm(), world_squares, camera_squares)) {
    return CommonOffset{world_offset_m, false, errors.size()};
  }
  return std::nullopt;
}

std::string describe_common_offset(const CommonOffset& offset) {
  constexpr double millimeters = 1e3;
  const Eigen::Vector2d offset_mm = millimeters * offset.offset_m;
  // [STATION-19] `lamps have moved` | lamps or known points moved | repair the station
  // [STATION-18] `check are off by` | common offset; if it rotates with the camera (FAIL): camera
  //   moved since the rotation, or other camera | repair unit or station
  return fmt::format(
      "all {} captures of the check are off by {:.1f} mm in one direction of the {} (x {:+.1f} mm, "
      "y {:+.1f} mm): {}",
      offset.captures, offset_mm.norm(), offset.in_camera ? "camera" : "room", offset_mm.x(),
      offset_mm.y(),
      offset.in_camera
          ? "it is loose in its housing or on its mount, or the captures are of another camera"
          : "the known points or the lamps have moved");
}

std::string describe_error_outliers(const std::vector<CaptureError>& errors, double min_error_m) {
  const Outliers outliers = collect_outliers(errors, &CaptureError::error_m, min_error_m);
  if (outliers.captures.empty()) return "";
  const double max_mm = kMmPerM * outliers.max, others_mm = kMmPerM * upper_median(outliers.others);
  if (outliers.captures.size() == 1) {
    // [STATION-19] `in its table`, `in their table`
    return fmt::format(
        "{} was not taken at the position in its table: its error is {:.1f} mm, that of others "
        "{:.2g} mm",
        outliers.captures.front().image, max_mm, others_mm);
  }
  return fmt::format(
      "captures {} have errors up to {:.1f} mm, the others {:.2g} mm: taken at other positions "
      "than those in their table, or by another camera",
      join_images(outliers.captures), max_mm, others_mm);
}

void add_residual(const Fix& fix, const std::string& image, std::size_t capture,
                  std::vector<CaptureResidual>& residuals) {
  constexpr int min_lamps = 3;
  if (fix.has_succeeded() && fix.lamps >= min_lamps)
    residuals.push_back({{image, capture}, fix.residual_px});
}

std::string describe_residual_outliers(const std::vector<CaptureResidual>& residuals) {
  const Outliers outliers =
      collect_outliers(residuals, &CaptureResidual::residual_px, kMinResidual_px);
  if (outliers.captures.size() < 2) return "";
  return fmt::format(
      "the lamps in captures {} do not fit lens and tilt of the others (residuals up to {:.2f} px, "
      "typically {:.2g} px): other camera, or covered lamps; repeat these captures",
      join_images(outliers.captures), outliers.max, upper_median(outliers.all));
}

}  // namespace vlp
