// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "lens_model.h"

namespace vlp {

/// Grid of the control points of a splined lens, which mrcal's name of the model contains:
///   LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=16_Ny=14_fov_x_deg=190
struct SplineGrid {
  /// Degree of the B-spline polynomials: 2 (quadratic) or 3 (cubic). mrcal calls it the order.
  int order;
  /// Number of control points along x and y, more than `order` and at most kMaxKnots.
  int nx, ny;
  /// Field of view from the left to the right end of the grid, 1 to kMaxFov_deg.
  int fov_x_deg;

  static constexpr int kMaxKnots = 255, kMaxFov_deg = 359;

  std::size_t num_control_points() const {
    return static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny);
  }
  bool operator==(const SplineGrid&) const = default;
};

/// Returns the LensModel of the splined lens with this grid. Its value holds the four numbers of
/// the grid in separate bits, above the enumerators of LensModel.
/// @pre The numbers are within the bounds of SplineGrid.
constexpr LensModel splined_lens_model(const SplineGrid& grid) {
  return static_cast<LensModel>(1 << 30 | (grid.order - 2) << 29 | grid.fov_x_deg << 20 |
                                grid.nx << 10 | grid.ny);
}
/// Returns true if the model is a splined lens, with any grid.
constexpr bool is_splined_lens_model(LensModel model) { return static_cast<int>(model) >= 1 << 30; }

/// Returns the grid that is stored in the value of a splined lens model.
/// @pre is_splined_lens_model(model)
constexpr SplineGrid spline_grid_of(LensModel model) {
  const int bits = static_cast<int>(model);
  return {2 + (bits >> 29 & 1), bits >> 10 & 1023, bits & 1023, bits >> 20 & 511};
}

/// Parses the grid in mrcal's name of a splined lens. Returns std::nullopt if mrcal would write the
/// name differently, or if a number is out of the bounds of SplineGrid.
std::optional<SplineGrid> parse_spline_grid(std::string_view name);
/// Returns mrcal's name of the splined lens with this grid.
std::string splined_lens_name(const SplineGrid& grid);

}  // namespace vlp
