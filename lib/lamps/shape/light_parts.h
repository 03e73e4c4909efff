// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "lamps/image/background.h"
#include "lamps/image/pixel_box.h"
#include "lamps/shape/light.h"
#include "lamps/shape/light_center.h"

namespace vlp {

/// Blob with its complete outline, and the light fitted to it if the fit succeeded.
struct LightPart {
  std::optional<Light> light;
  std::vector<EdgePoint> outline;
  PixelBox box;
};

/// Joins the parts of lights that an occluder splits, because all parts of a disc lie on one
/// circle. Then removes lights that overlap a light with more outline points.
///
/// @param parts  parts of the image; on return only those without a fitted outline
/// @return       the lights, in the order of their number of outline points, largest first
std::vector<Light> join_parts_of_one_light(std::vector<LightPart>& parts, const LightShape& shape,
                                           const Background& background);

/// Converts parts without a fitted outline to lights of kind `no_outline` and sets their reason.
/// Skips parts inside one of `lights` and parts less than five pixels wide or high.
///
/// @param size  size of the image whose rows are the scanlines
std::vector<Light> make_lights_without_outline(std::vector<LightPart> parts,
                                               const std::vector<Light>& lights,
                                               const LightShape& shape, const ImageSize& size);

}  // namespace vlp
