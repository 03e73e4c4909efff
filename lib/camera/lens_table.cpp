// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "camera/lens_table.h"

#include <array>

#include "camera/spline_grid.h"

namespace vlp {
namespace {

constexpr std::array<LensDistortion, 12> kOpencv{{{"k1"},
                                                  {"k2"},
                                                  {"p1"},
                                                  {"p2"},
                                                  {"k3"},
                                                  {"k4"},
                                                  {"k5"},
                                                  {"k6"},
                                                  {"s1"},
                                                  {"s2"},
                                                  {"s3"},
                                                  {"s4"}}};
// 2 tan(a / 2) = a (1 + a^2 / 12 + ...)
constexpr std::array<LensDistortion, 4> kFisheye{
    {{"k1", 1 / 12.0}, {"k2", 1 / 120.0}, {"k3", 17 / 20160.0}, {"k4", 31 / 362880.0}}};

constexpr std::span kOpencvs(kOpencv);

constexpr std::array<LensModelRow, 7> kModels{
    {{LensModel::pinhole, "LENSMODEL_PINHOLE", {}},
     {LensModel::stereographic, "LENSMODEL_STEREOGRAPHIC", {}},
     {LensModel::opencv4, "LENSMODEL_OPENCV4", kOpencvs.first(4)},
     {LensModel::opencv5, "LENSMODEL_OPENCV5", kOpencvs.first(5)},
     {LensModel::opencv8, "LENSMODEL_OPENCV8", kOpencvs.first(8)},
     {LensModel::opencv12, "LENSMODEL_OPENCV12", kOpencvs},
     {LensModel::fisheye, "OPENCV_FISHEYE", kFisheye}}};
static_assert(kModels.size() == static_cast<std::size_t>(LensModel::fisheye) + 1);

}  // namespace

std::span<const LensModelRow> list_lens_models() { return kModels; }

std::span<const LensDistortion> list_distortions(LensModel model) {
  if (is_splined_lens_model(model)) return {};
  return kModels[static_cast<std::size_t>(model)].distortions;
}

}  // namespace vlp
