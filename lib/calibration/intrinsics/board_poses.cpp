// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/board_poses.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "calibration/intrinsics/rotation_vector.h"
#include "detection/boards/opencv_boards_library.h"
#include "geometry/frames.h"
#include "geometry/median.h"

namespace vlp {
namespace {

using Corners = std::span<const BoardLattice::Corner>;

struct RigidPose {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation_m;

  Eigen::Vector3d to_camera(const Eigen::Vector3d& in_board_m) const {
    return rotation * in_board_m + translation_m;
  }
};

double square_residuals(Corners corners, const Lens& lens, const RigidPose& pose) {
  double squares = 0;
  for (const auto& corner : corners) {
    const auto pixel = lens.project_point(pose.to_camera(corner.in_board_m));
    if (!pixel) return INFINITY;
    squares += corner.weight * corner.weight * (*pixel - corner.pixel).squaredNorm();
  }
  return squares;
}

/// Returns the pose after a step that minimizes the linearized residuals; the rotation is updated
/// from the left.
std::optional<RigidPose> compute_pose_step(Corners corners, const Lens& lens, const RigidPose& pose,
                                           double damping) {
  Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 1> right = Eigen::Matrix<double, 6, 1>::Zero();
  for (const auto& corner : corners) {
    const Eigen::Vector3d point = pose.to_camera(corner.in_board_m);
    const auto projection = lens.project_with_jacobians(point);
    if (!projection) return {};
    const Eigen::Vector3d rotated = point - pose.translation_m;
    Eigen::Matrix<double, 2, 6> jacobian;
    jacobian << -projection->d_pixel_d_point * skew_symmetric_matrix(rotated),
        projection->d_pixel_d_point;
    jacobian *= corner.weight;
    normal += jacobian.transpose() * jacobian;
    right += jacobian.transpose() * (corner.weight * (corner.pixel - projection->pixel));
  }
  normal.diagonal() *= 1 + damping;
  const Eigen::Matrix<double, 6, 1> step = normal.ldlt().solve(right);
  if (!step.allFinite()) return {};
  const double angle = step.head<3>().norm();
  const Eigen::Vector3d axis =
      angle > 0 ? (step.head<3>() / angle).eval() : Eigen::Vector3d::UnitX();
  return RigidPose{Eigen::AngleAxisd(angle, axis) * pose.rotation,
                   pose.translation_m + step.tail<3>()};
}

std::optional<ViewPose> refine_pose(Corners corners, const Lens& lens, RigidPose pose) {
  constexpr int max_iterations = 20;
  constexpr double tolerance = 1e-4;  // relative reduction of the squares by a step
  double damping = 1e-4;
  double squares = square_residuals(corners, lens, pose);
  if (!std::isfinite(squares)) return {};
  for (int step = 0; step < max_iterations; ++step) {
    const auto next = compute_pose_step(corners, lens, pose, damping);
    const double next_squares = next ? square_residuals(corners, lens, *next) : INFINITY;
    if (next_squares < squares) {
      const bool has_converged = squares - next_squares < tolerance * squares;
      pose = *next;
      squares = next_squares;
      damping /= 10;
      if (has_converged) break;
    } else {
      damping *= 10;
    }
  }
  const Eigen::AngleAxisd rotation(pose.rotation);
  constexpr double no_rotation = 1e-9;  // mrcal divides by the angle
  return ViewPose{{rotation.axis() * std::max(rotation.angle(), no_rotation), pose.translation_m},
                  std::sqrt(squares / (2 * static_cast<double>(corners.size())))};
}

RigidPose make_rigid_pose(const PlanarPose& pose) {
  const Eigen::Vector3d r(pose.rotation_vector.val), t(pose.translation_m.val);
  const double angle = r.norm();
  const Eigen::Vector3d axis = angle > 0 ? (r / angle).eval() : Eigen::Vector3d::UnitX();
  return {Eigen::AngleAxisd(angle, axis).toRotationMatrix(), t};
}

}  // namespace

std::optional<ViewPose> estimate_view_pose(Corners corners, const Lens& lens) {
  // Rotates the camera towards the board, which may be 90 degrees off the axis.
  std::vector<std::pair<const BoardLattice::Corner*, Eigen::Vector3d>> rays;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const auto& corner : corners) {
    const auto ray = lens.unproject_pixel(corner.pixel);
    if (!ray) continue;
    rays.emplace_back(&corner, ray->direction.normalized());
    middle += rays.back().second;
  }
  const Eigen::Matrix3d turned_from_camera = level_rotation_from_zenith(middle);
  std::vector<cv::Point3d> in_board;
  std::vector<cv::Point2d> normalized;
  for (const auto& [corner, ray] : rays) {
    const Eigen::Vector3d rotated = turned_from_camera * ray;
    if (rotated.z() < 1e-3) continue;
    const Eigen::Vector2d z = rotated.hnormalized();
    in_board.emplace_back(corner->in_board_m.x(), corner->in_board_m.y(), 0);
    normalized.emplace_back(z.x(), z.y());
  }
  if (in_board.size() < 4) return {};
  std::optional<ViewPose> best;
  for (const PlanarPose& estimate : list_planar_poses(in_board, normalized)) {
    const RigidPose rotated = make_rigid_pose(estimate);
    const auto pose = refine_pose(corners, lens,
                                  {turned_from_camera.transpose() * rotated.rotation,
                                   turned_from_camera.transpose() * rotated.translation_m});
    if (pose && (!best || pose->rms_px < best->rms_px)) best = pose;
  }
  return best;
}

namespace {

/// Returns at most 12 evenly spaced views, which suffice to rank focal lengths.
IntrinsicsInput select_views(const IntrinsicsInput& input) {
  constexpr std::size_t max_views = 12;
  IntrinsicsInput selected = input;
  const std::size_t count = input.views.size();
  if (count <= max_views) return selected;
  selected.views.clear();
  for (std::size_t i = 0; i < max_views; ++i)
    selected.views.push_back(input.views[i * count / max_views]);
  return selected;
}

}  // namespace

InitialPoses estimate_board_poses(const IntrinsicsInput& input, const Lens& lens) {
  InitialPoses initial_poses;
  for (const auto& corners : input.views) {
    const auto pose = estimate_view_pose(corners, lens);
    initial_poses.poses.push_back(pose ? pose->camera_from_board : BoardPose{});
    initial_poses.rms_px.push_back(pose ? pose->rms_px : std::numeric_limits<double>::infinity());
  }
  return initial_poses;
}

Lens make_initial_lens(const IntrinsicsInput& input, double focal_px) {
  const auto [width, height] = input.imager_px;
  const std::array parameters{focal_px, focal_px, (width - 1) / 2.0, (height - 1) / 2.0};
  return Lens(LensModel::stereographic, parameters);
}

std::vector<double> rank_initial_focal_lengths(const IntrinsicsInput& input) {
  const IntrinsicsInput selected = select_views(input);
  std::vector<std::pair<double, double>> tried;
  constexpr int min_half_octaves = -5,
                max_half_octaves = 6;  // relative to the width of the image: 0.18 to 8
  for (int half_octaves = min_half_octaves; half_octaves <= max_half_octaves; ++half_octaves) {
    const double focal_px = input.imager_px[0] * std::exp2(half_octaves / 2.0);
    tried.emplace_back(
        upper_median(estimate_board_poses(selected, make_initial_lens(input, focal_px)).rms_px),
        focal_px);
  }
  std::sort(tried.begin(), tried.end());
  std::vector<double> order;
  order.reserve(tried.size());
  for (const auto& [rms_px, focal_px] : tried) order.push_back(focal_px);
  return order;
}

}  // namespace vlp
