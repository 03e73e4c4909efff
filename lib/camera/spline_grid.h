// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "lens_model.h"

namespace vlp {

/// Where a splined lens has its control points, which mrcal's name of the model says:
///   LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=16_Ny=14_fov_x_deg=190
struct SplineGrid {
  /// 2 or 3: pieces of a quadratic or a cubic polynomial.
  int order;
  /// Along x and y, more than `order` and at most kMostKnots.
  int nx, ny;
  /// From the left end of the grid to the right, 1 to kMostFov_deg.
  int fov_x_deg;

  static constexpr int kMostKnots = 255, kMostFov_deg = 359;

  std::size_t control_points() const {
    return static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny);
  }
  bool operator==(const SplineGrid&) const = default;
};

/// A splined lens has a LensModel for each grid: above those that have names of their own, the
/// grid's four numbers side by side. Precondition: within the bounds of SplineGrid.
constexpr LensModel splined_lens(const SplineGrid& grid) {
  return static_cast<LensModel>(1 << 30 | (grid.order - 2) << 29 | grid.fov_x_deg << 20 |
                                grid.nx << 10 | grid.ny);
}
constexpr bool is_splined(LensModel model) { return static_cast<int>(model) >= 1 << 30; }

/// Of a splined lens. Precondition: is_splined().
constexpr SplineGrid grid_of(LensModel model) {
  const int bits = static_cast<int>(model);
  return {2 + (bits >> 29 & 1), bits >> 10 & 1023, bits & 1023, bits >> 20 & 511};
}

/// The grid in a name; nothing when it is not as mrcal writes it, or beyond the bounds.
std::optional<SplineGrid> spline_grid_from_name(std::string_view name);
std::string name_of(const SplineGrid& grid);

}  // namespace vlp
