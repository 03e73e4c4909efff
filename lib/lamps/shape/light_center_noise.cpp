// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/light_center_noise.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include "geometry/angles.h"
#include "rig/detection.h"

namespace vlp {

double compute_center_sd(const Matrix2& covariance, double num_correlated,
                         const Eigen::Vector2d& bias) {
  return std::sqrt(num_correlated * covariance.trace() / 2 + bias.squaredNorm() / 2);
}

std::optional<double> limit_center_sd(double sigma_px) {
  if (!(sigma_px <= kMaxSigma_px)) return std::nullopt;
  return std::max(kMinSigma_px, sigma_px);
}

void add_error_to_center_sigma(double sd_px, Light& light) {
  light.sigma_px = std::min(std::hypot(light.sigma_px, sd_px), kMaxSigma_px);
}

double estimate_num_correlated_points(const std::vector<Eigen::Vector2d>& points,
                                      const std::vector<EdgePoint>& outline,
                                      const std::vector<bool>& counted, const RobustEllipse& fit) {
  constexpr double neighbors_px = 4, unknowns = 3;
  const Matrix2 circle_from_rim = fit.rim_from_circle.inverse();
  std::vector<double> errors(points.size(), 0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (counted[i]) errors[i] = (circle_from_rim * (points[i] - fit.center)).norm() - 1;
  }
  double squares = 0, products = 0, pairs = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    squares += errors[i] * errors[i];
    for (std::size_t j = 0; j < i && counted[i]; ++j) {
      if (!counted[j] || (outline[i].pixel - outline[j].pixel).norm() >= neighbors_px) continue;
      products += 2 * errors[i] * errors[j];
      pairs += 2;
    }
  }
  if (!(squares > 0)) return 1;
  const auto count = double(std::count(counted.begin(), counted.end(), true));
  const double taken = unknowns / count * pairs / count;
  return std::max(1.0, 1 + products / squares + taken);
}

double count_outline_points_per_stripe(const std::vector<EdgePoint>& outline) {
  constexpr double next = 2.5;
  std::array<double, 2> last{-1e9, -1e9};
  double stripes = 0;
  for (const EdgePoint& point : outline) {
    double& row = last[point.is_run_begin ? 0 : 1];
    if (point.pixel.y() - row > next) ++stripes;
    row = point.pixel.y();
  }
  return double(outline.size()) / std::max(1.0, stripes);
}

std::optional<double> estimate_center_sd_by_jackknife_px(const Light& light,
                                                         const Background& background,
                                                         const LightShape& shape) {
  constexpr std::size_t pieces = 8;
  const Eigen::Vector2d center = shape.swap_image_and_scanline_axes(light.pixel);
  std::vector<EdgePoint> outline = light.outline;
  const auto angle = [&](const EdgePoint& point) {
    return std::atan2(point.pixel.y() - center.y(), point.pixel.x() - center.x());
  };
  std::sort(outline.begin(), outline.end(),
            [&](const EdgePoint& a, const EdgePoint& b) { return angle(a) < angle(b); });
  std::array<Eigen::Vector2d, pieces> centers;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < pieces; ++i) {
    std::vector<EdgePoint> others = outline;
    const auto at = [&](std::size_t piece) {
      return others.begin() + std::ptrdiff_t(piece * outline.size() / pieces);
    };
    others.erase(at(i), at(i + 1));
    const auto without = shape.fit_light_to_outline(std::move(others), background);
    if (!without) return std::nullopt;
    centers[i] = without->pixel;
    mean += centers[i] / double(pieces);
  }
  double squares = 0;
  for (const Eigen::Vector2d& each : centers) squares += (each - mean).squaredNorm();
  return std::sqrt(double(pieces - 1) / double(pieces) * squares / 2);
}

void add_hidden_end_error_to_center_sigma(double off, double tilt_sd, Light& light) {
  constexpr double clear = 3;
  if (!(off > tilt_sd + clear * light.aspect_sd)) return;
  const double length_px =
      std::sqrt(std::numbers::pi * light.aspect) * light.radius_px;  // its area has that radius
  add_error_to_center_sigma(off * length_px / 2 / std::numbers::sqrt2, light);
}

double predict_center_sd_without_lens_px(const Light& light, const ImageSize& image) {
  constexpr double max_lean_rad = rad_from_deg(10);
  if (light.shape == ShapeKind::rectangle) return 0;
  const double focal_px = std::hypot(image.width, image.height) / 2;
  const Eigen::Vector2d middle((image.width - 1) / 2.0, (image.height - 1) / 2.0);
  const double off_axis = (light.pixel - middle).norm() / focal_px;
  const double bound_px =
      light.radius_px * light.radius_px / focal_px * std::hypot(off_axis, std::tan(max_lean_rad));
  return bound_px / std::numbers::sqrt2;
}

}  // namespace vlp
