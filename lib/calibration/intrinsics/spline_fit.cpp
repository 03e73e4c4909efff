// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/spline_fit.h"

#include <fmt/core.h>

#include <Eigen/QR>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

#include "calibration/intrinsics/projection_difference.h"
#include "camera/spline_surface.h"
#include "geometry/angles.h"

namespace vlp {
namespace {

using Entries = std::vector<Eigen::Triplet<double>>;

/// Equations of the control points, the same for both directions of the plane.
struct Equations {
  Entries entries;
  std::vector<Eigen::RowVector2d> right;

  int next() const { return static_cast<int>(right.size()); }
};

/// Adds equations for small second differences of the control points, along columns and rows.
void add_smoothness(Equations& equations, const SplineGrid& grid) {
  constexpr double weight = 3e-4;  // small: changes the fit by 1e-5 px
  const auto add = [&](int first, int apart) {
    const int row = equations.next();
    equations.entries.emplace_back(row, first, weight);
    equations.entries.emplace_back(row, first + apart, -2 * weight);
    equations.entries.emplace_back(row, first + 2 * apart, weight);
    equations.right.emplace_back(0, 0);
  };
  for (int row = 0; row < grid.ny; ++row) {
    for (int column = 0; column < grid.nx; ++column) {
      const int first = row * grid.nx + column;
      if (column + 2 < grid.nx) add(first, 1);
      if (row + 2 < grid.ny) add(first, grid.nx);
    }
  }
}

/// Returns true if a surface without second differences is determined by its values at these
/// points.
bool is_surface_determined(const std::vector<Eigen::Vector2d>& positions) {
  constexpr Eigen::Index unknowns = 4;
  if (std::ssize(positions) < unknowns) return false;
  Eigen::Array2d min_value = positions.front(), max_value = min_value;
  for (const Eigen::Vector2d& u : positions) {
    min_value = min_value.min(u.array());
    max_value = max_value.max(u.array());
  }
  Eigen::MatrixX4d terms(std::ssize(positions), unknowns);
  for (Eigen::Index i = 0; i < terms.rows(); ++i) {
    const Eigen::Array2d fraction = (positions[static_cast<std::size_t>(i)].array() - min_value) /
                                    (max_value - min_value).max(1e-9);
    terms.row(i) << 1, fraction.x(), fraction.y(), fraction.prod();
  }
  constexpr double rank_tolerance = 1e-6;  // the shares are 0 to 1
  Eigen::ColPivHouseholderQR<Eigen::MatrixX4d> decomposition(terms);
  return decomposition.setThreshold(rank_tolerance).rank() == unknowns;
}

}  // namespace

std::optional<std::vector<double>> fit_splined_lens(const Lens& lens,
                                                    const std::array<int, 2>& imager_px,
                                                    LensModel model,
                                                    const std::vector<double>& core,
                                                    const Eigen::Matrix3d& lens_from_splined) {
  constexpr int rays_per_piece = 4;
  constexpr double margin = 0.05;  // of the image, around it
  const SplineGrid grid = spline_grid_of(model);
  const SplineSurface straight(grid, std::vector<double>(2 * grid.num_control_points()));
  const Eigen::Array2d focal_px(core[0], core[1]), center_px(core[2], core[3]);
  const Eigen::Array2d size_px(imager_px[0], imager_px[1]);
  Equations equations;
  add_smoothness(equations, grid);
  std::vector<Eigen::Vector2d> positions;
  const int columns = rays_per_piece * (grid.nx - grid.order),
            rows = rays_per_piece * (grid.ny - grid.order);
  for (int row = 0; row <= rows; ++row) {
    for (int column = 0; column <= columns; ++column) {
      const Eigen::Array2d fraction(double(column) / columns, double(row) / rows);
      const Eigen::Vector2d u = straight.spline_half_extent().array() * (2 * fraction - 1);
      const Eigen::Vector3d ray(u.x(), u.y(), 1 - u.squaredNorm() / 4);
      const auto pixel = lens.project_point(lens_from_splined * ray);
      if (!pixel || (pixel->array() < -margin * size_px).any() ||
          (pixel->array() > (1 + margin) * size_px).any()) {
        continue;
      }
      positions.push_back(u);
      const SplineSurface::Weights at = straight.look_up_weights(u);
      for (int j = 0; j <= grid.order; ++j) {
        for (int i = 0; i <= grid.order; ++i) {
          equations.entries.emplace_back(
              equations.next(), (at.row + j) * grid.nx + at.column + i,
              at.x[static_cast<std::size_t>(i)] * at.y[static_cast<std::size_t>(j)]);
        }
      }
      equations.right.emplace_back(((pixel->array() - center_px) / focal_px).matrix() - u);
    }
  }
  if (!is_surface_determined(positions)) return {};
  const auto points = static_cast<Eigen::Index>(grid.num_control_points());
  Eigen::SparseMatrix<double> left(equations.next(), points);
  left.setFromTriplets(equations.entries.begin(), equations.entries.end());
  Eigen::MatrixX2d right(equations.next(), 2);
  for (Eigen::Index i = 0; i < right.rows(); ++i) {
    right.row(i) = equations.right[static_cast<std::size_t>(i)];
  }
  const Eigen::SparseMatrix<double> normal = left.transpose() * left;
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(normal);
  if (factor.info() != Eigen::Success) return {};
  const Eigen::MatrixX2d found = factor.solve(left.transpose() * right);
  if (!found.allFinite()) return {};
  std::vector<double> parameters = core;
  for (Eigen::Index i = 0; i < points; ++i) {
    parameters.insert(parameters.end(), {found(i, 0), found(i, 1)});
  }
  return parameters;
}

std::string explain_coarse_grid(const Lens& lens, const std::array<int, 2>& imager_px,
                                LensModel model, const std::vector<double>& core) {
  constexpr double extension = 1.05;
  Eigen::Vector2d farthest(0, 0);
  for (const Eigen::Vector2d& pixel : make_pixel_grid(imager_px)) {
    const auto ray = lens.unproject_pixel(pixel);
    if (!ray) continue;
    const Eigen::Vector3d& x = ray->direction;
    farthest = farthest.cwiseMax(x.head<2>().cwiseAbs() * (2 / (x.norm() + x.z())));
  }
  SplineGrid finer = spline_grid_of(model);
  LensModel other = splined_lens_model(resize_spline_grid(finer, extension * farthest));
  while (!fit_splined_lens(lens, imager_px, other, core) && 2 * finer.nx <= SplineGrid::kMaxKnots) {
    finer.nx *= 2;
    other = splined_lens_model(resize_spline_grid(finer, extension * farthest));
  }
  const bool helps = fit_splined_lens(lens, imager_px, other, core).has_value();
  const auto angle_deg = [](double u) { return deg_from_rad(2 * std::atan(u / 2)); };
  return fmt::format(
      "the control points of {} do not cover the field of view, {:.0f} degrees off axis "
      "horizontally and {:.0f} vertically: use {}",
      lens_model_name(model), angle_deg(farthest.x()), angle_deg(farthest.y()),
      helps ? fmt::format("--lens {}", lens_model_name(other)) : "another model");
}

SplineGrid resize_spline_grid(const SplineGrid& grid, const Eigen::Vector2d& u) {
  constexpr double numeric_tolerance = 1e-9;  // keeps a grid that is wide enough
  const auto ceil_and_clamp = [](double min_value, double value, double max_value) {
    return static_cast<int>(std::clamp(std::ceil(value - numeric_tolerance), min_value, max_value));
  };
  SplineGrid wide = grid;
  wide.fov_x_deg =
      ceil_and_clamp(1, 4 * deg_from_rad(std::atan(u.x() / 2)), SplineGrid::kMaxFov_deg);
  const double edge = 2 * std::tan(rad_from_deg(wide.fov_x_deg) / 4);
  wide.ny = ceil_and_clamp(grid.order + 1,
                           grid.order + (grid.nx - grid.order) * std::min(u.y() / edge, 1e6),
                           SplineGrid::kMaxKnots);
  return wide;
}

std::vector<double> fit_spline_core(const Lens& lens, std::span<const Eigen::Vector2d> pixels) {
  Eigen::Array2d products(0, 0), squares(0, 0);
  for (const Eigen::Vector2d& pixel : pixels) {
    const auto ray = lens.unproject_pixel(pixel);
    if (!ray) continue;
    const Eigen::Vector3d& x = ray->direction;
    const Eigen::Array2d u = x.head<2>() * (2 / (x.norm() + x.z()));
    products += u * (pixel - lens.principal_point_px()).array();
    squares += u.square();
  }
  const Eigen::Array2d focal_px = products / squares;
  return {focal_px.x(), focal_px.y(), lens.principal_point_px().x(), lens.principal_point_px().y()};
}

}  // namespace vlp
