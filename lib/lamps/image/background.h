// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>

namespace vlp {

/// The dark of an image of lamps, from a sample of its pixels.
struct Background {
  /// Mean of the pixels around the median, and their standard deviation, in grey levels. Of a
  /// dark that is clipped, at black or above it, by what is brighter than the median.
  double level;
  double noise;
  /// Pixels above are lit: level + 4.5 noise, and at least 1.6 of the steps between the levels that
  /// the image has more.
  double threshold;
};

/// `image` has one channel of 8 or 16 bits and is not empty.
Background background_of(const cv::Mat& image);

}  // namespace vlp
