// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "lamps/image/image_view.h"

namespace vlp {

/// Returns the level of the brightest pixel; 0 for an empty image.
int brightest_level(const ImageView& image);

/// Returns the number of pixels with this level.
int count_pixels_at(const ImageView& image, int level);

}  // namespace vlp
