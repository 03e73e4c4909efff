// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>

namespace vlp {

/// Brightness of an image and sharpness of its sharpest edges.
struct ImageBlur {
  /// Blur of the sharpest edges of the image: sigma of a Gaussian, px. Infinite for an image
  /// without contrast.
  ///
  /// A step of height A with blur s has a maximum gradient of A / (s sqrt(2 pi)) per pixel. A is
  /// the range of the gray levels (1 % to 99 % quantile), the maximum gradient their 99.9 %
  /// quantile. The variances of smoothing and difference are subtracted.
  double sigma_px;
  /// Level that 1 % of the pixels exceed, as a fraction of the full scale.
  double bright_fraction;
};

/// Measures the blur of an image of 8 or 16 bits.
ImageBlur measure_image_blur(const cv::Mat& image);

/// Range of the gray levels of an image, relative to full scale and to its pixel noise.
struct ImageSignal {
  /// Darkest level, as a fraction of the full scale. Levels are medians of three pixels along a row
  /// or a column, which ignore a defective pixel but not a stripe of one scanline.
  double dark_fraction;
  /// Difference between the brightest and the darkest level, in standard deviations of the pixel
  /// noise; about 6 for noise alone. The noise is estimated from the second difference along both
  /// axes, which excludes stripes along rows or columns. It is at least the rounding to whole
  /// levels. Source: J. Immerkaer, Fast noise variance estimation, 1996.
  double signal_to_noise;
};

/// Measures the signal of an image of 8 or 16 bits.
ImageSignal measure_image_signal(const cv::Mat& image);

/// Computes the fraction of white pixels in a region of an image of 8 or 16 bits. White is full
/// scale or one 8-bit level below. Returns 0 for a region outside the image.
double compute_saturated_fraction(const cv::Mat& image, cv::Rect region);

}  // namespace vlp
