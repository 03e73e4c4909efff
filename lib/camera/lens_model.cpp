// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "camera/lens_model.h"

#include <array>

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

}  // namespace

std::string_view name_of(LensModel model) { return entry_of(model).name; }

std::optional<LensModel> lens_model_from_name(std::string_view name) {
  for (const Entry& entry : kModels) {
    if (entry.name == name) return entry.model;
  }
  return std::nullopt;
}

std::string lens_model_names() {
  std::string names;
  for (const Entry& entry : kModels) names += (names.empty() ? "" : ", ") + std::string(entry.name);
  return names;
}

std::size_t parameter_count(LensModel model) { return entry_of(model).parameters; }

}  // namespace vlp
