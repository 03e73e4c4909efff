// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
// Which views a solve rests on, and their poses.
#include <algorithm>
#include <cmath>
#include <limits>

#include "calibration/intrinsics/intrinsics_solver.h"
#include "calibration/intrinsics/view_pose.h"
#include "geometry/median.h"

namespace vlp {
namespace {

/// What a view's corners may be off, given what those of the others are.
double limit_for(const std::vector<double>& rms) {
  constexpr double fair_px = 1, fair = 4;
  return std::max(fair_px, fair * upper_median(rms));
}

}  // namespace

void IntrinsicsSolver::seed(const Lens& lens) {
  seeds_ = poses_through(input_, lens);
  used_.clear();
  for (std::size_t i = 0; i < input_.views.size(); ++i) {
    if (std::isfinite(seeds_.rms_px[i])) used_.push_back(i);
  }
}

void IntrinsicsSolver::assemble(const Lens& lens) {
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
      problem_.points[board * lattice.points() + corner.point] << corner.pixel, corner.weight;
    }
  }
}

std::vector<double> IntrinsicsSolver::rms_of_views() const {
  const auto residuals = residuals_of(problem_);
  const std::size_t count = input_.lattice.parts() * input_.lattice.points();
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

bool IntrinsicsSolver::change_poses() {
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

bool IntrinsicsSolver::take_back() {
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

}  // namespace vlp
