// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "support/mrcal_oracle.h"

// Headers of mrcal 2.2 lack extern "C"; the headers that they include must come first.
#include <stdbool.h>
#include <stdint.h>
extern "C" {
#include <mrcal/mrcal.h>
}

#include <stdexcept>
#include <utility>

namespace vlp {
namespace {

static_assert(sizeof(Eigen::Vector2d) == sizeof(mrcal_point2_t));
static_assert(sizeof(Eigen::Vector3d) == sizeof(mrcal_point3_t));

mrcal_lensmodel_t lens_model(const std::string& name) {
  mrcal_lensmodel_t model;
  if (!mrcal_lensmodel_from_name(&model, name.c_str())) {
    throw std::runtime_error("mrcal does not support " + name);
  }
  return model;
}

void check(bool done, const char* function) {
  if (!done) throw std::runtime_error(std::string(function) + " failed");
}

}  // namespace

MrcalOracle::MrcalOracle(std::string model, std::vector<double> parameters)
    : model_(std::move(model)), parameters_(std::move(parameters)) {
  const mrcal_lensmodel_t lens = lens_model(model_);
  if (mrcal_lensmodel_num_params(&lens) != static_cast<int>(parameters_.size())) {
    throw std::runtime_error("mrcal wants another number of parameters for " + model_);
  }
}

std::vector<Eigen::Vector2d> MrcalOracle::project(std::span<const Eigen::Vector3d> points) const {
  const mrcal_lensmodel_t lens = lens_model(model_);
  std::vector<Eigen::Vector2d> pixels(points.size());
  check(mrcal_project(reinterpret_cast<mrcal_point2_t*>(pixels.data()), nullptr, nullptr,
                      reinterpret_cast<const mrcal_point3_t*>(points.data()),
                      static_cast<int>(points.size()), &lens, parameters_.data()),
        "mrcal_project");
  return pixels;
}

MrcalOracle::Gradients MrcalOracle::gradients(const Eigen::Vector3d& point) const {
  const mrcal_lensmodel_t lens = lens_model(model_);
  const auto count = static_cast<Eigen::Index>(parameters_.size());
  const mrcal_point3_t p{{point.x(), point.y(), point.z()}};
  mrcal_point2_t pixel;
  mrcal_point3_t by_point[2];
  Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::RowMajor> by_parameters(2, count);
  check(mrcal_project(&pixel, by_point, by_parameters.data(), &p, 1, &lens, parameters_.data()),
        "mrcal_project");
  Gradients gradients;
  for (int i = 0; i < 2; ++i) {
    gradients.d_pixel_d_point.row(i) << by_point[i].x, by_point[i].y, by_point[i].z;
  }
  gradients.d_pixel_d_parameters = by_parameters;
  return gradients;
}

std::vector<Eigen::Vector3d> MrcalOracle::unproject(std::span<const Eigen::Vector2d> pixels) const {
  const mrcal_lensmodel_t lens = lens_model(model_);
  std::vector<Eigen::Vector3d> rays(pixels.size());
  check(mrcal_unproject(reinterpret_cast<mrcal_point3_t*>(rays.data()),
                        reinterpret_cast<const mrcal_point2_t*>(pixels.data()),
                        static_cast<int>(pixels.size()), &lens, parameters_.data()),
        "mrcal_unproject");
  return rays;
}

}  // namespace vlp
