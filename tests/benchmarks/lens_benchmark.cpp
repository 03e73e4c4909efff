// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0

// The lens evaluated here beside mrcal: the same lens, points and pixels, in one run.
// items_per_second counts points.
#include <benchmark/benchmark.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "camera/lens.h"
#include "camera/spline_grid.h"
#include "support/mrcal_oracle.h"
#include "support/random.h"

namespace vlp {
namespace {

constexpr std::size_t kPoints = 1000;

constexpr LensModel kSplined = splined_lens({3, 16, 14, 150});

/// Equidistant.
std::vector<double> splined_parameters(const SplineGrid& grid) {
  std::vector<double> parameters{400, 401, 399.5, 299.5};
  const double edge = 2 * std::tan(grid.fov_x_deg * std::numbers::pi / 720);
  const double apart = 2 * edge / (grid.nx - grid.order);
  for (int row = 0; row < grid.ny; ++row) {
    for (int column = 0; column < grid.nx; ++column) {
      const double x = apart * (column - (grid.nx - 1) / 2.0),
                   y = apart * (row - (grid.ny - 1) / 2.0);
      const double u = std::hypot(x, y), share = 2 * std::atan(u / 2) / u - 1;
      parameters.insert(parameters.end(), {share * x, share * y});
    }
  }
  return parameters;
}

std::vector<double> parameters_of(LensModel model) {
  if (is_splined(model)) return splined_parameters(grid_of(model));
  std::vector<double> parameters{520,   521,  399.5, 299.5, -0.28, 0.09,  1e-4,  -2e-4,
                                 -0.01, 0.02, 0.01,  0.001, 1e-3,  -5e-4, -1e-3, 5e-4};
  parameters.resize(parameter_count(model));
  return parameters;
}

std::vector<Eigen::Vector2d> random_pixels() {
  Random random(1);
  std::vector<Eigen::Vector2d> pixels(kPoints);
  for (auto& pixel : pixels) {
    pixel.x() = random.uniform(-0.5, 799.5);
    pixel.y() = random.uniform(-0.5, 599.5);
  }
  return pixels;
}

/// Points one to three metres away that `lens` sees at the random pixels.
std::vector<Eigen::Vector3d> points_seen_by(const Lens& lens) {
  Random random(2);
  std::vector<Eigen::Vector3d> points;
  for (const auto& pixel : random_pixels()) {
    points.push_back(lens.unproject(pixel).value().direction * random.uniform(1, 3));
  }
  return points;
}

MrcalOracle oracle_of(LensModel model) {
  return {std::string(name_of(model)), parameters_of(model)};
}

void count_points(benchmark::State& state) {
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kPoints));
}

void unproject_here(benchmark::State& state, LensModel model) {
  const Lens lens(model, parameters_of(model));
  const auto pixels = random_pixels();
  for (auto _ : state) {
    for (const auto& pixel : pixels) benchmark::DoNotOptimize(lens.unproject(pixel));
  }
  count_points(state);
}

void unproject_mrcal(benchmark::State& state, LensModel model) {
  const MrcalOracle oracle = oracle_of(model);
  const auto pixels = random_pixels();
  for (auto _ : state) benchmark::DoNotOptimize(oracle.unproject(pixels));
  count_points(state);
}

void project_here(benchmark::State& state, LensModel model) {
  const Lens lens(model, parameters_of(model));
  const auto points = points_seen_by(lens);
  for (auto _ : state) {
    for (const auto& point : points) benchmark::DoNotOptimize(lens.project(point));
  }
  count_points(state);
}

void project_mrcal(benchmark::State& state, LensModel model) {
  const MrcalOracle oracle = oracle_of(model);
  const auto points = points_seen_by(Lens(model, parameters_of(model)));
  for (auto _ : state) benchmark::DoNotOptimize(oracle.project(points));
  count_points(state);
}

#define VLP_BENCHMARK_MODEL(name, model)           \
  BENCHMARK_CAPTURE(unproject_here, name, model);  \
  BENCHMARK_CAPTURE(unproject_mrcal, name, model); \
  BENCHMARK_CAPTURE(project_here, name, model);    \
  BENCHMARK_CAPTURE(project_mrcal, name, model)

VLP_BENCHMARK_MODEL(opencv4, LensModel::opencv4);
VLP_BENCHMARK_MODEL(opencv5, LensModel::opencv5);
VLP_BENCHMARK_MODEL(opencv8, LensModel::opencv8);
VLP_BENCHMARK_MODEL(opencv12, LensModel::opencv12);
VLP_BENCHMARK_MODEL(splined, kSplined);

}  // namespace
}  // namespace vlp
