// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <limits>

#include "calibration/intrinsics/intrinsics.h"

namespace vlp {

std::vector<Eigen::Vector2d> residuals_of(const BoardProblem& problem) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const Lens lens(problem.lens_model, problem.intrinsics);
  std::vector<Eigen::Vector2d> residuals(problem.points.size(), Eigen::Vector2d::Constant(nan));
  const std::size_t cols = static_cast<std::size_t>(problem.cols),
                    count = problem.points_of_a_board();
  const Eigen::Array2d last(problem.cols - 1, problem.rows - 1);
  for (std::size_t pose = 0; pose < problem.poses.size(); ++pose) {
    const Eigen::Vector3d& r = problem.poses[pose].rotation;
    const Eigen::Matrix3d rotation = Eigen::AngleAxisd(r.norm(), r.normalized()).toRotationMatrix();
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector3d& seen = problem.points[pose * count + i];
      if (seen.z() == BoardProblem::kUnseen) continue;
      const std::size_t col = i % cols, row = i / cols;
      const Eigen::Array2d node(static_cast<double>(col), static_cast<double>(row));
      const Eigen::Array2d share = 2 * node / last - 1;
      Eigen::Vector3d point;
      point << problem.spacing_m * node.matrix(), problem.warp_m.dot((1 - share.square()).matrix());
      const auto pixel = lens.project(rotation * point + problem.poses[pose].translation_m);
      if (pixel) residuals[pose * count + i] = seen.head<2>() - *pixel;
    }
  }
  return residuals;
}

}  // namespace vlp
