// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/intrinsics.h"

#include <algorithm>
#include <limits>

#include <Eigen/Geometry>

#include "calibration/intrinsics/intrinsics_solver.h"

namespace vlp {

namespace {

IntrinsicsSolution make_failure(IntrinsicsStatus status) {
  return {status, {}, {}, {}, {}, 0, 0, 0};
}

}  // namespace

std::string_view describe(IntrinsicsStatus status) {
  switch (status) {
    case IntrinsicsStatus::ok:
      return "ok";
    case IntrinsicsStatus::too_few_views:
      return "fewer than three views can be used; add views of the board, tilted by 20 to 45 "
             "degrees "
             "to different sides and all over the image";
    case IntrinsicsStatus::all_parallel:
      return "all views show the board at the same angle, so that any focal length fits; add views "
             "with the board tilted by 20 to 45 degrees to different sides";
    case IntrinsicsStatus::no_solution:
      return "no lens fits the views; is board.yaml that of the board in the images?";
  }
  return "";
}

void IntrinsicsSolution::update_fit_statistics() {
  double squares = 0;
  corners = outliers = 0;
  const auto residuals = compute_reprojection_residuals(problem);
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    const double weight = problem.points[i].z();
    if (weight > 0) {
      squares += weight * weight * residuals[i].squaredNorm();
      ++corners;
    } else if (weight != BoardProblem::kUnseen) {
      ++outliers;
    }
  }
  rms_px = std::sqrt(squares / (2 * std::max(1, corners)));
}

IntrinsicsSolution solve_intrinsics(const IntrinsicsInput& input) {
  constexpr std::size_t max_starts = 4;
  if (input.views.size() < IntrinsicsSolver::kMinViews)
    return make_failure(IntrinsicsStatus::too_few_views);
  auto initial_focal_lengths_px = rank_initial_focal_lengths(input);
  initial_focal_lengths_px.resize(std::min(initial_focal_lengths_px.size(), max_starts));
  for (const double focal_px : initial_focal_lengths_px) {
    IntrinsicsSolver solver(input);
    if (!solver.solve_from_focal_length(focal_px)) continue;
    solver.initialize_with_symmetric_lens();
    if (!solver.refine_intrinsics() || !solver.scale_spline_regularization() ||
        !solver.correct_corners_and_solve_again() ||
        !solver.correct_tag_edge_displacements(DisplacementForm::constant) ||
        !solver.solve_board_warp() || !solver.reweight_corners() ||
        !solver.correct_corners_and_solve_again() ||
        !solver.correct_tag_edge_displacements(DisplacementForm::varying) ||
        !solver.reweight_corners() || !solver.scale_spline_regularization() ||
        !solver.reject_outliers() || !solver.scale_spline_regularization() ||
        !solver.rotate_camera_frame_to_optical_axis()) {
      continue;
    }
    IntrinsicsSolution solution = solver.make_solution();
    if (are_all_boards_parallel(solution.problem))
      return make_failure(IntrinsicsStatus::all_parallel);
    if (2 * solution.views.size() > input.views.size()) return solution;
  }
  return make_failure(IntrinsicsStatus::no_solution);
}

IntrinsicsSolution solve_intrinsics_from_half_of_views(const IntrinsicsSolution& whole,
                                                       std::size_t first) {
  const BoardProblem& all = whole.problem;
  const std::size_t parts = all.poses.size() / whole.views.size();
  const std::size_t points = parts * all.points_per_board();
  IntrinsicsSolution half = whole;
  half.views.clear();
  half.edge_shifts_px.clear();
  half.problem.poses.clear();
  half.problem.points.clear();
  const auto copy_part = [](const auto& from, std::size_t view, std::size_t count, auto& to) {
    const auto begin = from.begin() + static_cast<std::ptrdiff_t>(view * count);
    to.insert(to.end(), begin, begin + static_cast<std::ptrdiff_t>(count));
  };
  for (std::size_t view = first; view < whole.views.size(); view += 2) {
    copy_part(whole.views, view, 1, half.views);
    copy_part(whole.edge_shifts_px, view, 1, half.edge_shifts_px);
    copy_part(all.poses, view, parts, half.problem.poses);
    copy_part(all.points, view, points, half.problem.points);
  }
  if (half.views.size() < IntrinsicsSolver::kMinViews) {
    return make_failure(IntrinsicsStatus::too_few_views);
  }
  if (!solve_lens_parameters(half.problem, half.solved_for)) {
    return make_failure(IntrinsicsStatus::no_solution);
  }
  if (are_all_boards_parallel(half.problem)) return make_failure(IntrinsicsStatus::all_parallel);
  half.update_fit_statistics();
  return half;
}

std::vector<Eigen::Vector2d> compute_reprojection_residuals(const BoardProblem& problem) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const Lens lens(problem.lens_model, problem.intrinsics);
  std::vector<Eigen::Vector2d> residuals(problem.points.size(), Eigen::Vector2d::Constant(nan));
  const std::size_t cols = static_cast<std::size_t>(problem.cols),
                    count = problem.points_per_board();
  const Eigen::Array2d last(problem.cols - 1, problem.rows - 1);
  for (std::size_t pose = 0; pose < problem.poses.size(); ++pose) {
    const Eigen::Vector3d& r = problem.poses[pose].rotation;
    const Eigen::Matrix3d rotation = Eigen::AngleAxisd(r.norm(), r.normalized()).toRotationMatrix();
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector3d& seen = problem.points[pose * count + i];
      if (seen.z() == BoardProblem::kUnseen) continue;
      const std::size_t col = i % cols, row = i / cols;
      const Eigen::Array2d node(static_cast<double>(col), static_cast<double>(row));
      const Eigen::Array2d normalized_position = 2 * node / last - 1;
      Eigen::Vector3d point;
      point << problem.spacing_m * node.matrix(),
          problem.warp_m.dot((1 - normalized_position.square()).matrix());
      const auto pixel = lens.project(rotation * point + problem.poses[pose].translation_m);
      if (pixel) residuals[pose * count + i] = seen.head<2>() - *pixel;
    }
  }
  return residuals;
}

}  // namespace vlp
