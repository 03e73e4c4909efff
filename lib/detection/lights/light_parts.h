// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "detection/lights/background.h"
#include "detection/lights/light.h"
#include "detection/lights/light_shape.h"

namespace vlp {

/// A blob: the light that it is, if it is round, and all of its outline.
struct LightPart {
  std::optional<Light> light;
  std::vector<EdgePoint> outline;
  cv::Rect box;
};

/// The lights that the parts are of: what stands in the way splits a lamp, but its parts lie on one
/// circle. Of lights that overlap the one with more of an outline stands.
std::vector<Light> joined(std::vector<LightPart> parts, const LightShape& shape,
                          const Background& background);

}  // namespace vlp
