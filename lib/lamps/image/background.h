// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "lamps/image/image_view.h"

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

/// @pre The image is not empty.
Background background_of(const ImageView& image);

}  // namespace vlp
