// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "lamps/image/background.h"
#include "lamps/image/image_view.h"
#include "lamps/image/pixel_runs.h"

namespace vlp {

/// Returns two points (column, row) of the outline for each run of a blob: at its ends, where the
/// level falls to half of the level inside. Columns are interpolated. The level inside is the upper
/// quartile of the run, which the halo around a light changes little.
///
/// Excludes ends at the image border, runs shorter than 8 px, and runs with less than 35 % of the
/// level of the brightest run, such as halos and the charge that a saturated lamp spills between
/// its stripes.
///
/// @param image  image whose rows are the scanlines
std::vector<Eigen::Vector2d> trace_blob_outline(const ImageView& image, const Blob& blob,
                                                const Background& background);

}  // namespace vlp
