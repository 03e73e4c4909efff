// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>

namespace vlp {

/// How far an image stands out of its noise.
struct ImageSignal {
  /// The darkest level, as a share of the full scale. Levels are medians of three pixels along a
  /// row or a column: a pixel that is always bright or dark is none, a line of a stripe is.
  double dark_share;
  /// The brightest level over the darkest, in standard deviations of a pixel's noise. That is what
  /// no second difference along both axes explains, so that stripes along rows or columns are no
  /// noise (J. Immerkaer, Fast noise variance estimation, 1996), and no less than rounding to whole
  /// levels makes. Noise alone has about 6.
  double over_noise;
};

/// image: grey levels of 8 or 16 bits.
ImageSignal image_signal(const cv::Mat& image);

}  // namespace vlp
