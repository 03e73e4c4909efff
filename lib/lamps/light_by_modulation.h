// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "lamps/image/background.h"
#include "lamps/image/image_view.h"
#include "lamps/image/runs.h"
#include "lamps/shape/light.h"
#include "lamps/shape/light_shape.h"
#include "lamps/signal/modulated_lights.h"

namespace vlp {

/// Returns a box that is larger by a margin on each side, within an image of that size, in pixels.
PixelBox grow(const PixelBox& box, int margin_px, const ImageSize& size);

/// Makes a light of one that was found by its modulation. Its outline is its rim, see rim_of(),
/// where it shows one clearly; else it has none, and its centre is that of the area that it lights.
/// Kind, reason and lamp are not set.
///
/// @param blobs  lit pixels of the image, in which the rim is searched
Light light_by_modulation(const ImageView& lines, const ModulatedLight& found,
                          std::span<const Blob> blobs, const Background& background,
                          const LightShape& shape);

}  // namespace vlp
