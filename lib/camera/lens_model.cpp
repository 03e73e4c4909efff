// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "camera/lens_model.h"

#include <array>
#include <map>
#include <mutex>

#include "camera/spline_grid.h"

namespace vlp {
namespace {

struct Entry {
  LensModel model;
  std::string_view name;
  std::size_t parameters;
};

// In the order of the enumeration.
constexpr std::array<Entry, 7> kModels{{{LensModel::pinhole, "LENSMODEL_PINHOLE", 4},
                                        {LensModel::stereographic, "LENSMODEL_STEREOGRAPHIC", 4},
                                        {LensModel::opencv4, "LENSMODEL_OPENCV4", 8},
                                        {LensModel::opencv5, "LENSMODEL_OPENCV5", 9},
                                        {LensModel::opencv8, "LENSMODEL_OPENCV8", 12},
                                        {LensModel::opencv12, "LENSMODEL_OPENCV12", 16},
                                        {LensModel::fisheye, "OPENCV_FISHEYE", 8}}};

const Entry& entry_of(LensModel model) { return kModels[static_cast<std::size_t>(model)]; }

/// Names of splined lenses are made when they are asked for, and kept.
std::string_view splined_name_of(LensModel model) {
  static std::mutex mutex;
  static std::map<LensModel, std::string> names;
  const std::lock_guard alone(mutex);
  const auto [entry, added] = names.try_emplace(model);
  if (added) entry->second = name_of(grid_of(model));
  return entry->second;
}

}  // namespace

std::string_view name_of(LensModel model) {
  return is_splined(model) ? splined_name_of(model) : entry_of(model).name;
}

std::optional<LensModel> lens_model_from_name(std::string_view name) {
  for (const Entry& entry : kModels) {
    if (entry.name == name) return entry.model;
  }
  if (const auto grid = spline_grid_from_name(name)) return splined_lens(*grid);
  return std::nullopt;
}

std::string lens_model_names() {
  std::string names;
  for (const Entry& entry : kModels) names.append(entry.name).append(", ");
  return names + "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=16_Ny=14_fov_x_deg=190 and its like";
}

std::size_t parameter_count(LensModel model) {
  constexpr std::size_t core = 4;
  return is_splined(model) ? core + 2 * grid_of(model).control_points()
                           : entry_of(model).parameters;
}

}  // namespace vlp
