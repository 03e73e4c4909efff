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
#include "captures/path_table.h"
#include "captures/truth_table.h"

namespace vlp {

/// How wrong a fix is: fix minus truth, in the world.
struct FixError {
  std::size_t fix;  // of the rows of fixes
  Eigen::Vector2d horizontal_m;
  /// Where the truth says the height, or the yaw.
  std::optional<double> height_m, yaw_rad;
  /// Errors of one unit go together, those of two are taken for independent: the station, or the
  /// run of fixes along a path.
  std::size_t unit;
  /// Of the rows of the truth; 0 when there is none.
  std::size_t truth = 0;
};

struct FixErrors {
  /// Captures that should have a fix.
  std::size_t captures = 0;
  /// Those without, by their status.
  std::map<std::string, std::size_t> missing;
  /// In the order of the fixes.
  std::vector<FixError> errors;
};

/// A table and the file it came from, for what there is to say about its rows.
template <typename Row>
struct FromFile {
  std::filesystem::path file;
  std::vector<Row> rows;
};

/// Errors by image. Captures are the truth's; one that has no row in the fixes is missing with the
/// status "no row". Units are stations: captures whose true places are within `station_m`. Throws
/// InputError when images of the fixes are not in the truth: how many, and where the first stands.
FixErrors errors_against_truth(const FromFile<FixRow>& fixes, const FromFile<TruthRow>& truth,
                               double station_m);

/// Errors against the nearest point of a path, seen from above: what they are along the path does
/// not show. Captures are the rows of the fixes. Units are kPathRuns runs of as many consecutive
/// fixes, because errors that follow each other on a drive are alike (non-overlapping batch means;
/// Schmeiser, "Batch Size Effects in the Analysis of Simulation Output", 1982, who advises 10 to
/// 30); single fixes when there are no more.
inline constexpr std::size_t kPathRuns = 30;
FixErrors errors_against_path(const std::vector<FixRow>& fixes, const Path& path);

}  // namespace vlp
