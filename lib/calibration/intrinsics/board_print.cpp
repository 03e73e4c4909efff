// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/board_print.h"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "calibration/intrinsics/intrinsics.h"
#include "calibration/intrinsics/projection_difference.h"
#include "geometry/polygon.h"

namespace vlp {
namespace {

/// Returns the points of a board in the order of BoardProblem, row by row.
std::vector<Eigen::Vector3d> make_board_points(const BoardProblem& problem) {
  std::vector<Eigen::Vector3d> points;
  points.reserve(problem.points_per_board());
  for (int j = 0; j < problem.rows; ++j) {
    for (int i = 0; i < problem.cols; ++i) {
      const Eigen::Array2d normalized_position(2.0 * i / (problem.cols - 1) - 1,
                                               2.0 * j / (problem.rows - 1) - 1);
      points.emplace_back(i * problem.spacing_m, j * problem.spacing_m,
                          problem.warp_m.dot((1 - normalized_position.square()).matrix()));
    }
  }
  return points;
}

}  // namespace

std::optional<AspectErrorEffect> estimate_aspect_effect(const IntrinsicsSolution& solution,
                                                        double print_sd,
                                                        const ImageRegion& region) {
  const double aspect_error = std::numbers::sqrt2 * print_sd;
  const Lens lens = solution.fitted_lens();
  BoardProblem problem = solution.problem;
  const std::vector<Eigen::Vector3d> points = make_board_points(problem);
  for (std::size_t pose = 0; pose < problem.poses.size(); ++pose) {
    const Eigen::Vector3d& rotation_vector = problem.poses[pose].rotation;
    const Eigen::AngleAxisd rotation(rotation_vector.norm(), rotation_vector.normalized());
    for (std::size_t i = 0; i < points.size(); ++i) {
      Eigen::Vector3d& measured = problem.points[pose * points.size() + i];
      if (measured.z() < 0) continue;
      const Eigen::Vector3d in_camera = rotation * points[i] + problem.poses[pose].translation_m;
      const Eigen::Vector3d along = rotation * Eigen::Vector3d::UnitX();
      const auto stated = lens.project_point(in_camera);
      const auto printed = lens.project_point(in_camera + aspect_error * points[i].x() * along);
      if (!stated || !printed) return {};
      measured.head<2>() += *stated - *printed;
    }
  }
  if (!solve_board_problem(problem, solution.solved_parameters)) return {};
  const Lens printed(problem.lens_model, problem.intrinsics);
  const auto everywhere = compare_projections(lens, printed, problem.imager_px,
                                              [](const Eigen::Vector2d&) { return 1.0; });
  const auto in_region =
      compare_projections(lens, printed, problem.imager_px, [&](const Eigen::Vector2d& pixel) {
        return region.empty() || polygon_contains(region, pixel)
                   ? 1.0
                   : std::numeric_limits<double>::infinity();
      });
  if (!everywhere || !in_region) return {};
  const auto count = static_cast<Eigen::Index>(problem.intrinsics.size());
  return AspectErrorEffect{
      Eigen::Map<const Eigen::VectorXd>(problem.intrinsics.data(), count) -
          Eigen::Map<const Eigen::VectorXd>(solution.problem.intrinsics.data(), count),
      everywhere->rms_px, in_region->mean_px, in_region->worst_px};
}

}  // namespace vlp
