// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/errors/line_fit.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "captures/truth_table.h"

namespace vlp {
namespace {

/// Returns x and y of the fixes, a column each.
Eigen::Matrix2Xd collect_points_m(const std::vector<FixRow>& fixes) {
  std::vector<double> values_m;
  for (const FixRow& row : fixes) {
    if (!row.fix) continue;
    const Eigen::Vector3d& place_m = row.fix->pose.position_m;
    values_m.insert(values_m.end(), {place_m.x(), place_m.y()});
  }
  return Eigen::Matrix2Xd::Map(values_m.data(), 2, std::ssize(values_m) / 2);
}

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

}  // namespace

std::optional<LineFit> fit_line_to_fixes(const std::vector<FixRow>& fixes,
                                         const CommandedLine& commanded_m) {
  const Eigen::Matrix2Xd points_m = collect_points_m(fixes);
  if (points_m.cols() < 2) return std::nullopt;
  const Eigen::Vector2d mean_m = points_m.rowwise().mean();
  const Eigen::Matrix2Xd from_mean_m = points_m.colwise() - mean_m;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes;
  axes.computeDirect(from_mean_m * from_mean_m.transpose());
  const double across_m2 = std::max(0.0, axes.eigenvalues()[0]), along_m2 = axes.eigenvalues()[1];
  if (!(along_m2 > 0) || along_m2 < 2 * across_m2) return std::nullopt;

  const Eigen::Vector2d commanded = commanded_m[1] - commanded_m[0];
  Eigen::Vector2d direction = axes.eigenvectors().col(1);
  if (direction.dot(commanded) < 0) direction = -direction;
  const Eigen::RowVectorXd along_m = direction.transpose() * from_mean_m;
  const CommandedLine line_m{mean_m + along_m.minCoeff() * direction,
                             mean_m + along_m.maxCoeff() * direction};
  const Path path{{commanded_m[0], commanded_m[1]}, {}};
  std::vector<double> distances_m;
  distances_m.reserve(kLineSamples);
  for (int i = 0; i < kLineSamples; ++i) {
    const Eigen::Vector2d point_m =
        line_m[0] + i / double{kLineSamples - 1} * (line_m[1] - line_m[0]);
    distances_m.push_back((point_m - project_onto_path(path, point_m).xy_m).norm());
  }
  return LineFit{line_m, std::atan2(cross(commanded, direction), commanded.dot(direction)),
                 std::sqrt(across_m2 / static_cast<double>(points_m.cols())),
                 summarize_errors(distances_m), list_percentiles(distances_m)};
}

}  // namespace vlp
