// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/edge_crossing.h"

#include <ceres/tiny_solver.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "detection/boards/blurred_step.h"

namespace vlp {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;

bool is_inside_margin(const cv::Mat1f& image, const Eigen::Vector2i& at, int radius) {
  return at.x() >= radius && at.y() >= radius && at.x() + radius < image.cols &&
         at.y() + radius < image.rows;
}

/// Returns the negative determinant of the Hessian, from differences over two pixels.
float compute_saddle_strength(const cv::Mat1f& image, int column, int row) {
  constexpr int step = 2;
  const auto at = [&](int x, int y) { return image(row + step * y, column + step * x); };
  const float xx = at(-1, 0) - 2 * at(0, 0) + at(1, 0);
  const float yy = at(0, -1) - 2 * at(0, 0) + at(0, 1);
  const float xy = (at(1, 1) - at(-1, 1) - at(1, -1) + at(-1, -1)) / 4;
  return xy * xy - xx * yy;
}

std::optional<Eigen::Vector2i> find_strongest_saddle(const cv::Mat1f& image,
                                                     const Eigen::Vector2d& guess_px, int reach) {
  constexpr int room = 2;
  const Eigen::Vector2i middle = guess_px.array().round().cast<int>();
  std::optional<Eigen::Vector2i> best;
  float max_strength = 0;
  for (int y = -reach; y <= reach; ++y) {
    for (int x = -reach; x <= reach; ++x) {
      const Eigen::Vector2i at = middle + Eigen::Vector2i(x, y);
      if (x * x + y * y > reach * reach || !is_inside_margin(image, at, room)) continue;
      const float value = compute_saddle_strength(image, at.x(), at.y());
      if (value <= max_strength) continue;
      max_strength = value;
      best = at;
    }
  }
  return best;
}

/// Fits a quadratic surface in a window and returns its saddle point relative to the center of the
/// window; std::nullopt if it has no saddle.
std::optional<Eigen::Vector2d> fit_saddle_offset(const cv::Mat1f& image,
                                                 const Eigen::Vector2i& middle, int radius) {
  Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
  Vector6 right = Vector6::Zero();
  for (int y = -radius; y <= radius; ++y) {
    for (int x = -radius; x <= radius; ++x) {
      if (x * x + y * y > radius * radius) continue;
      const Vector6 terms{{double(x * x), double(x * y), double(y * y), double(x), double(y), 1}};
      normal += terms * terms.transpose();
      right += terms * double(image(middle.y() + y, middle.x() + x));
    }
  }
  const Vector6 fit = normal.ldlt().solve(right);
  Eigen::Matrix2d curvature;
  curvature << 2 * fit[0], fit[1], fit[1], 2 * fit[2];
  if (!(curvature.determinant() < 0)) return {};
  return -curvature.inverse() * fit.segment<2>(3);
}

struct CrossingPixel {
  Eigen::Vector2d offset;
  double gray;
};

/// Residuals and Jacobian for ceres::TinySolver. Parameters: corner relative to the guess (2),
/// angles of the edges (2), blur, middle, contrast, light (2), curvatures of the edges (2).
struct Crossing {
  using Scalar = double;
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = 11 };
  using Parameters = Eigen::Matrix<double, NUM_PARAMETERS, 1>;

  const std::vector<CrossingPixel>& pixels;

  int NumResiduals() const { return static_cast<int>(pixels.size()); }

  bool operator()(const double* p, double* residuals, double* jacobian) const {
    const Eigen::Vector2d corner(p[0], p[1]), light(p[7], p[8]);
    const Eigen::Vector2d along1(std::cos(p[2]), std::sin(p[2]));
    const Eigen::Vector2d along2(std::cos(p[3]), std::sin(p[3]));
    const Eigen::Vector2d normal1(-along1.y(), along1.x()), normal2(-along2.y(), along2.x());
    const Blur blur(p[4]);
    const auto rows = static_cast<Eigen::Index>(pixels.size());
    for (Eigen::Index i = 0; i < rows; ++i) {
      const auto& [offset, gray] = pixels[static_cast<std::size_t>(i)];
      const Eigen::Vector2d at = offset - corner;
      const double u1 = along1.dot(at), u2 = along2.dot(at);
      const double v1 = normal1.dot(at), v2 = normal2.dot(at);
      const BlurredStep step1(v1 - p[9] * u1 * u1, blur), step2(v2 - p[10] * u2 * u2, blur);
      const double lit = 1 + light.dot(at), pattern = step1.value * step2.value;
      const double unlit = p[5] + p[6] * pattern;
      residuals[i] = unlit * lit - gray;
      if (jacobian == nullptr) continue;
      const double by_one = lit * p[6] * step1.slope * step2.value;
      const double by_two = lit * p[6] * step1.value * step2.slope;
      const Eigen::Vector2d by_corner = by_one * (2 * p[9] * u1 * along1 - normal1) +
                                        by_two * (2 * p[10] * u2 * along2 - normal2) -
                                        unlit * light;
      Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, NUM_PARAMETERS>> all(jacobian, rows,
                                                                            NUM_PARAMETERS);
      all.row(i) << by_corner.transpose(), -by_one * u1 * (1 + 2 * p[9] * v1),
          -by_two * u2 * (1 + 2 * p[10] * v2),
          lit * p[6] * (step1.d_value_d_blur * step2.value + step1.value * step2.d_value_d_blur),
          lit, lit * pattern, unlit * at.transpose(), -by_one * u1 * u1, -by_two * u2 * u2;
    }
    return true;
  }
};

std::vector<CrossingPixel> collect_pixels_near_corner(const cv::Mat1b& image,
                                                      const Eigen::Vector2d& guess_px,
                                                      double radius_px) {
  const Eigen::Vector2i roi_min = (guess_px.array() - radius_px).ceil().cast<int>().max(0);
  const Eigen::Vector2i roi_max = (guess_px.array() + radius_px)
                                      .floor()
                                      .cast<int>()
                                      .min(Eigen::Array2i(image.cols - 1, image.rows - 1));
  std::vector<CrossingPixel> pixels;
  for (int row = roi_min.y(); row <= roi_max.y(); ++row) {
    for (int column = roi_min.x(); column <= roi_max.x(); ++column) {
      const Eigen::Vector2d offset = Eigen::Vector2d(column, row) - guess_px;
      if (offset.norm() > radius_px) continue;
      pixels.push_back({offset, static_cast<double>(image(row, column))});
    }
  }
  return pixels;
}

/// Computes the initial middle and contrast for the other parameters by linear regression.
void initialize_levels(const std::vector<CrossingPixel>& pixels, Crossing::Parameters& p) {
  p[5] = 0;
  p[6] = 1;
  const Crossing crossing{pixels};
  Eigen::VectorXd pattern(crossing.NumResiduals()), gray(crossing.NumResiduals());
  crossing(p.data(), pattern.data(), nullptr);
  for (Eigen::Index i = 0; i < gray.size(); ++i) gray[i] = pixels[static_cast<std::size_t>(i)].gray;
  pattern += gray;  // from the residuals
  const Eigen::VectorXd swing = pattern.array() - pattern.mean();
  p[6] = swing.dot(gray) / std::max(swing.squaredNorm(), 1e-9);
  p[5] = gray.mean() - p[6] * pattern.mean();
}

}  // namespace

std::optional<Eigen::Vector2d> find_saddle_point(const cv::Mat1f& smoothed,
                                                 const Eigen::Vector2d& guess_px, int reach_px,
                                                 int radius_px) {
  constexpr int max_iterations = 5;
  constexpr double max_displacement_px = 2;
  const auto initial_pixel = find_strongest_saddle(smoothed, guess_px, reach_px);
  if (!initial_pixel) return {};
  Eigen::Vector2i middle = *initial_pixel;
  for (int step = 1;; ++step) {
    if (!is_inside_margin(smoothed, middle, radius_px)) return {};
    const auto offset = fit_saddle_offset(smoothed, middle, radius_px);
    if (!offset) return {};
    const Eigen::Vector2d point = middle.cast<double>() + *offset;
    if (!((point - initial_pixel->cast<double>()).norm() <= max_displacement_px)) return {};
    const Eigen::Vector2i nearest = point.array().round().cast<int>();
    if (nearest == middle || step == max_iterations) return point;
    middle = nearest;
  }
}

std::optional<Eigen::Vector2d> fit_edge_intersection_at_corner(
    const cv::Mat1b& image, const Eigen::Vector2d& guess_px,
    const std::array<Eigen::Vector2d, 2>& along, double radius_px) {
  constexpr std::size_t min_pixels = 16;
  constexpr int max_iterations = 15;
  constexpr double initial_blur_px = 0.8, min_blur_px = 0.05, max_displacement_px = 1.5;
  constexpr double function_tolerance = 1e-3;  // gray levels squared
  constexpr double min_contrast = 3, max_relative_rms = 0.35;
  const auto pixels = collect_pixels_near_corner(image, guess_px, radius_px);
  if (pixels.size() < min_pixels) return {};
  Crossing::Parameters p = Crossing::Parameters::Zero();
  p[2] = std::atan2(along[0].y(), along[0].x());
  p[3] = std::atan2(along[1].y(), along[1].x());
  p[4] = initial_blur_px;
  initialize_levels(pixels, p);

  const Crossing crossing{pixels};
  ceres::TinySolver<Crossing> solver;
  solver.options.max_num_iterations = max_iterations;
  solver.options.function_tolerance = function_tolerance;
  solver.Solve(crossing, &p);
  const double rms = std::sqrt(2 * solver.summary.final_cost / static_cast<double>(pixels.size()));
  const bool is_accepted = p.allFinite() && p.head<2>().norm() < max_displacement_px &&
                           p[4] > min_blur_px && p[4] < radius_px &&
                           std::abs(p[6]) > min_contrast && rms < max_relative_rms * std::abs(p[6]);
  if (!is_accepted) return {};
  return guess_px + p.head<2>();
}

}  // namespace vlp
