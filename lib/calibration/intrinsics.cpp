// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "calibration/edge_bias.h"
#include "calibration/view_pose.h"

namespace vlp {
namespace {

constexpr std::size_t kLeastViews = 3;
constexpr double kUnfit = std::numeric_limits<double>::infinity();

/// The input with the poses as they are now.
struct Seeds {
  std::vector<BoardPose> poses;
  std::vector<double> rms_px;  // kUnfit where there is no pose
};

Seeds poses_through(const IntrinsicsInput& input, const Lens& lens) {
  Seeds seeds;
  for (const auto& corners : input.views) {
    const auto pose = view_pose(corners, lens);
    seeds.poses.push_back(pose ? pose->camera_from_board : BoardPose{});
    seeds.rms_px.push_back(pose ? pose->rms_px : kUnfit);
  }
  return seeds;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Lens stereographic(const IntrinsicsInput& input, double focal_px) {
  const auto [width, height] = input.imager_px;
  const std::array parameters{focal_px, focal_px, (width - 1) / 2.0, (height - 1) / 2.0};
  return Lens(LensModel::stereographic, parameters);
}

/// A few of the views, evenly chosen, tell how good a focal length is.
IntrinsicsInput some_of(const IntrinsicsInput& input) {
  constexpr std::size_t enough = 12;
  IntrinsicsInput some = input;
  const std::size_t count = input.views.size();
  if (count <= enough) return some;
  some.views.clear();
  for (std::size_t i = 0; i < enough; ++i) some.views.push_back(input.views[i * count / enough]);
  return some;
}

/// Focal lengths by how well the poses fit with them.
std::vector<double> focal_lengths(const IntrinsicsInput& input) {
  const IntrinsicsInput some = some_of(input);
  std::vector<std::pair<double, double>> tried;
  constexpr int least = -5, most = 6;  // of the image's width: 0.18 to 8
  for (int half_octaves = least; half_octaves <= most; ++half_octaves) {
    const double focal_px = input.imager_px[0] * std::exp2(half_octaves / 2.0);
    tried.emplace_back(median(poses_through(some, stereographic(input, focal_px)).rms_px),
                       focal_px);
  }
  std::sort(tried.begin(), tried.end());
  std::vector<double> order;
  for (const auto& [rms_px, focal_px] : tried) order.push_back(focal_px);
  return order;
}

class Solver {
 public:
  explicit Solver(const IntrinsicsInput& input) : input_(input) {
    for (std::size_t i = 0; i < input.views.size(); ++i) used_.push_back(i);
  }

  /// Stage 2 of solve_intrinsics().
  bool start(double focal_px) {
    constexpr int rounds = 4;
    constexpr double settled = 1e-3;
    Lens lens = stereographic(input_, focal_px);
    for (int round = 0; round < rounds; ++round) {
      const double before_px = lens.focal_px().x();
      seed(lens);
      if (used_.size() < kLeastViews) return false;
      assemble(lens);
      if (!solve({true, false, false, false})) return false;
      lens = this->lens();
      if (std::abs(lens.focal_px().x() / before_px - 1) < settled) break;
    }
    return true;
  }

  /// Stage 3.
  bool refine() {
    constexpr int rounds = 6;
    problem_.lens_model = input_.lens_model;
    // Zero would be a stationary point of some of them.
    constexpr double tiny = 1e-6;
    problem_.intrinsics.resize(parameter_count(input_.lens_model), tiny);
    const bool distortions = problem_.intrinsics.size() > 4;
    for (int round = 0; round < rounds; ++round) {
      if (!solve({true, distortions, false, false})) return false;
      if (!change_poses()) break;
      if (used_.size() < kLeastViews) return false;
      assemble(lens());
    }
    if (!take_back()) return true;
    assemble(lens());
    return solve({true, distortions, false, false});
  }

  /// Stage 4.
  bool finish() {
    constexpr int corrections = 2;
    if (!solve(IntrinsicsSolution::solved_for)) return false;
    for (int i = 0; input_.from_edges && i < corrections; ++i) {
      remove_edge_bias();
      if (!solve(IntrinsicsSolution::solved_for)) return false;
    }
    // Without noise what is left is the regularization's, and would be taken for outliers.
    constexpr double exact_px = 0.005;
    if (solution().rms_px < exact_px) return true;
    SolveFor without_outliers = IntrinsicsSolution::solved_for;
    without_outliers.without_outliers = true;
    return solve(without_outliers) && std::isfinite(solution().rms_px);
  }

  IntrinsicsSolution solution() const {
    IntrinsicsSolution result{IntrinsicsStatus::ok, problem_, used_, dropped_, 0, 0, 0};
    double squares = 0;
    const auto residuals = residuals_of(problem_);
    for (std::size_t i = 0; i < residuals.size(); ++i) {
      const double weight = problem_.points[i].z();
      if (weight > 0) {
        squares += residuals[i].squaredNorm();
        ++result.corners;
      } else if (weight != BoardProblem::kUnseen) {
        ++result.outliers;
      }
    }
    result.rms_px = std::sqrt(squares / (2 * std::max(1, result.corners)));
    return result;
  }

  bool all_alike() const {
    constexpr double least_rad = 0.09;  // five degrees
    double widest_rad = 0;
    for (const BoardPose& a : problem_.poses) {
      for (const BoardPose& b : problem_.poses) {
        const double cosine = normal_of(a).dot(normal_of(b));
        widest_rad = std::max(widest_rad, std::acos(std::clamp(cosine, -1.0, 1.0)));
      }
    }
    return widest_rad < least_rad;
  }

 private:
  static Eigen::Vector3d normal_of(const BoardPose& pose) {
    return Eigen::AngleAxisd(pose.rotation.norm(), pose.rotation.normalized()) *
           Eigen::Vector3d::UnitZ();
  }

  Lens lens() const { return Lens(problem_.lens_model, problem_.intrinsics); }

  bool solve(SolveFor what) {
    what.distortions = what.distortions && problem_.intrinsics.size() > 4;
    return vlp::solve(problem_, what) && problem_.intrinsics[0] > 0 && problem_.intrinsics[1] > 0 &&
           std::all_of(problem_.intrinsics.begin(), problem_.intrinsics.end(),
                       [](double value) { return std::isfinite(value); });
  }

  /// Poses of every view through this lens; views without one wait for another lens.
  void seed(const Lens& lens) {
    seeds_ = poses_through(input_, lens);
    used_.clear();
    for (std::size_t i = 0; i < input_.views.size(); ++i) {
      if (std::isfinite(seeds_.rms_px[i])) used_.push_back(i);
    }
  }

  /// The problem of the views used, at their seeds.
  void assemble(const Lens& lens) {
    const BoardLattice& lattice = input_.lattice;
    problem_.lens_model = lens.model();
    if (problem_.intrinsics.empty() || lens.model() == LensModel::stereographic) {
      problem_.intrinsics = {lens.focal_px().x(), lens.focal_px().y(), lens.center_px().x(),
                             lens.center_px().y()};
    }
    problem_.imager_px = input_.imager_px;
    problem_.cols = lattice.cols();
    problem_.rows = lattice.rows();
    problem_.spacing_m = lattice.spacing_m();
    problem_.poses.clear();
    problem_.points.assign(used_.size() * lattice.parts() * lattice.points(),
                           {-1, -1, BoardProblem::kUnseen});
    for (std::size_t i = 0; i < used_.size(); ++i) {
      for (std::size_t part = 0; part < lattice.parts(); ++part) {
        problem_.poses.push_back(lattice.pose_of_part(seeds_.poses[used_[i]], part));
      }
      for (const auto& corner : input_.views[used_[i]]) {
        const std::size_t board = i * lattice.parts() + corner.part;
        problem_.points[board * lattice.points() + corner.point] << corner.pixel, 1;
      }
    }
  }

  void remove_edge_bias() {
    const BoardLattice& lattice = input_.lattice;
    const Lens lens = this->lens();
    for (std::size_t i = 0; i < used_.size(); ++i) {
      const auto& corners = input_.views[used_[i]];
      const BoardPose pose = lattice.pose_of_board(problem_.poses[i * lattice.parts()]);
      const auto bias_px = edge_bias_px(corners, pose, lens);
      for (std::size_t k = 0; k < corners.size(); ++k) {
        const std::size_t board = i * lattice.parts() + corners[k].part;
        problem_.points[board * lattice.points() + corners[k].point].head<2>() =
            corners[k].pixel - bias_px[k];
      }
    }
  }

  /// Of the views used, in their order.
  std::vector<double> rms_of_views() const {
    const auto residuals = residuals_of(problem_);
    const std::size_t count = input_.lattice.parts() * input_.lattice.points();
    std::vector<double> rms;
    for (std::size_t i = 0; i < used_.size(); ++i) {
      double squares = 0;
      for (std::size_t k = i * count; k < (i + 1) * count; ++k) {
        if (problem_.points[k].z() > 0) squares += residuals[k].squaredNorm();
      }
      const double value =
          std::sqrt(squares / (2 * static_cast<double>(input_.views[used_[i]].size())));
      rms.push_back(std::isfinite(value) ? value : kUnfit);
    }
    return rms;
  }

  /// Tries both poses of each view that fits badly, and drops the worst of those that stay bad.
  /// True when there is something to solve again.
  bool change_poses() {
    constexpr double better = 0.7;
    const auto rms = rms_of_views();
    const double limit_px = limit_for(rms);
    const double worst_px = *std::max_element(rms.begin(), rms.end());
    if (worst_px <= limit_px) return false;
    const Lens lens = this->lens();
    std::vector<std::size_t> kept;
    for (std::size_t i = 0; i < used_.size(); ++i) {
      const auto pose = view_pose(input_.views[used_[i]], lens);
      const bool helps = pose && pose->rms_px < better * rms[i];
      const bool bad = rms[i] > limit_px && rms[i] > worst_px / 2 && !helps;
      if (bad || !pose) {
        dropped_.push_back({used_[i], rms[i]});
        continue;
      }
      seeds_.poses[used_[i]] = pose->camera_from_board;
      kept.push_back(used_[i]);
    }
    used_ = kept;
    return true;
  }

  /// What a view's corners may be off, given what those of the others are.
  static double limit_for(const std::vector<double>& rms) {
    constexpr double fair_px = 1, fair = 4;
    return std::max(fair_px, fair * median(rms));
  }

  /// Views that were dropped because a worse one had spoilt the lens, and that fit it now.
  bool take_back() {
    const double limit_px = limit_for(rms_of_views());
    const Lens lens = this->lens();
    const std::size_t before = dropped_.size();
    std::erase_if(dropped_, [&](const auto& dropped) {
      const auto pose = view_pose(input_.views[dropped.view], lens);
      if (!pose || pose->rms_px > limit_px) return false;
      seeds_.poses[dropped.view] = pose->camera_from_board;
      used_.push_back(dropped.view);
      return true;
    });
    std::sort(used_.begin(), used_.end());
    for (std::size_t i = 0; i < used_.size() && dropped_.size() < before; ++i) {
      if (const auto pose = view_pose(input_.views[used_[i]], lens)) {
        seeds_.poses[used_[i]] = pose->camera_from_board;
      }
    }
    return dropped_.size() < before;
  }

  const IntrinsicsInput& input_;
  Seeds seeds_;
  std::vector<std::size_t> used_;
  std::vector<IntrinsicsSolution::Dropped> dropped_;
  BoardProblem problem_{};
};

IntrinsicsSolution failure(IntrinsicsStatus status) { return {status, {}, {}, {}, 0, 0, 0}; }

}  // namespace

std::string_view explanation_of(IntrinsicsStatus status) {
  switch (status) {
    case IntrinsicsStatus::ok:
      return "ok";
    case IntrinsicsStatus::too_few_views:
      return "fewer than three views can be used; add views of the board, tilted by 20 to 45 "
             "degrees "
             "to different sides and all over the image";
    case IntrinsicsStatus::all_alike:
      return "all views show the board at the same angle, so that any focal length fits; add views "
             "with the board tilted by 20 to 45 degrees to different sides";
    case IntrinsicsStatus::no_solution:
      return "no lens fits the views; is board.yaml that of the board in the images?";
  }
  return "";
}

IntrinsicsSolution solve_intrinsics(const IntrinsicsInput& input) {
  constexpr std::size_t most_starts = 4;
  if (input.views.size() < kLeastViews) return failure(IntrinsicsStatus::too_few_views);
  auto starts = focal_lengths(input);
  starts.resize(std::min(starts.size(), most_starts));
  for (const double focal_px : starts) {
    Solver solver(input);
    if (!solver.start(focal_px) || !solver.refine() || !solver.finish()) continue;
    if (solver.all_alike()) return failure(IntrinsicsStatus::all_alike);
    IntrinsicsSolution solution = solver.solution();
    if (2 * solution.views.size() > input.views.size()) return solution;
  }
  return failure(IntrinsicsStatus::no_solution);
}

}  // namespace vlp
