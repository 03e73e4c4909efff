// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>

namespace vlp {

/// Brightness of an image and sharpness of its sharpest edges.
struct ImageBlur {
  /// Sigma of the blur of the sharpest edges; infinite for an image without contrast. A step of
  /// height A that is blurred by s rises by A / (s sqrt(2 pi)) per pixel at most. A is the range
  /// of the grey levels (1 % to 99 %), the rise its 99.9 % quantile. The variances of smoothing and
  /// difference are subtracted.
  double sigma_px;
  /// The level that 1 % of the pixels exceed, as a fraction of the full scale.
  double bright_fraction;
};

/// Measures the blur of an image of 8 or 16 bits.
ImageBlur measure_blur(const cv::Mat& image);

/// Signal of an image relative to its noise.
struct ImageSignal {
  /// The darkest level, as a fraction of the full scale. Levels are medians of three pixels along a
  /// row or a column, so that a defective pixel does not count and a line of a stripe does.
  double dark_fraction;
  /// Difference between the brightest and the darkest level in standard deviations of the pixels'
  /// noise; about 6 for noise alone. The noise is that of the second difference along both axes, so
  /// that stripes along rows or columns do not count as noise (J. Immerkaer, Fast noise variance
  /// estimation, 1996), and at least that of rounding to whole levels.
  double signal_to_noise;
};

/// Measures the signal of an image of 8 or 16 bits.
ImageSignal measure_signal(const cv::Mat& image);

/// Returns the fraction of the pixels of a region of an image of 8 or 16 bits that are at full
/// scale, or one level of 8 bits below; 0 for a region outside the image.
double white_fraction(const cv::Mat& image, cv::Rect region);

}  // namespace vlp
