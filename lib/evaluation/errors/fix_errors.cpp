// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/errors/fix_errors.h"

#include <algorithm>

#include "captures/csv_reader.h"
#include "evaluation/errors/reference_points.h"
#include "geometry/angles.h"
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
  return assign_positions_to_reference_points(places_m, radius_m);
}

}  // namespace

FixErrors compute_fix_errors_against_truth(const FileRows<FixRow>& fixes,
                                           const FileRows<TruthRow>& truth, double radius_m) {
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
  return result;
}

FixErrors compute_fix_errors_against_path(const std::vector<FixRow>& fixes, const Path& path) {
  FixErrors result;
  result.captures = fixes.size();
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    if (!fixes[i].fix) {
      ++result.failures_by_status[fixes[i].status];
      continue;
    }
    const Eigen::Vector3d& place_m = fixes[i].fix->pose.position_m;
    const PathPoint nearest = find_nearest_point_on_path(path, place_m.head<2>());
    FixError error{i, place_m.head<2>() - nearest.xy_m, {}, {}, 0};
    if (nearest.z_m) error.height_m = place_m.z() - *nearest.z_m;
    result.errors.push_back(error);
  }
  const std::size_t count = result.errors.size(), runs = std::min(count, kPathRuns);
  for (std::size_t i = 0; i < count; ++i) result.errors[i].cluster = i * runs / count;
  return result;
}

void check_same_images_in_fixes(const FileRows<FixRow>& fixes, const FileRows<FixRow>& others) {
  const std::string question = "are both of the same captures?";
  match_rows(others, fixes, "", question);
  match_rows(fixes, others, "", question);
}

}  // namespace vlp
