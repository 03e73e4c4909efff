// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>

#include "detection/lights/background.h"
#include "rig/calibration.h"

namespace vlp {

/// The image with the lines that the shutter reads as its rows. Read along columns, it is turned
/// over its diagonal around all that is brighter than the background's threshold; the rest, in
/// which nothing is to be seen, is at its level, because turning all of a large image takes longer
/// than finding its lamps.
cv::Mat lines_of(const cv::Mat& image, Readout readout, const Background& background);

}  // namespace vlp
