// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "simulation/point_spread.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

namespace vlp {
namespace {

/// Radius of a Gaussian in standard deviations; less than 1e-4 of it lies outside along one axis.
constexpr double kGaussianReach = 4;
constexpr double kDiscStep_px = 0.5;

double compute_max_defocus_px(const Defocus& defocus) {
  return std::abs(defocus.radius_px) + defocus.tilt_px.lpNorm<1>();
}

void blur_by_kernel(cv::Mat1f& image, double sigma_px) {
  if (sigma_px == 0) return;
  const int size = 2 * static_cast<int>(std::ceil(kGaussianReach * sigma_px)) + 1;
  cv::GaussianBlur(image, image, {size, size}, sigma_px, sigma_px, cv::BORDER_REPLICATE);
}

/// Returns the area of a uniform disc in each element, with the sum 1.
cv::Mat1f make_disc_kernel(double radius) {
  constexpr int samples = 16;  // along an edge of an element
  const int reach = static_cast<int>(std::ceil(radius + 0.5));
  cv::Mat1f kernel(2 * reach + 1, 2 * reach + 1, 0.F);
  for (int row = 0; row < kernel.rows * samples; ++row) {
    for (int col = 0; col < kernel.cols * samples; ++col) {
      const double y = (row + 0.5) / samples - reach - 0.5, x = (col + 0.5) / samples - reach - 0.5;
      if (std::hypot(x, y) <= radius) kernel(row / samples, col / samples) += 1;
    }
  }
  return cv::Mat1f(kernel / cv::sum(kernel)[0]);
}

cv::Mat1f blur_by_disc(const cv::Mat1f& image, double radius) {
  if (radius == 0) return image;
  cv::Mat1f blurred;
  cv::filter2D(image, blurred, CV_32F, make_disc_kernel(radius), {-1, -1}, 0, cv::BORDER_REPLICATE);
  return blurred;
}

/// Evaluates a function of (line, place), in pixels, at each element of a part.
template <typename Figure>
cv::Mat1f map_by_distance(const cv::Mat1f& part, const SpreadWindow& window, const Figure& figure) {
  cv::Mat1f map(part.size());
  const auto pixel = [&](int begin, int i) { return begin + (i + 0.5) / window.per_px - 0.5; };
  for (int row = 0; row < map.rows; ++row) {
    for (int col = 0; col < map.cols; ++col) {
      map(row, col) = static_cast<float>(
          figure(Eigen::Vector2d(pixel(window.line_begin, row), pixel(window.place_begin, col))));
    }
  }
  return map;
}

/// Returns the profile of a soft spot, cos^2: 1 in the middle, 0 from 1 on. `distance` is in units
/// of its radius.
double compute_spot_profile(double distance) {
  const double cosine = distance < 1 ? std::cos(distance * std::numbers::pi / 2) : 0;
  return cosine * cosine;
}

}  // namespace

int compute_blur_radius_px(const Optics& optics) {
  double reach = kGaussianReach * optics.blur_px;
  if (optics.defocus) reach += compute_max_defocus_px(*optics.defocus);
  double halo = 0;
  for (const LensSmear& smear : optics.smears) halo = std::max(halo, 3 * smear.sigma_px);
  return static_cast<int>(std::ceil(reach + halo));
}

void PointSpread::apply_point_spread(cv::Mat1f& part, const SpreadWindow& window) const {
  blur_by_kernel(part, window.per_px * optics_.blur_px);
  if (optics_.defocus) apply_defocus_blur(part, window);
  for (const LensSmear& each : optics_.smears) apply_lens_smear(each, part, window);
}

void PointSpread::apply_defocus_blur(cv::Mat1f& part, const SpreadWindow& window) const {
  const Eigen::Array2d half(rays_.num_readout_lines() / 2.0, rays_.pixels_per_line() / 2.0);
  const Eigen::Vector2d tilt_px = rays_.to_readout_order(optics_.defocus->tilt_px);
  const cv::Mat1f radii = map_by_distance(part, window, [&](const Eigen::Vector2d& at) {
    const Eigen::Vector2d from_middle = (at.array() + 0.5 - half) / half;
    return std::abs(optics_.defocus->radius_px + tilt_px.dot(from_middle));
  });
  double min_px = 0, max_px = 0;
  cv::minMaxLoc(radii, &min_px, &max_px);
  const int first = static_cast<int>(min_px / kDiscStep_px);
  const int last = static_cast<int>(max_px / kDiscStep_px) + 1;
  cv::Mat1f result(part.size(), 0.F);
  for (int step = first; step <= last; ++step) {
    const cv::Mat1f blurred = blur_by_disc(part, step * kDiscStep_px * window.per_px);
    for (int row = 0; row < part.rows; ++row) {
      for (int col = 0; col < part.cols; ++col) {
        // Weights that preserve the variance of the disc, which is proportional to the radius
        // squared.
        const double steps = double(radii(row, col)) / kDiscStep_px, low = std::floor(steps);
        const double upper = (steps * steps - low * low) / (2 * low + 1);
        const double weight = step == low ? 1 - upper : step == low + 1 ? upper : 0;
        result(row, col) += static_cast<float>(weight) * blurred(row, col);
      }
    }
  }
  part = result;
}

void PointSpread::apply_lens_smear(const LensSmear& smear, cv::Mat1f& part,
                                   const SpreadWindow& window) const {
  const Eigen::Vector2d middle = rays_.to_readout_order(smear.at_px);
  const cv::Mat1f scattered = map_by_distance(part, window, [&](const Eigen::Vector2d& at) {
    return smear.fraction * compute_spot_profile((at - middle).norm() / smear.radius_px);
  });
  cv::Mat1f halo = part.clone();
  blur_by_kernel(halo, window.per_px * smear.sigma_px);
  part = part + scattered.mul(halo - part);
}

void PointSpread::add_veiling_glare(cv::Mat1f& image) const {
  if (optics_.veiling_glare == 0) return;
  const double mean = cv::mean(image)[0];
  image = (1 - optics_.veiling_glare) * image + optics_.veiling_glare * mean;
}

float PointSpread::extract_glare(cv::Mat1f& part) const {
  if (optics_.veiling_glare == 0) return 0;
  const double pixels = double(rays_.num_readout_lines()) * rays_.pixels_per_line();
  const double scattered = optics_.veiling_glare * cv::sum(part)[0] / pixels;
  part = part * (1 - optics_.veiling_glare);
  return static_cast<float>(scattered);
}

cv::Mat1f compute_transmission(const std::vector<Dust>& dust, const PixelRays& rays) {
  cv::Mat1f transmission(rays.num_readout_lines(), rays.pixels_per_line(), 1.F);
  for (const Dust& speck : dust) {
    const Eigen::Vector2d middle = rays.to_readout_order(speck.at_px);
    const cv::Mat1f shadow = map_by_distance(transmission, {0, 0}, [&](const Eigen::Vector2d& at) {
      return 1 - speck.depth * compute_spot_profile((at - middle).norm() / speck.radius_px);
    });
    transmission = transmission.mul(shadow);
  }
  return transmission;
}

}  // namespace vlp
