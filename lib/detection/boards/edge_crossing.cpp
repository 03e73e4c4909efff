// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/edge_crossing.h"

#include <ceres/tiny_solver.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
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

/// Blurred border of one of the two black squares: 1 inside, 0 outside.
struct SquareBorder {
  SquareBorder(double depth_px, const Blur& blur) {
    const BlurredStep step(depth_px, blur);
    coverage = (1 + step.value) / 2;
    slope = step.slope / 2;
    d_coverage_d_blur = step.d_value_d_blur / 2;
  }

  double coverage, slope, d_coverage_d_blur;
};

/// Residuals and Jacobian for ceres::TinySolver. Parameters: corner relative to the guess (2),
/// angles of the edges (2), blur without that of a pixel, middle, contrast, light (2), curvatures
/// of the edges (2), growth of the white squares. The last residual is a prior on the growth, which
/// a few blurred pixels do not separate from the blur.
struct Crossing {
  using Scalar = double;
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = 12 };
  using Parameters = Eigen::Matrix<double, NUM_PARAMETERS, 1>;

  /// Variance of a pixel's box, below which no blur can be: edges between pixels have no gradient.
  static constexpr double kPixelBlur_px2 = 1.0 / 12;
  /// Gray levels per px: noise divided by the prior standard deviation of the growth.
  static constexpr double kGrowthWeight = 10;

  const std::vector<CrossingPixel>& pixels;

  int NumResiduals() const { return static_cast<int>(pixels.size()) + 1; }

  bool operator()(const double* p, double* residuals, double* jacobian) const {
    const Eigen::Vector2d corner(p[0], p[1]), light(p[7], p[8]);
    const Eigen::Vector2d along1(std::cos(p[2]), std::sin(p[2]));
    const Eigen::Vector2d along2(std::cos(p[3]), std::sin(p[3]));
    const Eigen::Vector2d normal1(-along1.y(), along1.x()), normal2(-along2.y(), along2.x());
    const double blur_px = std::sqrt(p[4] * p[4] + kPixelBlur_px2);
    const Blur blur(blur_px);
    const auto rows = static_cast<Eigen::Index>(pixels.size());
    using Jacobian = Eigen::Matrix<double, Eigen::Dynamic, NUM_PARAMETERS>;
    residuals[rows] = kGrowthWeight * p[11];
    if (jacobian != nullptr) {
      Eigen::Map<Jacobian>(jacobian, rows + 1, NUM_PARAMETERS).row(rows) =
          kGrowthWeight * Parameters::Unit(11).transpose();
    }
    for (Eigen::Index i = 0; i < rows; ++i) {
      const auto& [offset, gray] = pixels[static_cast<std::size_t>(i)];
      const Eigen::Vector2d at = offset - corner;
      const double u1 = along1.dot(at), u2 = along2.dot(at);
      const double v1 = normal1.dot(at), v2 = normal2.dot(at);
      const double d1 = v1 - p[9] * u1 * u1, d2 = v2 - p[10] * u2 * u2;
      const SquareBorder a1(d1 - p[11], blur), a2(d2 - p[11], blur);
      const SquareBorder b1(-d1 - p[11], blur), b2(-d2 - p[11], blur);
      const double lit = 1 + light.dot(at);
      const double pattern = 2 * (a1.coverage * a2.coverage + b1.coverage * b2.coverage) - 1;
      const double unlit = p[5] + p[6] * pattern;
      residuals[i] = unlit * lit - gray;
      if (jacobian == nullptr) continue;
      const double scale = 2 * lit * p[6];
      const double by_a1 = a1.slope * a2.coverage, by_a2 = a1.coverage * a2.slope;
      const double by_b1 = b1.slope * b2.coverage, by_b2 = b1.coverage * b2.slope;
      const double by_one = scale * (by_a1 - by_b1), by_two = scale * (by_a2 - by_b2);
      const double by_blur =
          scale * p[4] / blur_px *
          (a1.d_coverage_d_blur * a2.coverage + a1.coverage * a2.d_coverage_d_blur +
           b1.d_coverage_d_blur * b2.coverage + b1.coverage * b2.d_coverage_d_blur);
      const Eigen::Vector2d by_corner = by_one * (2 * p[9] * u1 * along1 - normal1) +
                                        by_two * (2 * p[10] * u2 * along2 - normal2) -
                                        unlit * light;
      Eigen::Map<Jacobian> all(jacobian, rows + 1, NUM_PARAMETERS);
      all.row(i) << by_corner.transpose(), -by_one * u1 * (1 + 2 * p[9] * v1),
          -by_two * u2 * (1 + 2 * p[10] * v2), by_blur, lit, lit * pattern, unlit * at.transpose(),
          -by_one * u1 * u1, -by_two * u2 * u2, -scale * (by_a1 + by_a2 + by_b1 + by_b2);
    }
    return true;
  }
};

std::vector<CrossingPixel> collect_pixels(const cv::Mat1b& image, const Eigen::Vector2d& guess_px,
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

/// Computes the initial middle and contrast for the other parameters by linear regression. Reverses
/// the second edge if the squares between the positive sides of both edges are not the black ones.
void initialize_levels(const std::vector<CrossingPixel>& pixels, Crossing::Parameters& p) {
  p[5] = 0;
  p[6] = 1;
  const Crossing crossing{pixels};
  const auto count = static_cast<Eigen::Index>(pixels.size());
  Eigen::VectorXd pattern(count + 1), gray(count);
  crossing(p.data(), pattern.data(), nullptr);
  pattern.conservativeResize(count);
  for (Eigen::Index i = 0; i < count; ++i) gray[i] = pixels[static_cast<std::size_t>(i)].gray;
  pattern += gray;  // from the residuals
  const Eigen::VectorXd swing = pattern.array() - pattern.mean();
  p[6] = swing.dot(gray) / std::max(swing.squaredNorm(), 1e-9);
  p[5] = gray.mean() - p[6] * pattern.mean();
  if (p[6] < 0) return;
  p[3] += std::numbers::pi;
  p[6] = -p[6];
}

/// Returns the standard deviation of a fitted corner, px, averaged over all directions:
///   covariance = (J'J / s^2 + P)^-1
///   s  RMS residual per degree of freedom
///   P  inverse prior variances of light, curvatures and growth, which few pixels do not determine
double compute_corner_sd_px(const Crossing& crossing, const Crossing::Parameters& p) {
  constexpr double light_sd_per_px = 0.03, curvature_sd_per_px = 0.03, growth_sd_px = 1;
  constexpr double other_sd = 1e3;
  constexpr int determined = 7;  // parameters without light, curvatures and growth
  using Matrix = Eigen::Matrix<double, Crossing::NUM_PARAMETERS, Crossing::NUM_PARAMETERS>;
  const int count = crossing.NumResiduals();
  Eigen::VectorXd residuals(count);
  Eigen::Matrix<double, Eigen::Dynamic, Crossing::NUM_PARAMETERS> jacobian(
      count, static_cast<Eigen::Index>(Crossing::NUM_PARAMETERS));
  crossing(p.data(), residuals.data(), jacobian.data());
  const double freedom = std::max(1, count - Crossing::NUM_PARAMETERS);
  Crossing::Parameters prior_sds = Crossing::Parameters::Constant(other_sd);
  prior_sds.tail<Crossing::NUM_PARAMETERS - determined>() << light_sd_per_px, light_sd_per_px,
      curvature_sd_per_px, curvature_sd_per_px, growth_sd_px;
  Matrix information = jacobian.transpose() * jacobian * (freedom / residuals.squaredNorm());
  information.diagonal() += prior_sds.cwiseAbs2().cwiseInverse();
  return std::sqrt(information.ldlt().solve(Matrix::Identity()).topLeftCorner<2, 2>().trace() / 2);
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

std::optional<FittedCorner> fit_edge_crossing(const cv::Mat1b& image,
                                              const Eigen::Vector2d& guess_px,
                                              const std::array<Eigen::Vector2d, 2>& along,
                                              double radius_px) {
  constexpr std::size_t min_pixels = 16;
  constexpr int max_iterations = 15;
  constexpr double min_initial_blur_px = 0.8, initial_blur_to_radius_ratio = 0.1;
  // Guesses in blurred images, which need a large radius, are less accurate.
  const double max_displacement_px = std::max(1.5, 0.4 * (radius_px - 4));
  constexpr double function_tolerance = 1e-3;  // gray levels squared
  constexpr double min_contrast = 3, max_relative_rms = 0.22, max_sagitta_fraction = 0.5,
                   max_sd_px = 0.5;
  constexpr double max_growth_fraction = 0.17;
  const auto pixels = collect_pixels(image, guess_px, radius_px);
  if (pixels.size() < min_pixels) return {};
  Crossing::Parameters p = Crossing::Parameters::Zero();
  p[2] = std::atan2(along[0].y(), along[0].x());
  p[3] = std::atan2(along[1].y(), along[1].x());
  p[4] = std::max(min_initial_blur_px, initial_blur_to_radius_ratio * radius_px);
  initialize_levels(pixels, p);

  const Crossing crossing{pixels};
  ceres::TinySolver<Crossing> solver;
  solver.options.max_num_iterations = max_iterations;
  solver.options.function_tolerance = function_tolerance;
  solver.Solve(crossing, &p);
  const double rms = std::sqrt(2 * solver.summary.final_cost / static_cast<double>(pixels.size()));
  const bool is_accepted =
      p.allFinite() && p.head<2>().norm() < max_displacement_px && std::abs(p[4]) < radius_px &&
      p.segment<2>(9).cwiseAbs().maxCoeff() * radius_px < max_sagitta_fraction &&
      std::abs(p[11]) < max_growth_fraction * radius_px && std::abs(p[6]) > min_contrast &&
      rms < max_relative_rms * std::abs(p[6]);
  if (!is_accepted) return {};
  const double sd_px = compute_corner_sd_px(crossing, p);
  if (!(sd_px < max_sd_px)) return {};
  return FittedCorner{guess_px + p.head<2>(), std::hypot(sd_px, p[11]),
                      std::sqrt(p[4] * p[4] + Crossing::kPixelBlur_px2)};
}

}  // namespace vlp
