// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "camera/random_lens.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "camera/distortion.h"
#include "camera/fisheye.h"

namespace vlp {
namespace {

const double kTan60 = std::sqrt(3);

/// Bounds of the twelve distortion coefficients: wide-angle barrel to pincushion, with prisms and
/// decentering larger than those of a real lens.
constexpr double kBounds[][2] = {{-0.35, 0.2},  {-0.1, 0.2},   {-2e-3, 2e-3}, {-2e-3, 2e-3},
                                 {-0.02, 0.03}, {-0.05, 0.4},  {-0.05, 0.15}, {-0.01, 0.02},
                                 {-2e-3, 2e-3}, {-5e-4, 5e-4}, {-2e-3, 2e-3}, {-5e-4, 5e-4}};

}  // namespace

std::vector<double> splined_parameters(const SplineGrid& grid, double error, Random& random) {
  const double edge = 2 * std::tan(grid.fov_x_deg * std::numbers::pi / 720);
  const double apart = 2 * edge / (grid.nx - grid.order);
  std::vector<double> parameters{400, 401, 402, 297};
  for (int row = 0; row < grid.ny; ++row) {
    for (int column = 0; column < grid.nx; ++column) {
      const Eigen::Vector2d u =
          apart * Eigen::Vector2d(column - (grid.nx - 1) / 2.0, row - (grid.ny - 1) / 2.0);
      const double norm = u.norm(), fraction = norm > 0 ? 2 * std::atan(norm / 2) / norm - 1 : 0;
      const double y = random.uniform(-error, error), x = random.uniform(-error, error);
      parameters.insert(parameters.end(), {fraction * u.x() + x, fraction * u.y() + y});
    }
  }
  return parameters;
}

std::vector<double> random_parameters(LensModel model, Random& random) {
  for (;;) {
    std::vector<double> parameters(4);
    for (std::size_t i = 0; i < 4; ++i) {
      constexpr double bounds[][2] = {{300, 900}, {300, 900}, {350, 450}, {250, 350}};
      parameters[i] = random.uniform(bounds[i][0], bounds[i][1]);
    }
    if (is_splined_lens_model(model)) {
      constexpr double error = 0.01;  // at most a twentieth of the way to the next control point
      const auto splined = splined_parameters(spline_grid_of(model), error, random);
      parameters.insert(parameters.end(), splined.begin() + 4, splined.end());
      return parameters;
    }
    if (model == LensModel::fisheye) {
      for (const double bound : {0.05, 0.02, 0.01, 0.002}) {
        parameters.push_back(random.uniform(-bound, bound));
      }
      const Fisheye fisheye{{parameters[4], parameters[5], parameters[6], parameters[7]}};
      if (fisheye.compute_max_angle_rad() > 1.7) return parameters;
      continue;
    }
    Distortion distortion;
    for (std::size_t i = 0; i + 4 < num_lens_parameters(model); ++i) {
      distortion.k[i] = random.uniform(kBounds[i][0], kBounds[i][1]);
      parameters.push_back(distortion.k[i]);
    }
    if (distortion.compute_max_radius() > 1.1 * kTan60) return parameters;
  }
}

Eigen::Vector3d random_point(Random& random) {
  const double off_axis_rad = random.uniform(0, std::numbers::pi / 3);
  const double around_rad = random.uniform(-std::numbers::pi, std::numbers::pi);
  return random.uniform(1, 10) * Eigen::Vector3d(std::sin(off_axis_rad) * std::cos(around_rad),
                                                 std::sin(off_axis_rad) * std::sin(around_rad),
                                                 std::cos(off_axis_rad));
}

std::vector<double> parameters_with(LensModel model, const std::vector<double>& distortion) {
  std::vector<double> parameters{520, 520, 399.5, 299.5};
  parameters.insert(parameters.end(), distortion.begin(), distortion.end());
  parameters.resize(num_lens_parameters(model));
  return parameters;
}

Eigen::Matrix2Xd parameter_jacobian(const Lens& lens, const Eigen::Vector3d& x_in_camera) {
  const auto [parameters, d_pixel] = lens.differentiate_intrinsics(x_in_camera).value();
  const auto count = static_cast<Eigen::Index>(num_lens_parameters(lens.lens_model()));
  Eigen::Matrix2Xd jacobian = Eigen::Matrix2Xd::Zero(2, count);
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    jacobian.col(parameters[i]) = d_pixel.col(static_cast<Eigen::Index>(i));
  }
  return jacobian;
}

double angle_rad(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace vlp
