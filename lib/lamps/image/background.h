// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "lamps/image/image_view.h"

namespace vlp {

/// Dark level and noise of an image of lamps, from a sample of its pixels.
struct Background {
  /// Mean of the pixels around the median, and their standard deviation, in grey levels. If the
  /// dark is clipped, at black or above it, the pixels brighter than the median determine them.
  double level;
  double noise;
  /// Level above which pixels are lit: level + 4.5 noise, and at least level + 1.6 steps between
  /// the levels that occur in the image.
  double threshold;
};

/// Estimates the background of an image. @pre The image is not empty.
Background background_of(const ImageView& image);

}  // namespace vlp
