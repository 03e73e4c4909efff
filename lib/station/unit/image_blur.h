// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>

namespace vlp {

/// How bright an image is and how sharp its sharpest edges are.
struct ImageBlur {
  /// Sigma of the blur. A step of height A that is blurred by s rises by A / (s sqrt(2 pi)) a pixel
  /// at most; A is the range of the grey levels (1 % to 99 %), the rise that which one pixel in a
  /// thousand exceeds, less the variance of smoothing and difference. Infinite for an image without
  /// contrast.
  double sigma_px;
  /// The level that 1 % of the pixels exceed, as a share of the full scale.
  double bright_share;
};

/// image: grey levels of 8 or 16 bits.
ImageBlur image_blur(const cv::Mat& image);

}  // namespace vlp
