// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "lamps/image/background.h"
#include "lamps/image/image_view.h"
#include "lamps/image/runs.h"
#include "rig/calibration.h"

namespace vlp {

/// An image with the lines that the shutter reads as its rows.
struct Lines {
  ImageView pixels;
  /// Tiles that may have runs, see lit_tiles().
  TileMask lit;
  /// Memory of `pixels` if they are not the image's.
  std::shared_ptr<void> memory;
};

/// Returns the lines of an image. An image that is read along columns is transposed, but only in
/// the tiles with more than one pixel above the background's threshold and in those around them,
/// because transposing all of a large image takes longer than detecting its lamps. The next tiles
/// have the level of the background; those beyond are black, and their memory is not touched.
Lines lines_of(const ImageView& image, Readout readout, const Background& background);

}  // namespace vlp
