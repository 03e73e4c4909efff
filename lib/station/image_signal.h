// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>

namespace vlp {

/// How far an image stands out of its noise.
struct ImageSignal {
  /// The brightest level, as a share of the full scale. Levels are medians of 3 x 3 pixels: a pixel
  /// that is always bright is none.
  double bright_share;
  /// The brightest level over the darkest, in standard deviations of a pixel's noise. That is what
  /// no second difference along both axes explains, so that stripes along rows or columns are no
  /// noise (J. Immerkaer, Fast noise variance estimation, 1996), and no less than rounding to whole
  /// levels makes. Noise alone has about 4.
  double over_noise;
};

/// image: grey levels of 8 or 16 bits.
ImageSignal image_signal(const cv::Mat& image);

}  // namespace vlp
