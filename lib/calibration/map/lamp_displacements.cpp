// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/map/lamp_displacements.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "geometry/plane.h"
#include "geometry/robust_scatter.h"
#include "geometry/similarity.h"
#include "geometry/symmetric.h"
#include "rig/find_lamp.h"

namespace vlp {
namespace {

using ProjectedLamp = CeilingView::ProjectedLamp;

std::size_t count_detections(const std::vector<CeilingView>& views) {
  std::size_t count = 0;
  for (const CeilingView& view : views) count += view.lamps.size();
  return count;
}

/// Removes detections that do not connect a lamp to other lamps.
void remove_unconnected_detections(std::vector<CeilingView>& views) {
  constexpr std::size_t min_lamps = 3;
  constexpr int min_captures = 2;
  for (std::size_t removed = 1; removed > 0;) {
    std::erase_if(views, [](const CeilingView& view) { return view.lamps.size() < min_lamps; });
    std::map<int, int> captures;
    for (const CeilingView& view : views) {
      for (const ProjectedLamp& projection : view.lamps) ++captures[projection.lamp];
    }
    removed = 0;
    for (CeilingView& view : views) {
      removed += std::erase_if(view.lamps, [&](const ProjectedLamp& projection) {
        return captures[projection.lamp] < min_captures;
      });
    }
  }
}

/// Returns an orthonormal basis of the displacements of points by shift, rotation and scale.
Eigen::MatrixXd make_similarity_basis(const std::vector<Eigen::Vector2d>& points,
                                      const std::vector<double>& scales) {
  const auto count = static_cast<Eigen::Index>(points.size());
  Eigen::MatrixXd moves(2 * count, 4);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Vector2d& point = points[static_cast<std::size_t>(i)];
    moves.block<2, 2>(2 * i, 0).setIdentity();
    moves.block<2, 1>(2 * i, 2) = Eigen::Vector2d(-point.y(), point.x());
    moves.block<2, 1>(2 * i, 3) = point * scales[static_cast<std::size_t>(i)];
  }
  const auto [squares, directions] =
      eigendecompose_symmetric_matrix(Eigen::MatrixXd(moves.transpose() * moves));
  constexpr double numeric_tolerance = 1e-12;
  const auto rank = (squares.array() > numeric_tolerance * squares.maxCoeff()).count();
  return moves * directions.rightCols(rank) *
         squares.tail(rank).cwiseSqrt().cwiseInverse().asDiagonal();
}

/// Equations of one capture that do not depend on its pose: observed_m = jacobian
/// unknowns(columns).
struct ViewEquations {
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd observed_m;
  std::vector<Eigen::Index> columns;
};

/// `column` maps a lamp to its first column; `tilt_column` is that of the tilt if it is unknown.
ViewEquations make_equations(const CeilingView& view, const std::map<int, Eigen::Index>& column,
                             const std::vector<Eigen::Vector2d>& map_m,
                             std::optional<Eigen::Index> tilt_column) {
  const auto size = 2 * std::ssize(view.lamps);
  std::vector<Eigen::Vector2d> points;
  std::vector<double> scales;
  ViewEquations equations{
      Eigen::MatrixXd::Identity(size, size + (tilt_column ? 2 : 0)), Eigen::VectorXd(size), {}};
  const auto add_columns = [&](Eigen::Index first) {
    equations.columns.insert(equations.columns.end(), {first, first + 1});
  };
  for (const ProjectedLamp& projection : view.lamps) {
    const auto row = 2 * std::ssize(points);
    points.emplace_back(projection.projected_m - view.camera_m);
    scales.push_back(1 / projection.above_camera_m);
    add_columns(column.at(projection.lamp));
    equations.observed_m.segment<2>(row) =
        projection.projected_m - map_m[static_cast<std::size_t>(column.at(projection.lamp) / 2)];
    if (!tilt_column) continue;
    // z = (x / z, y / z) along the axes of the world; dz = -(I + z z') t.
    const Eigen::Vector2d z = points.back() * scales.back();
    equations.jacobian.block<2, 2>(row, size) = -projection.above_camera_m *
                                                (Eigen::Matrix2d::Identity() + z * z.transpose()) *
                                                Eigen::Rotation2Dd(view.yaw_rad).toRotationMatrix();
  }
  if (tilt_column) add_columns(*tilt_column);
  const Eigen::MatrixXd basis = make_similarity_basis(points, scales);
  equations.jacobian -= basis * (basis.transpose() * equations.jacobian).eval();
  equations.observed_m -= basis * (basis.transpose() * equations.observed_m).eval();
  return equations;
}

/// Returns a basis of the similarities of the floor plan, which captures cannot determine.
Eigen::MatrixXd make_gauge_basis(const std::vector<Eigen::Vector2d>& map_m) {
  Eigen::Vector2d mean_m(0, 0);
  for (const Eigen::Vector2d& lamp_m : map_m) mean_m += lamp_m / static_cast<double>(map_m.size());
  std::vector<Eigen::Vector2d> centered_m = map_m;
  for (Eigen::Vector2d& lamp_m : centered_m) lamp_m -= mean_m;
  return make_similarity_basis(centered_m, std::vector<double>(centered_m.size(), 1));
}

std::optional<LampDisplacements> solve_lamp_displacements(const LampMap& map,
                                                          const std::vector<CeilingView>& views,
                                                          bool tilt_is_free) {
  LampDisplacements found;
  std::map<int, int> captures;
  std::map<int, Eigen::Index> column;
  for (const CeilingView& view : views) {
    for (const ProjectedLamp& projection : view.lamps) ++captures[projection.lamp];
  }
  if (captures.empty()) return std::nullopt;
  for (const auto& [lamp, count] : captures) {
    column[lamp] = 2 * std::ssize(found.lamps);
    found.lamps.push_back(lamp);
    found.captures.push_back(count);
    found.map_m.emplace_back(find_lamp_by_id(map.lamps, lamp)->position_m.head<2>());
  }
  const Eigen::Index size = 2 * std::ssize(found.lamps), unknowns = size + (tilt_is_free ? 2 : 0);
  const Eigen::MatrixXd gauge = make_gauge_basis(found.map_m);
  Eigen::MatrixXd projector = Eigen::MatrixXd::Identity(unknowns, unknowns);
  projector.topLeftCorner(size, size) -= gauge * gauge.transpose();

  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(unknowns, unknowns);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(unknowns);
  std::vector<ViewEquations> equations;
  Eigen::Index freedom = gauge.cols() - unknowns;
  for (const CeilingView& view : views) {
    const auto& [jacobian, observed_m, columns] = equations.emplace_back(make_equations(
        view, column, found.map_m, tilt_is_free ? std::optional(size) : std::nullopt));
    normal(columns, columns) += jacobian.transpose() * jacobian;
    gradient(columns) += jacobian.transpose() * observed_m;
    freedom += jacobian.rows() - 4;
  }
  if (freedom <= 0) return std::nullopt;
  found.degrees_of_freedom = static_cast<double>(freedom);
  found.information = normal.topLeftCorner(size, size);
  if (tilt_is_free) {
    found.information -=
        normal.topRightCorner(size, 2) *
        solve_symmetric_system(normal.bottomRightCorner(2, 2), normal.bottomLeftCorner(2, size));
  }
  normal = (projector * normal * projector).eval();
  normal.topLeftCorner(size, size) += gauge * gauge.transpose();
  const auto [weights, directions] = eigendecompose_symmetric_matrix(normal);
  constexpr double numeric_tolerance = 1e-12;
  if (!(weights.minCoeff() > numeric_tolerance * weights.maxCoeff())) return std::nullopt;
  const Eigen::MatrixXd inverse =
      directions * weights.cwiseInverse().asDiagonal() * directions.transpose();
  const Eigen::VectorXd solution = inverse * (projector * gradient);
  double squares_m2 = 0;
  for (const auto& [jacobian, observed_m, columns] : equations) {
    found.residuals_m.emplace_back(observed_m - jacobian * solution(columns));
    squares_m2 += found.residuals_m.back().squaredNorm();
  }
  found.displacement_m = solution.head(size);
  if (tilt_is_free) found.tilt = solution.tail<2>();
  found.projector = projector.topLeftCorner(size, size);
  found.covariance_m2 = squares_m2 / found.degrees_of_freedom * found.projector *
                        inverse.topLeftCorner(size, size) * found.projector;
  return found;
}

/// Removes outliers and adds them to `outliers_m`. Removes the largest residual of each view if it
/// exceeds half the largest of all, because an outlier also changes the residuals of other
/// detections. Returns true if any was removed.
bool reject_detection_outliers(std::vector<CeilingView>& views, const LampDisplacements& found,
                               std::map<int, std::vector<double>>& outliers_m) {
  constexpr double max_sigmas = 6, numeric_tolerance_m = 1e-7;
  std::vector<double> squares_m2;
  for (const Eigen::VectorXd& residuals_m : found.residuals_m) {
    for (Eigen::Index row = 0; row < residuals_m.size(); row += 2) {
      squares_m2.push_back(residuals_m.segment<2>(row).squaredNorm());
    }
  }
  const double largest_m = std::sqrt(*std::max_element(squares_m2.begin(), squares_m2.end()));
  const double variance_m2 =
      estimate_robust_variance_2d(std::move(squares_m2), found.degrees_of_freedom);
  const double limit_m =
      std::max({numeric_tolerance_m,
                std::sqrt(compute_squared_outlier_bound_2d(max_sigmas, found.degrees_of_freedom) *
                          variance_m2),
                largest_m / 2});
  bool any = false;
  for (std::size_t c = 0; c < views.size(); ++c) {
    const Eigen::VectorXd& residuals_m = found.residuals_m[c];
    Eigen::Index worst = 0;
    for (Eigen::Index row = 2; row < residuals_m.size(); row += 2) {
      if (residuals_m.segment<2>(row).norm() > residuals_m.segment<2>(worst).norm()) worst = row;
    }
    if (residuals_m.segment<2>(worst).norm() <= limit_m) continue;
    const auto outlier = views[c].lamps.begin() + worst / 2;
    outliers_m[outlier->lamp].push_back(residuals_m.segment<2>(worst).norm());
    views[c].lamps.erase(outlier);
    any = true;
  }
  return any;
}

}  // namespace

std::optional<LampDisplacements> estimate_lamp_displacements(const LampMap& map,
                                                             std::vector<CeilingView> views,
                                                             bool tilt_is_free) {
  std::map<int, std::vector<double>> outliers_m;
  remove_unconnected_detections(views);
  const std::size_t detections = count_detections(views);
  std::optional<LampDisplacements> found = solve_lamp_displacements(map, views, tilt_is_free);
  while (found && reject_detection_outliers(views, *found, outliers_m)) {
    remove_unconnected_detections(views);
    found = solve_lamp_displacements(map, views, tilt_is_free);
  }
  if (!found) return std::nullopt;
  found->height_m = views.front().lamps.front().above_camera_m;
  found->outliers_m = std::move(outliers_m);
  found->inlier_fraction =
      static_cast<double>(count_detections(views)) / static_cast<double>(detections);
  return found;
}

std::optional<Eigen::Vector2d> compute_lamp_offset_relative_to_others(
    const LampDisplacements& found, std::size_t lamp, const std::vector<std::size_t>& excluded) {
  std::vector<Eigen::Vector2d> from_m, to_m;
  for (std::size_t i = 0; i < found.lamps.size(); ++i) {
    if (std::find(excluded.begin(), excluded.end(), i) != excluded.end()) continue;
    from_m.push_back(found.displaced_lamp_position_m(i));
    to_m.push_back(found.map_m[i]);
  }
  const auto to_map = fit_similarity_transform(
      from_m.size(), [&](std::size_t i) { return from_m[i]; },
      [&](std::size_t i) { return to_m[i]; });
  if (!to_map) return std::nullopt;
  return to_map->offset + complex_product(to_map->factor, found.displaced_lamp_position_m(lamp)) -
         found.map_m[lamp];
}

std::vector<LampOffset> compute_lamp_offsets_relative_to_others(const LampDisplacements& found) {
  constexpr double min_own_fraction = 1e-3;
  std::vector<LampOffset> offsets;
  for (std::size_t i = 0; i < found.lamps.size(); ++i) {
    const auto row = 2 * static_cast<Eigen::Index>(i);
    const double own_fraction = found.projector(row, row);
    const auto offset_m = compute_lamp_offset_relative_to_others(found, i, {i});
    if (own_fraction < min_own_fraction || !offset_m) continue;
    const Eigen::Vector2d sd_m =
        found.covariance_m2.diagonal().segment<2>(row).cwiseMax(0).cwiseSqrt() / own_fraction;
    offsets.push_back({found.lamps[i], found.captures[i], found.map_m[i], *offset_m, sd_m});
  }
  return offsets;
}

}  // namespace vlp
