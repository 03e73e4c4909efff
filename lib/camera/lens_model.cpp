// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "camera/lens_model.h"

#include <map>
#include <mutex>

#include "camera/lens_table.h"
#include "camera/spline_grid.h"

namespace vlp {
namespace {

/// Returns the name of a splined lens. Names are created at the first call and kept.
std::string_view make_splined_name(LensModel model) {
  static std::mutex mutex;
  static std::map<LensModel, std::string> names;
  const std::lock_guard alone(mutex);
  const auto [entry, added] = names.try_emplace(model);
  if (added) entry->second = splined_lens_name(spline_grid_of(model));
  return entry->second;
}

}  // namespace

std::string_view lens_model_name(LensModel model) {
  return is_splined_lens_model(model) ? make_splined_name(model)
                                      : list_lens_models()[static_cast<std::size_t>(model)].name;
}

std::optional<LensModel> lens_model_from_name(std::string_view name) {
  for (const LensModelRow& row : list_lens_models()) {
    if (row.name == name) return row.model;
  }
  if (const auto grid = parse_spline_grid(name)) return splined_lens_model(*grid);
  return std::nullopt;
}

std::string list_lens_model_names() {
  std::string names;
  for (const LensModelRow& row : list_lens_models()) names.append(row.name).append(", ");
  return names + "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=16_Ny=14_fov_x_deg=190 and its like";
}

std::size_t num_lens_parameters(LensModel model) {
  constexpr std::size_t core = 4;
  return core + (is_splined_lens_model(model) ? 2 * spline_grid_of(model).num_control_points()
                                              : list_distortions(model).size());
}

}  // namespace vlp
