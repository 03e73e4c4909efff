// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/lamp_offsets.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "geometry/plane.h"
#include "geometry/robust_scatter.h"
#include "geometry/similarity.h"
#include "geometry/symmetric.h"
#include "rig/find_lamp.h"

namespace vlp {
namespace {

using SeenLamp = CeilingView::SeenLamp;

/// Leaves out what ties no lamp to others.
void keep_tied(std::vector<CeilingView>& views) {
  constexpr std::size_t least_lamps = 3;
  constexpr int least_captures = 2;
  for (std::size_t removed = 1; removed > 0;) {
    std::erase_if(views, [](const CeilingView& view) { return view.lamps.size() < least_lamps; });
    std::map<int, int> captures;
    for (const CeilingView& view : views) {
      for (const SeenLamp& one : view.lamps) ++captures[one.lamp];
    }
    removed = 0;
    for (CeilingView& view : views) {
      removed += std::erase_if(
          view.lamps, [&](const SeenLamp& one) { return captures[one.lamp] < least_captures; });
    }
  }
}

/// An orthonormal basis of what shift, turn and scale do to points.
Eigen::MatrixXd similarities(const std::vector<Eigen::Vector2d>& points,
                             const std::vector<double>& scales) {
  const auto count = static_cast<Eigen::Index>(points.size());
  Eigen::MatrixXd moves(2 * count, 4);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Vector2d& at = points[static_cast<std::size_t>(i)];
    moves.block<2, 2>(2 * i, 0).setIdentity();
    moves.block<2, 1>(2 * i, 2) = Eigen::Vector2d(-at.y(), at.x());
    moves.block<2, 1>(2 * i, 3) = at * scales[static_cast<std::size_t>(i)];
  }
  const auto [squares, directions] = symmetric_eigen(Eigen::MatrixXd(moves.transpose() * moves));
  constexpr double rounding = 1e-12;
  const auto rank = (squares.array() > rounding * squares.maxCoeff()).count();
  return moves * directions.rightCols(rank) *
         squares.tail(rank).cwiseSqrt().cwiseInverse().asDiagonal();
}

/// What the capture says of its lamps, whatever its fix: the projector onto it.
Eigen::MatrixXd told_by(const CeilingView& view) {
  std::vector<Eigen::Vector2d> points;
  std::vector<double> scales;
  for (const SeenLamp& one : view.lamps) {
    points.emplace_back(one.seen_m - view.camera_m);
    scales.push_back(1 / one.above_camera_m);
  }
  const Eigen::MatrixXd open = similarities(points, scales);
  return Eigen::MatrixXd::Identity(open.rows(), open.rows()) - open * open.transpose();
}

struct Displacements {
  std::vector<int> lamps;
  std::vector<Eigen::Vector2d> map_m;
  /// Two rows a lamp.
  Eigen::VectorXd moved_m;
  Eigen::MatrixXd covariance_m2, projector;
  /// Residuals of each view, two rows a lamp.
  std::vector<Eigen::VectorXd> residuals_m;
  double degrees_of_freedom = 0;
};

std::optional<Displacements> solved(const LampMap& map, const std::vector<CeilingView>& views) {
  Displacements found;
  std::map<int, Eigen::Index> index;
  for (const CeilingView& view : views) {
    for (const SeenLamp& one : view.lamps) index.emplace(one.lamp, 0);
  }
  for (auto& [lamp, at] : index) {
    at = std::ssize(found.lamps);
    found.lamps.push_back(lamp);
    found.map_m.emplace_back(find_lamp(map.lamps, lamp)->position_m.head<2>());
  }
  const Eigen::Index unknowns = 2 * std::ssize(found.lamps);
  if (unknowns == 0) return std::nullopt;
  Eigen::Vector2d middle_m(0, 0);
  for (const Eigen::Vector2d& at_m : found.map_m) {
    middle_m += at_m / static_cast<double>(found.map_m.size());
  }
  std::vector<Eigen::Vector2d> about_middle;
  for (const Eigen::Vector2d& at_m : found.map_m) about_middle.emplace_back(at_m - middle_m);
  const Eigen::MatrixXd open =
      similarities(about_middle, std::vector<double>(about_middle.size(), 1));
  found.projector = Eigen::MatrixXd::Identity(unknowns, unknowns) - open * open.transpose();

  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(unknowns, unknowns);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(unknowns);
  std::vector<Eigen::MatrixXd> told;
  std::vector<Eigen::VectorXd> off_m;
  Eigen::Index freedoms = -(unknowns - open.cols());
  for (const CeilingView& view : views) {
    const Eigen::MatrixXd& by_view = told.emplace_back(told_by(view));
    Eigen::VectorXd& off = off_m.emplace_back(by_view.rows());
    const auto place = [&](std::size_t i) { return 2 * index.at(view.lamps[i].lamp); };
    for (std::size_t i = 0; i < view.lamps.size(); ++i) {
      off.segment<2>(2 * static_cast<Eigen::Index>(i)) =
          view.lamps[i].seen_m - found.map_m[static_cast<std::size_t>(place(i) / 2)];
    }
    off = by_view * off;
    for (std::size_t i = 0; i < view.lamps.size(); ++i) {
      const auto row = 2 * static_cast<Eigen::Index>(i);
      gradient.segment<2>(place(i)) += off.segment<2>(row);
      for (std::size_t j = 0; j < view.lamps.size(); ++j) {
        normal.block<2, 2>(place(i), place(j)) +=
            by_view.block<2, 2>(row, 2 * static_cast<Eigen::Index>(j));
      }
    }
    freedoms += by_view.rows() - 4;
  }
  if (freedoms <= 0) return std::nullopt;
  found.degrees_of_freedom = static_cast<double>(freedoms);
  const Eigen::MatrixXd closed =
      found.projector * normal * found.projector + open * open.transpose();
  const auto [weights, directions] = symmetric_eigen(closed);
  constexpr double tied = 1e-12;
  if (!(weights.minCoeff() > tied * weights.maxCoeff())) return std::nullopt;
  const Eigen::MatrixXd inverse =
      directions * weights.cwiseInverse().asDiagonal() * directions.transpose();
  found.moved_m = inverse * (found.projector * gradient);
  double squares_m2 = 0;
  for (std::size_t c = 0; c < views.size(); ++c) {
    Eigen::VectorXd moved(told[c].rows());
    for (std::size_t i = 0; i < views[c].lamps.size(); ++i) {
      moved.segment<2>(2 * static_cast<Eigen::Index>(i)) =
          found.moved_m.segment<2>(2 * index.at(views[c].lamps[i].lamp));
    }
    squares_m2 += found.residuals_m.emplace_back(off_m[c] - told[c] * moved).squaredNorm();
  }
  found.covariance_m2 =
      squares_m2 / found.degrees_of_freedom * found.projector * inverse * found.projector;
  return found;
}

/// What contradicts the rest, if anything does: of each view the sighting that is farthest off,
/// when it is half as far as the farthest of all, which moves the others.
bool leave_out_outliers(std::vector<CeilingView>& views, const Displacements& found) {
  constexpr double sigmas = 6, rounding_m = 1e-7;
  std::vector<double> squares_m2;
  for (const Eigen::VectorXd& left_m : found.residuals_m) {
    for (Eigen::Index row = 0; row < left_m.size(); row += 2) {
      squares_m2.push_back(left_m.segment<2>(row).squaredNorm());
    }
  }
  const double farthest_m = std::sqrt(*std::max_element(squares_m2.begin(), squares_m2.end()));
  const double variance_m2 =
      robust_planar_variance(std::move(squares_m2), found.degrees_of_freedom);
  const double limit_m = std::max(
      {rounding_m, std::sqrt(planar_outlier_bound(sigmas, found.degrees_of_freedom) * variance_m2),
       farthest_m / 2});
  bool any = false;
  for (std::size_t c = 0; c < views.size(); ++c) {
    const Eigen::VectorXd& left_m = found.residuals_m[c];
    Eigen::Index worst = 0;
    for (Eigen::Index row = 2; row < left_m.size(); row += 2) {
      if (left_m.segment<2>(row).norm() > left_m.segment<2>(worst).norm()) worst = row;
    }
    if (left_m.segment<2>(worst).norm() <= limit_m) continue;
    views[c].lamps.erase(views[c].lamps.begin() + worst / 2);
    any = true;
  }
  return any;
}

/// Less what the similarity that takes the others to the map leaves; nothing where none does.
std::optional<Eigen::Vector2d> seen_by_the_others(const Displacements& found, std::size_t lamp) {
  std::vector<Eigen::Vector2d> from_m, to_m;
  const auto at_m = [&](std::size_t i) -> Eigen::Vector2d {
    return found.map_m[i] + found.moved_m.segment<2>(2 * static_cast<Eigen::Index>(i));
  };
  for (std::size_t i = 0; i < found.lamps.size(); ++i) {
    if (i == lamp) continue;
    from_m.push_back(at_m(i));
    to_m.push_back(found.map_m[i]);
  }
  const auto to_map = fit_similarity(
      from_m.size(), [&](std::size_t i) { return from_m[i]; },
      [&](std::size_t i) { return to_m[i]; });
  if (!to_map) return std::nullopt;
  return to_map->offset + complex_product(to_map->factor, at_m(lamp)) - found.map_m[lamp];
}

}  // namespace

std::vector<LampOffset> offsets_of_lamps(const LampMap& map, std::vector<CeilingView> views) {
  keep_tied(views);
  std::optional<Displacements> found = solved(map, views);
  while (found && leave_out_outliers(views, *found)) {
    keep_tied(views);
    found = solved(map, views);
  }
  if (!found) return {};
  std::vector<LampOffset> offsets;
  for (std::size_t i = 0; i < found->lamps.size(); ++i) {
    const int id = found->lamps[i];
    const auto row = 2 * static_cast<Eigen::Index>(i);
    constexpr double least_share = 1e-3;  // what the others tell of it
    const double share = found->projector(row, row);
    const auto offset_m = seen_by_the_others(*found, i);
    if (share < least_share || !offset_m) continue;
    const auto captures = std::count_if(views.begin(), views.end(), [&](const CeilingView& view) {
      return std::any_of(view.lamps.begin(), view.lamps.end(),
                         [&](const SeenLamp& one) { return one.lamp == id; });
    });
    const Eigen::Vector2d sd_m =
        found->covariance_m2.diagonal().segment<2>(row).cwiseMax(0).cwiseSqrt() / share;
    offsets.push_back({id, static_cast<int>(captures), found->map_m[i], *offset_m, sd_m});
  }
  return offsets;
}

}  // namespace vlp
