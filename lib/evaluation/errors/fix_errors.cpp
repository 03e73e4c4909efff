// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/errors/fix_errors.h"

#include <algorithm>

#include "captures/name_index.h"
#include "evaluation/errors/reference_points.h"
#include "geometry/angles.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

/// Finds rows of the ground truth by image; fastest for images in the order of the rows.
class TruthRowFinder {
 public:
  explicit TruthRowFinder(const std::vector<TruthRow>& truth) : truth_(truth) {}

  std::optional<std::size_t> operator()(const std::string& image) {
    if (next_ < truth_.size() && truth_[next_].image == image) return next_++;
    if (!index_) {
      index_.emplace(truth_.size());
      for (const TruthRow& row : truth_) index_->insert(row.image);
    }
    const auto found = index_->find(image);
    if (found) next_ = *found + 1;
    return found;
  }

 private:
  const std::vector<TruthRow>& truth_;
  std::size_t next_ = 0;
  std::optional<NameIndex> index_;
};

/// Returns the row of the ground truth for each fix.
std::vector<std::size_t> match_rows(const FromFile<FixRow>& fixes,
                                    const FromFile<TruthRow>& truth) {
  TruthRowFinder find_row(truth.rows);
  std::vector<std::size_t> rows;
  rows.reserve(fixes.rows.size());
  std::size_t num_unmatched = 0;
  const FixRow* first = nullptr;
  for (const FixRow& fix : fixes.rows) {
    const auto row = find_row(fix.image);
    rows.push_back(row.value_or(0));
    if (row) continue;
    ++num_unmatched;
    if (first == nullptr) first = &fix;
  }
  if (first != nullptr) {
    throw InputError(fixes.file, first->line, "image",
                     "'" + first->image + "' is not in " + truth.file.string() +
                         ", whose first is '" + truth.rows.front().image + "'; " +
                         std::to_string(num_unmatched) + " of " +
                         std::to_string(fixes.rows.size()) +
                         " images are not: is it the truth of these captures?");
  }
  return rows;
}

std::vector<std::size_t> group_captures(const std::vector<TruthRow>& truth, double station_m) {
  std::vector<Eigen::Vector3d> places_m;
  places_m.reserve(truth.size());
  for (const TruthRow& row : truth) {
    places_m.emplace_back(row.xy_m.x(), row.xy_m.y(), row.z_m.value_or(0));
  }
  return assign_reference_points(places_m, station_m);
}

}  // namespace

FixErrors errors_against_truth(const FromFile<FixRow>& fixes, const FromFile<TruthRow>& truth,
                               double station_m) {
  const std::vector<std::size_t> truth_rows = match_rows(fixes, truth);
  const std::vector<std::size_t> stations = group_captures(truth.rows, station_m);
  FixErrors result;
  result.captures = truth.rows.size();
  result.errors.reserve(fixes.rows.size());
  for (std::size_t i = 0; i < fixes.rows.size(); ++i) {
    const FixRow& row = fixes.rows[i];
    if (!row.fix) {
      ++result.missing[row.status];
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
    if (true_row.yaw_rad) error.yaw_rad = wrap_rad(pose.yaw_rad - *true_row.yaw_rad);
    result.errors.push_back(error);
  }
  if (truth.rows.size() > fixes.rows.size()) {
    result.missing["no row"] = truth.rows.size() - fixes.rows.size();
  }
  return result;
}

FixErrors errors_against_path(const std::vector<FixRow>& fixes, const Path& path) {
  FixErrors result;
  result.captures = fixes.size();
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    if (!fixes[i].fix) {
      ++result.missing[fixes[i].status];
      continue;
    }
    const Eigen::Vector3d& place_m = fixes[i].fix->pose.position_m;
    const NearestOnPath nearest = find_nearest_on_path(path, place_m.head<2>());
    FixError error{i, place_m.head<2>() - nearest.xy_m, {}, {}, 0};
    if (nearest.z_m) error.height_m = place_m.z() - *nearest.z_m;
    result.errors.push_back(error);
  }
  const std::size_t count = result.errors.size(), runs = std::min(count, kPathRuns);
  for (std::size_t i = 0; i < count; ++i) result.errors[i].cluster = i * runs / count;
  return result;
}

}  // namespace vlp
