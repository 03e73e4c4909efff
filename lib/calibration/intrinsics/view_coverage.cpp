// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>

#include "calibration/intrinsics/calibration_report.h"

namespace vlp {
namespace {

std::size_t part_of(double pixel, int size_px, int parts) {
  const int part = static_cast<int>(pixel / size_px * parts);
  return static_cast<std::size_t>(std::clamp(part, 0, parts - 1));
}

}  // namespace

ViewCoverage coverage_of(const IntrinsicsSolution& solution, const IntrinsicsInput& input) {
  constexpr int cols = 8, rows = 6;
  const auto [width, height] = input.imager_px;
  ViewCoverage coverage;
  std::set<std::size_t> covered;
  for (const std::size_t view : solution.views) {
    for (const auto& corner : input.views[view]) {
      const double u = corner.pixel.x(), v = corner.pixel.y();
      ++coverage.corners[part_of(v, height, 3) * 3 + part_of(u, width, 3)];
      covered.insert(part_of(v, height, rows) * cols + part_of(u, width, cols));
    }
  }
  coverage.share = static_cast<double>(covered.size()) / (cols * rows);
  std::vector<Eigen::Vector3d> normals;
  for (const BoardPose& pose : solution.problem.poses) {
    // Away from the camera; where it leans to, the board is nearer.
    const Eigen::Vector3d normal =
        Eigen::AngleAxisd(pose.rotation.norm(), pose.rotation.normalized()) *
        Eigen::Vector3d::UnitZ();
    for (const Eigen::Vector3d& other : normals) {
      coverage.tilt_rad =
          std::max(coverage.tilt_rad, std::atan2(normal.cross(other).norm(), normal.dot(other)));
    }
    normals.push_back(normal);
    const double x_rad = std::atan2(normal.x(), normal.z());
    const double y_rad = std::atan2(normal.y(), normal.z());
    auto& [left, right, upper, lower] = coverage.tilts_rad;
    left = std::max(left, -x_rad);
    right = std::max(right, x_rad);
    upper = std::max(upper, -y_rad);
    lower = std::max(lower, y_rad);
  }
  return coverage;
}

std::string next_view(const ViewCoverage& coverage) {
  constexpr std::array places{"top left",    "top middle",    "top right",
                              "left middle", "middle",        "right middle",
                              "bottom left", "bottom middle", "bottom right"};
  constexpr std::array sides{"left", "right", "upper", "lower"};
  const auto place = std::min_element(coverage.corners.begin(), coverage.corners.end());
  const auto side = std::min_element(coverage.tilts_rad.begin(), coverage.tilts_rad.end());
  return std::string("the board in the ") +
         places[static_cast<std::size_t>(place - coverage.corners.begin())] +
         " of the image, its " +
         sides[static_cast<std::size_t>(side - coverage.tilts_rad.begin())] +
         " side 30 to 40 degrees nearer to the camera";
}

}  // namespace vlp
