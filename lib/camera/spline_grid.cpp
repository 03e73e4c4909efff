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

std::optional<SplineGrid> parse_spline_grid(std::string_view name) {
  SplineGrid grid{};
  const std::array numbers{&grid.order, &grid.nx, &grid.ny, &grid.fov_x_deg};
  std::string_view remaining = name;
  for (std::size_t i = 0; i < kWords.size(); ++i) {
    if (!remaining.starts_with(kWords[i])) return {};
    remaining.remove_prefix(kWords[i].size());
    const auto [end, error] =
        std::from_chars(remaining.data(), remaining.data() + remaining.size(), *numbers[i]);
    if (error != std::errc()) return {};
    remaining.remove_prefix(static_cast<std::size_t>(end - remaining.data()));
  }
  const auto is_valid_count = [&](int knots) {
    return knots > grid.order && knots <= SplineGrid::kMaxKnots;
  };
  const bool is_valid = (grid.order == 2 || grid.order == 3) && is_valid_count(grid.nx) &&
                        is_valid_count(grid.ny) && grid.fov_x_deg >= 1 &&
                        grid.fov_x_deg <= SplineGrid::kMaxFov_deg;
  // A model has exactly one name: no leading zeros.
  return is_valid && splined_lens_name(grid) == name ? std::optional(grid) : std::nullopt;
}

std::string splined_lens_name(const SplineGrid& grid) {
  std::string name;
  const std::array numbers{grid.order, grid.nx, grid.ny, grid.fov_x_deg};
  for (std::size_t i = 0; i < kWords.size(); ++i) {
    name.append(kWords[i]).append(std::to_string(numbers[i]));
  }
  return name;
}

}  // namespace vlp
