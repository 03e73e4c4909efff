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
  /// Of `pixels`, which last as long, when they are not the image's.
  std::shared_ptr<void> memory;
};

/// Read along columns, an image is turned over its diagonal in the tiles in which something is
/// brighter than the background's threshold, more than one pixel alone, and in those around them,
/// because turning all of a large image takes longer than finding its lamps. The rest, in which
/// nothing is to be seen, is at the background's level as far from what is lit as that reaches, and
/// black beyond, where memory need not even be touched.
Lines lines_of(const ImageView& image, Readout readout, const Background& background);

}  // namespace vlp
