// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "lamps/image/background.h"
#include "lamps/image/image_view.h"
#include "lamps/image/pixel_runs.h"
#include "lamps/shape/light.h"
#include "lamps/shape/light_center.h"
#include "lamps/signal/modulated_lights.h"

namespace vlp {

/// Converts a light that was found by its modulation to a Light. The outline is the rim, see
/// fit_rim(), if the rim is clear. Otherwise the light has no outline, and its center is the
/// centroid of the lit area. Kind, reason and lamp are not set.
///
/// @param lines  image whose rows are the scanlines
/// @param blobs  lit pixels of the image, in which the rim is searched
Light make_light_from_modulation(const ImageView& lines, const ModulatedLight& found,
                                 std::span<const Blob> blobs, const Background& background,
                                 const LightShape& shape);

}  // namespace vlp
