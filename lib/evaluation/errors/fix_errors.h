// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "captures/fixes_table.h"
#include "captures/truth_table.h"

namespace vlp {

/// Error of a fix: fix minus ground truth, in the world.
struct FixError {
  std::size_t fix;  // index into the rows of fixes
  Eigen::Vector2d horizontal_m;
  /// Errors of height, m, and yaw, rad: fix minus ground truth. std::nullopt if the ground truth
  /// lacks the quantity.
  std::optional<double> height_m, yaw_rad;
  /// Cluster of correlated errors; errors of different clusters are assumed independent. It is a
  /// reference point, or a run of fixes along a path.
  std::size_t cluster;
  /// Index into the rows of the ground truth; 0 without one.
  std::size_t truth = 0;
};

/// One component of errors, with the cluster of each error.
struct ErrorComponent {
  std::vector<double> values;
  std::vector<std::size_t> clusters;
};

/// Collects `value_of(error)`, without the errors for which it returns std::nullopt.
template <typename Value>
ErrorComponent collect_component(const std::vector<FixError>& errors, const Value& value_of) {
  ErrorComponent component;
  for (const FixError& error : errors) {
    const std::optional<double> value = value_of(error);
    if (!value) continue;
    component.values.push_back(*value);
    component.clusters.push_back(error.cluster);
  }
  return component;
}

/// Errors of all fixes and the captures without a fix.
struct FixErrors {
  /// Number of captures that should have a fix.
  std::size_t captures = 0;
  /// Number of captures without a fix, by the word of their status.
  std::map<std::string, std::size_t> failures_by_status;
  /// Errors in the order of the fixes.
  std::vector<FixError> errors;
};

/// Table with the file it was read from, for messages about its rows.
template <typename Row>
struct FileRows {
  std::filesystem::path file;
  std::vector<Row> rows;
};

/// Computes errors against a ground truth, matched by image.
///
/// The captures are those of the ground truth. Captures without a row in the fixes are missing with
/// the status "no row". Clusters are reference points: captures whose true positions are within
/// `radius_m`.
/// @throws InputError if images of the fixes are not in the ground truth, with the count and the
/// line of the first; if the ground truth agrees with the fixes only in another unit, such as mm
FixErrors compare_with_truth(const FileRows<FixRow>& fixes, const FileRows<TruthRow>& truth,
                             double radius_m);

/// Maximum number of clusters along a path, see compare_with_path().
inline constexpr std::size_t kPathRuns = 30;
/// Computes errors against the nearest point of a path, seen from above. Errors along the path are
/// not visible.
///
/// The captures are the rows of the fixes. Clusters are kPathRuns runs of equally many consecutive
/// fixes, because successive errors on a drive are correlated. If there are no more than kPathRuns
/// fixes, each is a cluster. Source: non-overlapping batch means; Schmeiser, "Batch Size Effects in
/// the Analysis of Simulation Output", 1982, recommends 10 to 30 batches.
FixErrors compare_with_path(const std::vector<FixRow>& fixes, const Path& path);

/// @throws InputError if the two files do not have rows of the same images, with the count and the
/// line of the first
void check_same_images(const FileRows<FixRow>& fixes, const FileRows<FixRow>& others);

}  // namespace vlp
