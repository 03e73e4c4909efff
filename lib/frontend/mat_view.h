// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>

#include "lamps/image/image_view.h"

namespace vlp {

/// Returns a non-owning view of an image's pixels, valid as long as the pixels of `image`. Returns
/// an empty view for an empty image.
/// @pre The image has one channel of 8 or 16 bits, or is empty.
inline ImageView to_image_view(const cv::Mat& image) {
  if (image.empty()) return {};
  CV_Assert(image.type() == CV_8UC1 || image.type() == CV_16UC1);
  return {image.data, image.cols, image.rows, std::ptrdiff_t(image.step[0]),
          image.depth() == CV_8U ? 8 : 16};
}

}  // namespace vlp
