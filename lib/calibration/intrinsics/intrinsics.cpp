// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/intrinsics.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include "calibration/intrinsics/board_poses.h"
#include "calibration/intrinsics/camera_imports.h"
#include "calibration/intrinsics/corner_variance.h"
#include "calibration/intrinsics/edge_corrections.h"
#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/rotation_vector.h"
#include "calibration/intrinsics/spline_fit.h"
#include "camera/lens_table.h"
#include "camera/spline_grid.h"
#include "geometry/median.h"

namespace vlp {

std::string_view describe_status(IntrinsicsStatus status) {
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

void IntrinsicsSolution::update_statistics() {
  double squares = 0;
  corners = outliers = 0;
  const auto residuals = compute_board_residuals(problem);
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

std::vector<Eigen::Vector2d> compute_board_residuals(const BoardProblem& problem) {
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
      const auto pixel = lens.project_point(rotation * point + problem.poses[pose].translation_m);
      if (pixel) residuals[pose * count + i] = seen.head<2>() - *pixel;
    }
  }
  return residuals;
}

namespace {

IntrinsicsSolution make_failure(IntrinsicsStatus status) {
  return {status, {}, {}, {}, {}, 0, 0, 0};
}

Eigen::Vector3d compute_board_normal(const BoardPose& pose) {
  return Eigen::AngleAxisd(pose.rotation.norm(), pose.rotation.normalized()) *
         Eigen::Vector3d::UnitZ();
}

void rotate_boards(std::vector<BoardPose>& poses, const Eigen::Matrix3d& new_from_old) {
  for (BoardPose& pose : poses) {
    const Eigen::AngleAxisd rotation(new_from_old * rotation_from_vector(pose.rotation));
    pose = {rotation.angle() * rotation.axis(), new_from_old * pose.translation_m};
  }
}

/// Returns true if all board normals lie within five degrees of each other.
bool are_boards_parallel(const BoardProblem& problem) {
  constexpr double min_rad = 0.09;  // five degrees
  double widest_rad = 0;
  for (const BoardPose& a : problem.poses) {
    for (const BoardPose& b : problem.poses) {
      const double cosine = compute_board_normal(a).dot(compute_board_normal(b));
      widest_rad = std::max(widest_rad, std::acos(std::clamp(cosine, -1.0, 1.0)));
    }
  }
  return widest_rad < min_rad;
}

/// Returns the limit of the RMS residual of a view, px, given those of all views.
double compute_max_view_rms(const std::vector<double>& rms) {
  constexpr double fair_px = 1, fair = 4;
  return std::max(fair_px, fair * upper_median(rms));
}

}  // namespace

/// Stages of solve_intrinsics(), in their order. Each returns false if it fails.
class IntrinsicsSolver {
 public:
  static constexpr std::size_t kMinViews = 3;

  explicit IntrinsicsSolver(const IntrinsicsInput& input);

  /// Stage 2, from an initial focal length.
  bool solve_from_focal(double focal_px);
  /// Selects the lens model of stage 3; the one of the input if it is not called.
  void set_lens_model(LensModel lens_model) { input_.lens_model = lens_model; }
  /// Splined lenses only: initializes stage 3 with the rotationally symmetric lens OPENCV_FISHEYE.
  /// Keeps the initial lens STEREOGRAPHIC if that fails.
  void initialize_spline();
  /// Stage 3.
  bool refine_intrinsics();
  /// Repeats stage 3 from the solution of another model if that fits clearly better, and keeps the
  /// better result: views with few tilts have local minima.
  void restart_if_worse(const std::optional<IntrinsicsSolver>& other);
  /// Splined lenses only: scales the regularization to the noise of the corners.
  bool scale_regularization();
  /// Stages 4 and 7: applies correct_curvature() to all views and solves again.
  bool apply_curvature();
  /// Stages 5 (DisplacementForm::constant) and 7 (DisplacementForm::varying): corrects the corners
  /// for fit_displacements() and solves again, at most twice, until the terms of the
  /// shifts are below 0.002 px.
  bool apply_displacements(DisplacementForm form);
  /// Stage 6: estimates the warp of the board if WarpChoice permits it.
  bool solve_board_warp();
  /// Stage 7: weights the corners by their variances (CornerWeights) if standard deviations of some
  /// corners are known.
  bool reweight_corners();
  /// Stage 7 once more, and stage 8. Without a spline, a single solve is enough for both.
  bool reweight_and_reject();
  /// Stage 9, splined lenses only. Returns true also if the rotation has not converged.
  bool align_to_axis();

  /// Returns the current solution.
  IntrinsicsSolution make_solution() const;

 private:
  /// A view of the input and a corner of it.
  using CornerOfView = std::pair<std::size_t, std::size_t>;

  Lens current_lens() const { return Lens(problem_.lens_model, problem_.intrinsics); }
  /// Estimates the pose of every view with a lens. Views without a pose are unused until the next
  /// call.
  void initialize_poses(const Lens& lens);
  /// Sets up the problem of the views used, at their initial poses.
  void set_up_problem(const Lens& lens);
  /// Computes the weights of stage 7. Returns false if they do not change.
  bool update_weights();
  /// Solves without outliers.
  bool reject_outliers();
  /// Returns the index of a corner in the points of the problem; `used` is the index of its view in
  /// used_.
  std::size_t compute_problem_index(std::size_t used, const BoardLattice::Corner& corner) const;
  /// Copies pixels and weights of the corners from the input to the problem; outliers are kept.
  void copy_corners();
  /// Returns the RMS residual of each view used, px, in the order of used_; infinity if not finite.
  std::vector<double> list_view_rms_px() const;
  /// Returns true if the lens projects all corners of most views. mrcal also solves for points
  /// behind the camera, and takes long.
  bool can_project_views() const;
  /// Returns the corners of tags with a corner whose residual differs from those of its neighbors.
  /// Skips views in which these would be more than a quarter of the corners.
  std::set<CornerOfView> list_outlier_tag_corners() const;
  /// If a view fits badly, re-estimates the poses of all views used and drops the worst of the
  /// views that still fit badly. Returns true if the problem has to be solved again.
  bool drop_bad_views();
  /// Reinstates dropped views that fit the current lens: a worse view had distorted the earlier
  /// lens. Returns true if there are any.
  bool reinstate_views();

  IntrinsicsInput input_;
  /// Mean shift by which the corners of each view of the input were corrected, px.
  std::vector<double> edge_displacements_px_;
  /// Parameters to estimate; the warp only after solve_board_warp().
  SolveOptions solved_parameters_{.core = true, .distortions = true};
  InitialPoses initial_poses_;
  std::vector<std::size_t> used_;
  std::vector<IntrinsicsSolution::DroppedView> dropped_;
  BoardProblem problem_{};
  /// Splined lenses only: parameters of OPENCV_FISHEYE fitted to the same corners, regardless of
  /// the quality of its fit; empty if it was not fitted.
  std::vector<double> symmetric_;
  /// Splined lenses only: corners that the lens would overfit where corners are sparse. Outliers
  /// from the start.
  std::set<CornerOfView> displaced_corners_;
};

IntrinsicsSolver::IntrinsicsSolver(const IntrinsicsInput& input) : input_(input) {
  for (std::size_t i = 0; i < input.views.size(); ++i) used_.push_back(i);
  edge_displacements_px_.assign(input.views.size(), 0);
}

bool IntrinsicsSolver::solve_from_focal(double focal_px) {
  constexpr int max_iterations = 4;
  constexpr double convergence = 1e-3;
  Lens lens = make_initial_lens(input_, focal_px);
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    const double before_px = lens.focal_px().x();
    initialize_poses(lens);
    if (used_.size() < kMinViews) return false;
    set_up_problem(lens);
    if (!solve_intermediate_stage(problem_, {.core = true})) return false;
    lens = this->current_lens();
    if (std::abs(lens.focal_px().x() / before_px - 1) < convergence) break;
  }
  return true;
}

void IntrinsicsSolver::initialize_spline() {
  if (!is_splined_lens_model(input_.lens_model)) return;
  IntrinsicsSolver symmetric = *this;
  symmetric.input_.lens_model = LensModel::fisheye;
  if (!symmetric.refine_intrinsics()) return;  // keeps STEREOGRAPHIC
  symmetric_ = symmetric.problem_.intrinsics;
  displaced_corners_ = symmetric.list_outlier_tag_corners();
  const Lens fisheye = symmetric.current_lens();
  for (const std::size_t view : used_) {
    if (const auto pose = estimate_view_pose(input_.views[view], fisheye)) {
      initial_poses_.poses[view] = pose->camera_from_board;
    }
  }
  const std::vector<double> core = fit_spline_core(fisheye, list_inlier_pixels(symmetric.problem_));
  // With too few control points, STEREOGRAPHIC with that core is used.
  problem_.intrinsics =
      fit_splined_lens(fisheye, input_.imager_px, input_.lens_model, core).value_or(core);
  problem_.lens_model = input_.lens_model;
  problem_.intrinsics.resize(num_lens_parameters(input_.lens_model), 0);
  // The axis, and two rays next to it that prevent a rotation about it.
  for (const double beside : {0.0, -0.25, 0.25}) {
    const Eigen::Vector2d pixel =
        fisheye.principal_point_px() + Eigen::Vector2d(beside * input_.imager_px[0], 0);
    if (const auto ray = fisheye.unproject_pixel(pixel))
      problem_.fixed_rays.push_back({pixel, ray->direction});
  }
  set_up_problem(current_lens());
}

bool IntrinsicsSolver::align_to_axis() {
  constexpr int max_iterations = 4;
  constexpr double tolerance_rad = 1e-4;  // 0.006 degrees
  if (symmetric_.empty()) return true;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    const auto pixels = list_inlier_pixels(problem_);
    BoardProblem symmetric = problem_;
    symmetric.lens_model = LensModel::fisheye;
    symmetric.intrinsics = symmetric_;
    const auto start =
        fit_lens_rotation(current_lens(), Lens(LensModel::fisheye, symmetric_), pixels);
    if (!start) return true;
    rotate_boards(symmetric.poses, *start);
    if (!solve_board_problem(symmetric,
                             {.core = true, .distortions = true, .warp = solved_parameters_.warp}))
      return true;
    const Lens fisheye(LensModel::fisheye, symmetric.intrinsics);
    symmetric_ = symmetric.intrinsics;
    const auto new_from_old = fit_lens_rotation(current_lens(), fisheye, pixels);
    if (!new_from_old) return true;
    const double turned_rad = Eigen::AngleAxisd(*new_from_old).angle();
    if (turned_rad < tolerance_rad) return true;
    for (auto& [pixel, ray] : problem_.fixed_rays) {
      if (const auto seen = current_lens().project_point(new_from_old->transpose() * ray))
        pixel = *seen;
    }
    rotate_boards(problem_.poses, *new_from_old);
    if (!solve_board_problem(problem_, solved_parameters_)) return false;
  }
  return true;
}

bool IntrinsicsSolver::refine_intrinsics() {
  constexpr int max_iterations = 6;
  constexpr std::size_t core = 4;
  problem_.lens_model = input_.lens_model;
  // The core of a splined lens would only compensate the control points; mrcal fixes it, too.
  if (is_splined_lens_model(input_.lens_model)) solved_parameters_.core = false;
  const std::size_t given = problem_.intrinsics.size();
  problem_.intrinsics.resize(num_lens_parameters(input_.lens_model), 0);
  const auto distortions = list_distortions(input_.lens_model);
  for (std::size_t i = given; i < core + distortions.size(); ++i) {
    problem_.intrinsics[i] = distortions[i - core].start;
  }
  bool convergence = false;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    if (!solve_board_problem(problem_, solved_parameters_)) return false;
    convergence = !drop_bad_views();
    if (convergence) break;
    if (used_.size() < kMinViews) return false;
    set_up_problem(current_lens());
  }
  if (reinstate_views()) {
    set_up_problem(current_lens());
  } else if (convergence) {
    return can_project_views();
  }
  return solve_board_problem(problem_, solved_parameters_) && can_project_views();
}

void IntrinsicsSolver::restart_if_worse(const std::optional<IntrinsicsSolver>& other) {
  constexpr double max_ratio = 1.5;
  const double rms_px = make_solution().rms_px;
  if (!other || rms_px <= max_ratio * other->make_solution().rms_px) return;
  IntrinsicsSolver restarted = *other;
  restarted.set_lens_model(input_.lens_model);
  Camera camera;
  camera.lens_model = other->problem_.lens_model;
  camera.imager_px = input_.imager_px;
  camera.intrinsics = other->problem_.intrinsics;
  try {
    restarted.problem_.intrinsics = convert_lens_model(camera, input_.lens_model).camera.intrinsics;
  } catch (const std::invalid_argument&) {
    return;  // no lens of the model is similar
  }
  const bool is_better = restarted.refine_intrinsics() && restarted.used_.size() >= used_.size() &&
                         restarted.make_solution().rms_px < rms_px;
  if (is_better) *this = std::move(restarted);
}

bool IntrinsicsSolver::scale_regularization() {
  constexpr int max_iterations = 3;
  constexpr double min_px = 0.01, convergence = 0.1;
  if (!is_splined_lens_model(problem_.lens_model)) return true;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    const double noise_px = std::clamp(make_solution().rms_px, min_px, 1.0);
    if (std::abs(noise_px / problem_.noise_px - 1) < convergence) break;
    problem_.noise_px = noise_px;
    if (!solve_board_problem(problem_, solved_parameters_)) return false;
  }
  return true;
}

std::size_t IntrinsicsSolver::compute_problem_index(std::size_t used,
                                                    const BoardLattice::Corner& corner) const {
  return (used * input_.lattice.num_board_parts() + corner.part) *
             input_.lattice.points_per_part() +
         corner.point;
}

void IntrinsicsSolver::copy_corners() {
  for (std::size_t i = 0; i < used_.size(); ++i) {
    for (const auto& corner : input_.views[used_[i]]) {
      Eigen::Vector3d& point = problem_.points[compute_problem_index(i, corner)];
      point << corner.pixel, std::copysign(corner.weight, point.z());
    }
  }
}

bool IntrinsicsSolver::apply_curvature() {
  constexpr double tolerance_px = 0.002;
  double max_px = 0;
  const Lens lens = this->current_lens();
  for (auto& view : input_.views) max_px = std::max(max_px, correct_curvature(view, lens));
  if (max_px < tolerance_px) return true;
  copy_corners();
  return solve_intermediate_stage(problem_, solved_parameters_);
}

bool IntrinsicsSolver::apply_displacements(DisplacementForm form) {
  constexpr int max_iterations = 2;
  constexpr double tolerance_px = 0.002;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    auto views = input_.views;
    for (auto& view : views) view = input_.lattice.apply_warp(std::move(view), problem_.warp_m);
    const auto shifts = fit_displacements(views, current_lens(), form);
    if (std::all_of(shifts.begin(), shifts.end(), [](const EdgeDisplacement& shift) {
          return shift.coefficients.lpNorm<Eigen::Infinity>() < tolerance_px;
        })) {
      return true;
    }
    for (std::size_t view = 0; view < input_.views.size(); ++view) {
      edge_displacements_px_[view] += correct_displacement(input_.views[view], shifts[view]);
    }
    copy_corners();
    if (!solve_intermediate_stage(problem_, solved_parameters_)) return false;
  }
  return true;
}

bool IntrinsicsSolver::solve_board_warp() {
  constexpr double min_reduction = 20;
  if (input_.warp == WarpChoice::off) return true;
  const auto squares = [](const IntrinsicsSolution& solution) {
    return solution.rms_px * solution.rms_px * 2 * solution.corners;
  };
  const IntrinsicsSolution flat = make_solution();
  solved_parameters_.warp = true;
  if (!solve_intermediate_stage(problem_, solved_parameters_)) return false;
  const IntrinsicsSolution with_warp = make_solution();
  if (input_.warp == WarpChoice::automatic &&
      squares(flat) - squares(with_warp) <= min_reduction * with_warp.rms_px * with_warp.rms_px) {
    problem_ = flat.problem;
    solved_parameters_.warp = false;
  }
  return true;
}

bool IntrinsicsSolver::update_weights() {
  const auto residuals = compute_board_residuals(problem_);
  std::vector<CornerError> known, unknown;
  for (std::size_t i = 0; i < used_.size(); ++i) {
    for (const auto& corner : input_.views[used_[i]]) {
      const Eigen::Vector2d& residual = residuals[compute_problem_index(i, corner)];
      if (!residual.allFinite()) continue;
      (corner.sd_px > 0 ? known : unknown).push_back({residual.squaredNorm() / 2, corner.sd_px});
    }
  }
  if (std::ranges::all_of(known, [](const auto& error) { return error.square_px2 == 0; })) {
    return false;
  }
  const CornerWeights weights(known, unknown);
  for (auto& view : input_.views) {
    for (auto& corner : view) corner.weight = weights.corner_weight(corner.sd_px);
  }
  copy_corners();
  return true;
}

bool IntrinsicsSolver::reweight_corners() {
  return !update_weights() || solve_intermediate_stage(problem_, solved_parameters_);
}

bool IntrinsicsSolver::reweight_and_reject() {
  if (is_splined_lens_model(problem_.lens_model))
    return reweight_corners() && scale_regularization() && reject_outliers();
  update_weights();
  return reject_outliers();
}

bool IntrinsicsSolver::reject_outliers() {
  // Without noise, residuals are caused by the regularization and are not outliers.
  constexpr double exact_px = 0.005;
  if (make_solution().rms_px < exact_px) return solve_board_problem(problem_, solved_parameters_);
  SolveOptions without_outliers = solved_parameters_;
  without_outliers.reject_outliers = true;
  return solve_board_problem(problem_, without_outliers) && std::isfinite(make_solution().rms_px);
}

IntrinsicsSolution IntrinsicsSolver::make_solution() const {
  IntrinsicsSolution result{IntrinsicsStatus::ok, problem_, used_, dropped_, {}, 0, 0, 0};
  result.solved_parameters = solved_parameters_;
  for (const std::size_t view : used_)
    result.edge_displacements_px.push_back(edge_displacements_px_[view]);
  result.update_statistics();
  return result;
}

void IntrinsicsSolver::initialize_poses(const Lens& lens) {
  initial_poses_ = estimate_board_poses(input_, lens);
  used_.clear();
  for (std::size_t i = 0; i < input_.views.size(); ++i) {
    if (std::isfinite(initial_poses_.rms_px[i])) used_.push_back(i);
  }
}

void IntrinsicsSolver::set_up_problem(const Lens& lens) {
  const BoardLattice& lattice = input_.lattice;
  problem_.lens_model = lens.lens_model();
  if (problem_.intrinsics.empty() || lens.lens_model() == LensModel::stereographic) {
    problem_.intrinsics = {lens.focal_px().x(), lens.focal_px().y(), lens.principal_point_px().x(),
                           lens.principal_point_px().y()};
  }
  problem_.imager_px = input_.imager_px;
  problem_.cols = lattice.lattice_cols();
  problem_.rows = lattice.lattice_rows();
  problem_.spacing_m = lattice.point_spacing_m();
  problem_.poses.clear();
  problem_.points.assign(used_.size() * lattice.num_board_parts() * lattice.points_per_part(),
                         {-1, -1, BoardProblem::kUnseen});
  for (std::size_t i = 0; i < used_.size(); ++i) {
    for (std::size_t part = 0; part < lattice.num_board_parts(); ++part) {
      problem_.poses.push_back(lattice.compute_part_pose(initial_poses_.poses[used_[i]], part));
    }
    const auto& corners = input_.views[used_[i]];
    for (std::size_t k = 0; k < corners.size(); ++k) {
      const double sign = displaced_corners_.contains({used_[i], k}) ? -1 : 1;
      problem_.points[compute_problem_index(i, corners[k])] << corners[k].pixel,
          sign * corners[k].weight;
    }
  }
}

bool IntrinsicsSolver::can_project_views() const {
  return std::isfinite(upper_median(list_view_rms_px()));
}

std::vector<double> IntrinsicsSolver::list_view_rms_px() const {
  const auto residuals = compute_board_residuals(problem_);
  const std::size_t count = input_.lattice.num_board_parts() * input_.lattice.points_per_part();
  std::vector<double> rms;
  for (std::size_t i = 0; i < used_.size(); ++i) {
    double squares = 0;
    for (std::size_t k = i * count; k < (i + 1) * count; ++k) {
      const double weight = problem_.points[k].z();
      if (weight > 0) squares += weight * weight * residuals[k].squaredNorm();
    }
    const double value =
        std::sqrt(squares / (2 * static_cast<double>(input_.views[used_[i]].size())));
    rms.push_back(std::isfinite(value) ? value : std::numeric_limits<double>::infinity());
  }
  return rms;
}

std::set<IntrinsicsSolver::CornerOfView> IntrinsicsSolver::list_outlier_tag_corners() const {
  constexpr std::size_t neighbors = 8;
  constexpr double sigmas = 8, min_px = 0.1, median_of_normal = 0.6745;
  // If OPENCV_FISHEYE does not fit the lens, the residuals of neighbors also differ from each
  // other.
  constexpr double beside_sigmas = 5;
  const auto residuals = compute_board_residuals(problem_);
  std::map<CornerOfView, double> deviations_px;
  std::vector<double> all_px;
  for (std::size_t i = 0; i < used_.size(); ++i) {
    const auto& corners = input_.views[used_[i]];
    const auto residual = [&](std::size_t k) -> const Eigen::Vector2d& {
      return residuals[compute_problem_index(i, corners[k])];
    };
    for (std::size_t k = 0; k < corners.size(); ++k) {
      std::vector<std::pair<double, std::size_t>> near;
      for (std::size_t other = 0; other < corners.size(); ++other) {
        if (other == k || !residual(other).allFinite()) continue;
        near.emplace_back((corners[other].in_board_m - corners[k].in_board_m).squaredNorm(), other);
      }
      if (near.size() < neighbors || !residual(k).allFinite()) continue;
      std::partial_sort(near.begin(), near.begin() + neighbors, near.end());
      double max_px = 0;
      for (Eigen::Index axis = 0; axis < 2; ++axis) {
        std::vector<double> beside;
        for (std::size_t n = 0; n < neighbors; ++n) {
          beside.push_back(residual(near[n].second)[axis]);
        }
        const double middle = upper_median(beside);
        for (double& value : beside) value = std::abs(value - middle);
        const double robust_sd = upper_median(beside) / median_of_normal;
        const double off = std::abs(residual(k)[axis] - middle);
        const double weighted_deviation_px = off * corners[k].weight;
        all_px.push_back(weighted_deviation_px);
        if (off > beside_sigmas * robust_sd) max_px = std::max(max_px, weighted_deviation_px);
      }
      deviations_px[{used_[i], k}] = max_px;
    }
  }
  std::set<CornerOfView> found;
  if (all_px.empty()) return found;
  const double limit_px = std::max(min_px, sigmas * upper_median(all_px) / median_of_normal);
  for (const auto& [outlier, px] : deviations_px) {
    if (px <= limit_px) continue;
    const auto& corners = input_.views[outlier.first];
    const std::size_t tag = input_.lattice.get_tag_of_point(corners[outlier.second].point);
    for (std::size_t k = 0; k < corners.size(); ++k) {
      if (input_.lattice.get_tag_of_point(corners[k].point) == tag)
        found.insert({outlier.first, k});
    }
  }
  // A view with many such corners is not improved by its other corners.
  std::map<std::size_t, std::size_t> count_per_view;
  for (const auto& [view, corner] : found) ++count_per_view[view];
  std::erase_if(found, [&](const CornerOfView& outlier) {
    return 4 * count_per_view[outlier.first] > input_.views[outlier.first].size();
  });
  return found;
}

bool IntrinsicsSolver::drop_bad_views() {
  constexpr double max_ratio = 0.7;
  const auto rms = list_view_rms_px();
  const double limit_px = compute_max_view_rms(rms);
  const double worst_px = *std::max_element(rms.begin(), rms.end());
  if (worst_px <= limit_px) return false;
  const Lens lens = this->current_lens();
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < used_.size(); ++i) {
    const auto pose = estimate_view_pose(input_.views[used_[i]], lens);
    const bool helps = pose && pose->rms_px < max_ratio * rms[i];
    const bool bad = rms[i] > limit_px && rms[i] > worst_px / 2 && !helps;
    if (bad || !pose) {
      dropped_.push_back({used_[i], rms[i]});
      continue;
    }
    initial_poses_.poses[used_[i]] = pose->camera_from_board;
    kept.push_back(used_[i]);
  }
  used_ = kept;
  return true;
}

bool IntrinsicsSolver::reinstate_views() {
  const double limit_px = compute_max_view_rms(list_view_rms_px());
  const Lens lens = this->current_lens();
  const std::size_t before = dropped_.size();
  std::erase_if(dropped_, [&](const auto& dropped) {
    const auto pose = estimate_view_pose(input_.views[dropped.view], lens);
    if (!pose || pose->rms_px > limit_px) return false;
    initial_poses_.poses[dropped.view] = pose->camera_from_board;
    used_.push_back(dropped.view);
    return true;
  });
  std::sort(used_.begin(), used_.end());
  for (std::size_t i = 0; i < used_.size() && dropped_.size() < before; ++i) {
    if (const auto pose = estimate_view_pose(input_.views[used_[i]], lens)) {
      initial_poses_.poses[used_[i]] = pose->camera_from_board;
    }
  }
  return dropped_.size() < before;
}

/// Results of the first stages. Each is computed at its first use and kept.
struct InitialSolutions::Stages {
  using Solvers = std::vector<std::optional<IntrinsicsSolver>>;

  explicit Stages(IntrinsicsInput views) : input(std::move(views)) {}

  const std::vector<double>& rank_focal_lengths() {
    if (focal_lengths_px.empty()) focal_lengths_px = rank_initial_focal_lengths(input);
    return focal_lengths_px;
  }

  /// Returns the solver after stage 2, from one of the focal lengths; std::nullopt if that fails.
  const std::optional<IntrinsicsSolver>& solve_initial(std::size_t start) {
    while (initial.size() <= start) {
      IntrinsicsSolver solver(input);
      const bool is_solved = solver.solve_from_focal(rank_focal_lengths()[initial.size()]);
      initial.push_back(is_solved ? std::optional(std::move(solver)) : std::nullopt);
    }
    return initial[start];
  }

  /// Returns the solver after stage 3; std::nullopt if that or an earlier stage fails.
  const std::optional<IntrinsicsSolver>& refine(std::size_t start, LensModel lens_model) {
    Solvers& of_model = refined[lens_model];
    while (of_model.size() <= start) {
      std::optional<IntrinsicsSolver> solver = solve_initial(of_model.size());
      if (solver) {
        solver->set_lens_model(lens_model);
        solver->initialize_spline();
        if (!solver->refine_intrinsics()) solver.reset();
        if (solver && lens_model == LensModel::fisheye)
          solver->restart_if_worse(refine(of_model.size(), LensModel::opencv4));
      }
      of_model.push_back(std::move(solver));
    }
    return of_model[start];
  }

  IntrinsicsInput input;
  std::vector<double> focal_lengths_px;
  /// Solvers from the first focal lengths, in their order: after stage 2, and after stage 3.
  Solvers initial;
  std::map<LensModel, Solvers> refined;
};

InitialSolutions::InitialSolutions(IntrinsicsInput input)
    : stages_(std::make_unique<Stages>(std::move(input))) {}
InitialSolutions::InitialSolutions(InitialSolutions&&) noexcept = default;
InitialSolutions& InitialSolutions::operator=(InitialSolutions&&) noexcept = default;
InitialSolutions::~InitialSolutions() = default;

const IntrinsicsInput& InitialSolutions::input() const { return stages_->input; }

const std::vector<double>& InitialSolutions::focal_lengths_px() const {
  return stages_->rank_focal_lengths();
}

std::optional<IntrinsicsSolution> InitialSolutions::solve_first_stages(LensModel lens_model) const {
  constexpr std::size_t best_start = 0;
  if (input().views.size() < IntrinsicsSolver::kMinViews) return {};
  const auto& solver = stages_->refine(best_start, lens_model);
  if (!solver) return {};
  return solver->make_solution();
}

IntrinsicsSolution solve_intrinsics(const IntrinsicsInput& input) {
  return solve_intrinsics(InitialSolutions(input), input.lens_model);
}

IntrinsicsSolution solve_intrinsics(const InitialSolutions& initial, LensModel lens_model) {
  constexpr std::size_t max_starts = 4;
  const std::size_t num_views = initial.input().views.size();
  if (num_views < IntrinsicsSolver::kMinViews) return make_failure(IntrinsicsStatus::too_few_views);
  const std::size_t starts = std::min(initial.focal_lengths_px().size(), max_starts);
  for (std::size_t start = 0; start < starts; ++start) {
    const auto& refined = initial.stages_->refine(start, lens_model);
    if (!refined) continue;
    IntrinsicsSolver solver = *refined;
    if (!solver.scale_regularization() || !solver.apply_curvature() ||
        !solver.apply_displacements(DisplacementForm::constant) || !solver.solve_board_warp() ||
        !solver.reweight_corners() || !solver.apply_curvature() ||
        !solver.apply_displacements(DisplacementForm::varying) || !solver.reweight_and_reject() ||
        !solver.scale_regularization() || !solver.align_to_axis()) {
      continue;
    }
    IntrinsicsSolution solution = solver.make_solution();
    if (are_boards_parallel(solution.problem)) return make_failure(IntrinsicsStatus::all_parallel);
    if (2 * solution.views.size() > num_views) return solution;
  }
  return make_failure(IntrinsicsStatus::no_solution);
}

IntrinsicsSolution solve_half_of_views(const IntrinsicsSolution& whole, std::size_t first) {
  const BoardProblem& all = whole.problem;
  const std::size_t parts = all.poses.size() / whole.views.size();
  const std::size_t points = parts * all.points_per_board();
  IntrinsicsSolution half = whole;
  half.views.clear();
  half.edge_displacements_px.clear();
  half.problem.poses.clear();
  half.problem.points.clear();
  const auto copy_part = [](const auto& from, std::size_t view, std::size_t count, auto& to) {
    const auto begin = from.begin() + static_cast<std::ptrdiff_t>(view * count);
    to.insert(to.end(), begin, begin + static_cast<std::ptrdiff_t>(count));
  };
  for (std::size_t view = first; view < whole.views.size(); view += 2) {
    copy_part(whole.views, view, 1, half.views);
    copy_part(whole.edge_displacements_px, view, 1, half.edge_displacements_px);
    copy_part(all.poses, view, parts, half.problem.poses);
    copy_part(all.points, view, points, half.problem.points);
  }
  if (half.views.size() < IntrinsicsSolver::kMinViews) {
    return make_failure(IntrinsicsStatus::too_few_views);
  }
  if (!solve_board_problem(half.problem, half.solved_parameters)) {
    return make_failure(IntrinsicsStatus::no_solution);
  }
  if (are_boards_parallel(half.problem)) return make_failure(IntrinsicsStatus::all_parallel);
  half.update_statistics();
  return half;
}

}  // namespace vlp
