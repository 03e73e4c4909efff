// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "camera/spline_grid.h"

#include <array>
#include <charconv>
#include <system_error>

namespace vlp {
namespace {

constexpr std::array<std::string_view, 4> kWords{
    "LENSMODEL_SPLINED_STEREOGRAPHIC_order=", "_Nx=", "_Ny=", "_fov_x_deg="};

}  // namespace

std::optional<SplineGrid> spline_grid_from_name(std::string_view name) {
  SplineGrid grid{};
  const std::array numbers{&grid.order, &grid.nx, &grid.ny, &grid.fov_x_deg};
  std::string_view rest = name;
  for (std::size_t i = 0; i < kWords.size(); ++i) {
    if (!rest.starts_with(kWords[i])) return {};
    rest.remove_prefix(kWords[i].size());
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), *numbers[i]);
    if (error != std::errc()) return {};
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
  }
  const auto fits = [&](int knots) {
    return knots > grid.order && knots <= SplineGrid::kMostKnots;
  };
  const bool known = (grid.order == 2 || grid.order == 3) && fits(grid.nx) && fits(grid.ny) &&
                     grid.fov_x_deg >= 1 && grid.fov_x_deg <= SplineGrid::kMostFov_deg;
  // A model has exactly one name: no leading zeros.
  return known && name_of(grid) == name ? std::optional(grid) : std::nullopt;
}

std::string name_of(const SplineGrid& grid) {
  std::string name;
  const std::array numbers{grid.order, grid.nx, grid.ny, grid.fov_x_deg};
  for (std::size_t i = 0; i < kWords.size(); ++i) {
    name.append(kWords[i]).append(std::to_string(numbers[i]));
  }
  return name;
}

}  // namespace vlp
