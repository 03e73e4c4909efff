// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0

// Compares the lens evaluation with mrcal and OpenCV: the same lens, points and pixels, in one run.
// items_per_second counts points. worst_px is the maximum distance of 1000 pixels from the
// reprojection of their rays, here and for OpenCV. OpenCV's default of five iterations for OPENCVn
// leaves residuals; `exact` iterates to 1e-8 px, as here. cv::fisheye runs at most ten Newton
// steps, until the last one is below 1e-8, which is exact.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <string>
#include <vector>

#include "camera/lens.h"
#include "camera/spline_grid.h"
#include "support/mrcal_oracle.h"
#include "support/random.h"

namespace vlp {
namespace {

constexpr std::size_t kPoints = 1000;

constexpr LensModel kSplined = splined_lens_model({3, 16, 14, 150});

/// Equidistant.
std::vector<double> splined_parameters(const SplineGrid& grid) {
  std::vector<double> parameters{400, 401, 399.5, 299.5};
  const double edge = 2 * std::tan(grid.fov_x_deg * std::numbers::pi / 720);
  const double apart = 2 * edge / (grid.nx - grid.order);
  for (int row = 0; row < grid.ny; ++row) {
    for (int column = 0; column < grid.nx; ++column) {
      const double x = apart * (column - (grid.nx - 1) / 2.0),
                   y = apart * (row - (grid.ny - 1) / 2.0);
      const double u = std::hypot(x, y), scale = 2 * std::atan(u / 2) / u - 1;
      parameters.insert(parameters.end(), {scale * x, scale * y});
    }
  }
  return parameters;
}

std::vector<double> lens_parameters(LensModel model) {
  if (is_splined_lens_model(model)) return splined_parameters(spline_grid_of(model));
  if (model == LensModel::fisheye) return {400, 401, 399.5, 299.5, 0.03, -0.012, 0.004, -0.0006};
  std::vector<double> parameters{520,   521,  399.5, 299.5, -0.28, 0.09,  1e-4,  -2e-4,
                                 -0.01, 0.02, 0.01,  0.001, 1e-3,  -5e-4, -1e-3, 5e-4};
  parameters.resize(num_lens_parameters(model));
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

/// Returns points at one to three meters that `lens` images at the random pixels.
std::vector<Eigen::Vector3d> points_seen_by(const Lens& lens) {
  Random random(2);
  std::vector<Eigen::Vector3d> points;
  for (const auto& pixel : random_pixels()) {
    points.push_back(lens.unproject_pixel(pixel).value().direction * random.uniform(1, 3));
  }
  return points;
}

MrcalOracle make_oracle(LensModel model) {
  return {std::string(lens_model_name(model)), lens_parameters(model)};
}

void count_points(benchmark::State& state) {
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kPoints));
}

/// `get_ray` returns the ray found for the i-th pixel.
template <typename RayOf>
void report_worst(benchmark::State& state, LensModel model, const RayOf& get_ray) {
  const Lens lens(model, lens_parameters(model));
  const auto pixels = random_pixels();
  double worst_px = 0;
  for (std::size_t i = 0; i < kPoints; ++i) {
    worst_px = std::max(worst_px, (lens.project_point(get_ray(i)).value() - pixels[i]).norm());
  }
  state.counters["worst_px"] = worst_px;
}

void unproject_here(benchmark::State& state, LensModel model) {
  const Lens lens(model, lens_parameters(model));
  const auto pixels = random_pixels();
  for (auto _ : state) {
    for (const auto& pixel : pixels) benchmark::DoNotOptimize(lens.unproject_pixel(pixel));
  }
  count_points(state);
  report_worst(state, model,
               [&](std::size_t i) { return lens.unproject_pixel(pixels[i]).value().direction; });
}

void unproject_mrcal(benchmark::State& state, LensModel model) {
  const MrcalOracle oracle = make_oracle(model);
  const auto pixels = random_pixels();
  for (auto _ : state) benchmark::DoNotOptimize(oracle.unproject(pixels));
  count_points(state);
}

void project_here(benchmark::State& state, LensModel model) {
  const Lens lens(model, lens_parameters(model));
  const auto points = points_seen_by(lens);
  for (auto _ : state) {
    for (const auto& point : points) benchmark::DoNotOptimize(lens.project_point(point));
  }
  count_points(state);
}

void project_mrcal(benchmark::State& state, LensModel model) {
  const MrcalOracle oracle = make_oracle(model);
  const auto points = points_seen_by(Lens(model, lens_parameters(model)));
  for (auto _ : state) benchmark::DoNotOptimize(oracle.project(points));
  count_points(state);
}

struct CvCamera {
  explicit CvCamera(LensModel model) {
    const std::vector<double> p = lens_parameters(model);
    matrix = {p[0], 0, p[2], 0, p[1], p[3], 0, 0, 1};
    distortions.assign(p.begin() + 4, p.end());
  }

  cv::Matx33d matrix;
  std::vector<double> distortions;
};

void unproject_opencv(benchmark::State& state, LensModel model, bool exact) {
  const CvCamera camera(model);
  constexpr int default_iterations = 5, max_iterations = 200;
  const cv::TermCriteria criteria =
      exact
          ? cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, max_iterations, 1e-8)
          : cv::TermCriteria(cv::TermCriteria::COUNT, default_iterations, 0);
  std::vector<cv::Point2d> pixels, planes;
  for (const auto& pixel : random_pixels()) pixels.emplace_back(pixel.x(), pixel.y());
  for (auto _ : state) {
    if (model == LensModel::fisheye) {
      cv::fisheye::undistortPoints(pixels, planes, camera.matrix, camera.distortions);
    } else {
      cv::undistortPoints(pixels, planes, camera.matrix, camera.distortions, cv::noArray(),
                          cv::noArray(), criteria);
    }
    benchmark::DoNotOptimize(planes.data());
  }
  count_points(state);
  report_worst(state, model,
               [&](std::size_t i) { return Eigen::Vector3d(planes[i].x, planes[i].y, 1); });
}

void project_opencv(benchmark::State& state, LensModel model) {
  const CvCamera camera(model);
  std::vector<cv::Point3d> points;
  for (const auto& point : points_seen_by(Lens(model, lens_parameters(model)))) {
    points.emplace_back(point.x(), point.y(), point.z());
  }
  const cv::Vec3d none(0, 0, 0);
  std::vector<cv::Point2d> pixels;
  for (auto _ : state) {
    if (model == LensModel::fisheye) {
      cv::fisheye::projectPoints(points, pixels, none, none, camera.matrix, camera.distortions);
    } else {
      cv::projectPoints(points, none, none, camera.matrix, camera.distortions, pixels);
    }
    benchmark::DoNotOptimize(pixels.data());
  }
  count_points(state);
}

#define VLP_BENCHMARK_MRCAL(name, model)           \
  BENCHMARK_CAPTURE(unproject_here, name, model);  \
  BENCHMARK_CAPTURE(unproject_mrcal, name, model); \
  BENCHMARK_CAPTURE(project_here, name, model);    \
  BENCHMARK_CAPTURE(project_mrcal, name, model)
#define VLP_BENCHMARK_OPENCV(name, model)                         \
  VLP_BENCHMARK_MRCAL(name, model);                               \
  BENCHMARK_CAPTURE(unproject_opencv, name, model, false);        \
  BENCHMARK_CAPTURE(unproject_opencv, name##_exact, model, true); \
  BENCHMARK_CAPTURE(project_opencv, name, model)

VLP_BENCHMARK_OPENCV(opencv4, LensModel::opencv4);
VLP_BENCHMARK_OPENCV(opencv5, LensModel::opencv5);
VLP_BENCHMARK_OPENCV(opencv8, LensModel::opencv8);
VLP_BENCHMARK_OPENCV(opencv12, LensModel::opencv12);
VLP_BENCHMARK_MRCAL(splined, kSplined);
BENCHMARK_CAPTURE(unproject_here, fisheye, LensModel::fisheye);
BENCHMARK_CAPTURE(unproject_opencv, fisheye, LensModel::fisheye, true);
BENCHMARK_CAPTURE(project_here, fisheye, LensModel::fisheye);
BENCHMARK_CAPTURE(project_opencv, fisheye, LensModel::fisheye);

}  // namespace
}  // namespace vlp
