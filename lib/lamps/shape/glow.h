// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "lamps/image/background.h"
#include "lamps/image/image_view.h"
#include "lamps/image/runs.h"
#include "lamps/shape/light.h"
#include "lamps/shape/light_shape.h"

namespace vlp {

/// A light that glows: it brightens towards its middle without an edge, as a bulb in a reflector
/// does. Its outline is where its rows pass a share of its brightest level, or less by as much as
/// the row is dimmer than the stripe that it belongs to. No glow is quite round: the centre is the
/// mean of those at three shares from a tenth to a fifth of the level, and their scatter is in its
/// sigma_px. Nothing when there is no glow, or one with an edge.
std::optional<Light> glow_of(const ImageView& image, const Blob& blob, const Background& background,
                             const LightShape& shape);

}  // namespace vlp
