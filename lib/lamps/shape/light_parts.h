// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "lamps/image/background.h"
#include "lamps/image/pixel_box.h"
#include "lamps/shape/light.h"
#include "lamps/shape/light_shape.h"

namespace vlp {

/// A blob: the light that it is, if it is round, and all of its outline.
struct LightPart {
  std::optional<Light> light;
  std::vector<EdgePoint> outline;
  PixelBox box;
};

/// The lights that the parts are of: what stands in the way splits a lamp, but its parts lie on one
/// circle. Of lights that overlap the one with more of an outline stands. What is left in `parts`
/// has no form.
std::vector<Light> join(std::vector<LightPart>& parts, const LightShape& shape,
                        const Background& background);

/// Parts without a form, but those inside one of `lights`, as lights, with the reason. What is less
/// than five pixels wide or high is a speck, and no light. `size` is that of the lines.
std::vector<Light> formless_lights(std::vector<LightPart> parts, const std::vector<Light>& lights,
                                   const LightShape& shape, const ImageSize& size);

}  // namespace vlp
