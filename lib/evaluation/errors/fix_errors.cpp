// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/errors/fix_errors.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

#include "captures/csv_reader.h"
#include "evaluation/errors/reference_points.h"
#include "geometry/angles.h"
#include "geometry/median.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

/// Returns the row of `table` for the image of each fix. Throws InputError if an image has none;
/// `hint` follows the name of the table's file in the message, `question` ends it.
template <typename Row>
std::vector<std::size_t> match_rows(const FileRows<FixRow>& fixes, const FileRows<Row>& table,
                                    const std::string& hint, const std::string& question) {
  NameIndex images(table.rows.size());
  for (const Row& row : table.rows) images.insert_unique_name(row.image);
  std::vector<std::size_t> rows;
  rows.reserve(fixes.rows.size());
  std::size_t num_unmatched = 0;
  const FixRow* first = nullptr;
  for (const FixRow& fix : fixes.rows) {
    const auto row = images.find_name_index(fix.image);
    rows.push_back(row.value_or(0));
    if (row) continue;
    ++num_unmatched;
    if (first == nullptr) first = &fix;
  }
  if (first == nullptr) return rows;
  // [FILE-6]
  throw InputError(fixes.file, first->line, "image",
                   "'" + first->image + "' is not in " + table.file.string() + hint + "; " +
                       std::to_string(num_unmatched) + " of " + std::to_string(fixes.rows.size()) +
                       " images are not: " + question);
}

std::vector<std::size_t> group_captures(const std::vector<TruthRow>& truth, double radius_m) {
  std::vector<Eigen::Vector3d> places_m;
  places_m.reserve(truth.size());
  for (const TruthRow& row : truth) {
    places_m.emplace_back(row.xy_m.x(), row.xy_m.y(), row.z_m.value_or(0));
  }
  return group_positions(places_m, radius_m);
}

/// Unit that tables can have by mistake in place of that of the column.
struct MistakenUnit {
  const char* name;
  double units_per_si;
};
constexpr std::array<MistakenUnit, 4> kMistakenLengths{
    {{"mm", 1e3}, {"cm", 1e2}, {"inches", 1 / 0.0254}, {"feet", 1 / 0.3048}}};
constexpr std::array<MistakenUnit, 1> kMistakenAngles{{{"degrees", deg_from_rad(1)}}};

/// Column of a ground truth, and the ratio of its errors before and after a conversion.
struct TruthColumn {
  const char* name;
  std::span<const MistakenUnit> mistaken_units;
  const char* unit;
  /// Smallest median error that a mistaken unit can explain.
  double min_error;
  /// Returns the magnitude of the error of a pose if the truth is divided by a factor;
  /// std::nullopt if the truth lacks the column.
  std::optional<double> (*compute_error)(const Pose& pose, const TruthRow& truth, double factor);
};
const std::array<TruthColumn, 3> kTruthColumns{
    {{"x_m", kMistakenLengths, "m", 0.5,
      [](const Pose& pose, const TruthRow& truth, double factor) -> std::optional<double> {
        return (pose.position_m.head<2>() - truth.xy_m / factor).norm();
      }},
     {"z_m", kMistakenLengths, "m", 0.5,
      [](const Pose& pose, const TruthRow& truth, double factor) -> std::optional<double> {
        if (!truth.z_m) return std::nullopt;
        return std::abs(pose.position_m.z() - *truth.z_m / factor);
      }},
     {"yaw_rad", kMistakenAngles, "rad", 0.2,
      [](const Pose& pose, const TruthRow& truth, double factor) -> std::optional<double> {
        if (!truth.yaw_rad) return std::nullopt;
        return std::abs(wrap_angle_rad(pose.yaw_rad - *truth.yaw_rad / factor));
      }}}};

/// Throws InputError if a conversion of a column reduces the median of its errors to less than a
/// twentieth, and to less than a fifth of the median of the fixes: fixes near 0 agree with any
/// values that a conversion reduces to 0.
void check_units(const FixErrors& errors, const FileRows<FixRow>& fixes,
                 const FileRows<TruthRow>& truth) {
  constexpr double max_ratio = 0.05, max_ratio_to_fixes = 0.2;
  constexpr std::size_t min_fixes = 3;
  for (const TruthColumn& column : kTruthColumns) {
    const auto compute_median = [&](double factor) -> std::optional<double> {
      const auto values = collect_component(errors.errors, [&](const FixError& error) {
                            return column.compute_error(fixes.rows[error.fix].fix->pose,
                                                        truth.rows[error.truth], factor);
                          }).values;
      return values.size() < min_fixes ? std::nullopt : std::optional(lower_median(values));
    };
    const auto error = compute_median(1);
    if (!error || *error < column.min_error) continue;
    const auto find_error = [&](const MistakenUnit& unit) {
      return *compute_median(unit.units_per_si);
    };
    const MistakenUnit& unit = *std::ranges::min_element(column.mistaken_units, {}, find_error);
    const double size_of_fixes = *compute_median(std::numeric_limits<double>::infinity());
    if (find_error(unit) < std::min(max_ratio * *error, max_ratio_to_fixes * size_of_fixes)) {
      // [FILE-3] `agree with the fixes`
      throw InputError(truth.file, truth.rows.front().line, column.name,
                       "the values agree with the fixes if they are in " + std::string(unit.name) +
                           "; convert them to " + column.unit);
    }
  }
}

}  // namespace

FixErrors compare_with_truth(const FileRows<FixRow>& fixes, const FileRows<TruthRow>& truth,
                             double radius_m) {
  const std::string hint =
      truth.rows.empty() ? "" : ", whose first is '" + truth.rows.front().image + "'";
  const std::vector<std::size_t> truth_rows =
      match_rows(fixes, truth, hint, "is it the truth of these captures?");
  const std::vector<std::size_t> stations = group_captures(truth.rows, radius_m);
  FixErrors result;
  result.captures = truth.rows.size();
  result.errors.reserve(fixes.rows.size());
  for (std::size_t i = 0; i < fixes.rows.size(); ++i) {
    const FixRow& row = fixes.rows[i];
    if (!row.fix) {
      ++result.failures_by_status[row.status];
      continue;
    }
    const TruthRow& true_row = truth.rows[truth_rows[i]];
    const Pose& pose = row.fix->pose;
    FixError error{i,
                   pose.position_m.head<2>() - true_row.xy_m,
                   {},
                   {},
                   stations[truth_rows[i]],
                   truth_rows[i]};
    if (true_row.z_m) error.height_m = pose.position_m.z() - *true_row.z_m;
    if (true_row.yaw_rad) error.yaw_rad = wrap_angle_rad(pose.yaw_rad - *true_row.yaw_rad);
    result.errors.push_back(error);
  }
  if (truth.rows.size() > fixes.rows.size()) {
    result.failures_by_status["no row"] = truth.rows.size() - fixes.rows.size();
  }
  check_units(result, fixes, truth);
  return result;
}

FixErrors compare_with_path(const std::vector<FixRow>& fixes, const Path& path) {
  FixErrors result;
  result.captures = fixes.size();
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    if (!fixes[i].fix) {
      ++result.failures_by_status[fixes[i].status];
      continue;
    }
    const Eigen::Vector3d& place_m = fixes[i].fix->pose.position_m;
    const PathPoint nearest = project_onto_path(path, place_m.head<2>());
    FixError error{i, place_m.head<2>() - nearest.xy_m, {}, {}, 0};
    if (nearest.z_m) error.height_m = place_m.z() - *nearest.z_m;
    result.errors.push_back(error);
  }
  const std::size_t count = result.errors.size(), runs = std::min(count, kPathRuns);
  for (std::size_t i = 0; i < count; ++i) result.errors[i].cluster = i * runs / count;
  return result;
}

void check_same_images(const FileRows<FixRow>& fixes, const FileRows<FixRow>& others) {
  const std::string question = "are both of the same captures?";
  match_rows(others, fixes, "", question);
  match_rows(fixes, others, "", question);
}

}  // namespace vlp
