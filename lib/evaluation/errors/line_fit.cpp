// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/errors/line_fit.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "captures/path_table.h"

namespace vlp {
namespace {

struct Scatter {
  std::size_t count = 0;
  Eigen::Vector2d mean_m{0, 0};
  Eigen::Matrix2d matrix_m2 = Eigen::Matrix2d::Zero();
};

Scatter compute_scatter(const std::vector<FixRow>& fixes) {
  Scatter scatter;
  for (const FixRow& row : fixes) {
    if (!row.fix) continue;
    ++scatter.count;
    scatter.mean_m += row.fix->pose.position_m.head<2>();
  }
  if (scatter.count > 0) scatter.mean_m /= static_cast<double>(scatter.count);
  for (const FixRow& row : fixes) {
    if (!row.fix) continue;
    const Eigen::Vector2d from_mean_m = row.fix->pose.position_m.head<2>() - scatter.mean_m;
    scatter.matrix_m2 += from_mean_m * from_mean_m.transpose();
  }
  return scatter;
}

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

}  // namespace

std::optional<LineFit> fit_line(const std::vector<FixRow>& fixes,
                                const CommandedLine& commanded_m) {
  const Scatter scatter = compute_scatter(fixes);
  if (scatter.count < 2) return std::nullopt;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes;
  axes.computeDirect(scatter.matrix_m2);
  const double across_m2 = std::max(0.0, axes.eigenvalues()[0]), along_m2 = axes.eigenvalues()[1];
  if (!(along_m2 > 0) || along_m2 < 2 * across_m2) return std::nullopt;

  const Eigen::Vector2d commanded = commanded_m[1] - commanded_m[0];
  Eigen::Vector2d direction = axes.eigenvectors().col(1);
  if (direction.dot(commanded) < 0) direction = -direction;
  double first_m = std::numeric_limits<double>::infinity(), last_m = -first_m;
  for (const FixRow& row : fixes) {
    if (!row.fix) continue;
    const double along_m = direction.dot(row.fix->pose.position_m.head<2>() - scatter.mean_m);
    first_m = std::min(first_m, along_m);
    last_m = std::max(last_m, along_m);
  }
  const CommandedLine line_m{scatter.mean_m + first_m * direction,
                             scatter.mean_m + last_m * direction};
  const Path path{{commanded_m[0], commanded_m[1]}, {}};
  std::vector<double> distances_m;
  distances_m.reserve(kLineSamples);
  for (int i = 0; i < kLineSamples; ++i) {
    const Eigen::Vector2d point_m =
        line_m[0] + i / double{kLineSamples - 1} * (line_m[1] - line_m[0]);
    distances_m.push_back((point_m - find_nearest_on_path(path, point_m).xy_m).norm());
  }
  return LineFit{line_m, std::atan2(cross(commanded, direction), commanded.dot(direction)),
                 std::sqrt(across_m2 / static_cast<double>(scatter.count)),
                 compute_error_statistics(distances_m), compute_distribution(distances_m)};
}

}  // namespace vlp
