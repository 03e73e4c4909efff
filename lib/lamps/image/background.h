// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "lamps/image/image_view.h"

namespace vlp {

/// Dark level and noise of an image of lamps, estimated from a sample of its pixels.
struct Background {
  /// Dark level of the image, in gray levels: mean of the pixels around the median. `noise` is
  /// their standard deviation.
  ///
  /// If noise below the dark level is clipped at black, the standard deviation is derived from the
  /// pixels brighter than the median.
  double level;
  double noise;
  /// Level above which pixels are lit: level + 4.5 noise, and at least level + 1.6 times the
  /// smallest difference between the levels of the image.
  double threshold;
};

/// Estimates dark level, noise and threshold of an image. @pre The image is not empty.
Background estimate_background_of(const ImageView& image);

/// Estimates the background of an image that lights cover by more than half, where the median is a
/// lit level. Uses the darker one of two classes of pixels (Otsu 1979). Returns std::nullopt if
/// less than 5 % of the image is brighter than the threshold of this class, as in an image of
/// noise.
/// @pre The image is not empty.
std::optional<Background> estimate_dark_background(const ImageView& image);

}  // namespace vlp
