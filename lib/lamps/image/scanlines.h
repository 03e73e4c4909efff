// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "lamps/image/background.h"
#include "lamps/image/image_view.h"
#include "lamps/image/pixel_runs.h"
#include "rig/calibration.h"

namespace vlp {

/// Image whose rows are the scanlines, that is the rows or columns that the shutter reads.
struct ScanlineImage {
  ImageView pixels;
  /// Tiles of `pixels` that contain lit pixels (mark_bright_tiles()); a search for runs can skip
  /// the others.
  TileMask lit;
  /// Memory of `pixels` if it is not that of the input image.
  std::shared_ptr<void> memory;
};

/// Returns an image whose rows are the scanlines. An image that is read along columns is
/// transposed, but only in lit tiles and their neighbors. Lit tiles have more than one pixel above
/// the background's threshold. Transposing a large image completely takes longer than detecting its
/// lamps. The tiles next to the transposed ones are filled with the background level. All other
/// tiles are black; their memory is not touched.
ScanlineImage make_scanlines(const ImageView& image, Readout readout, const Background& background);

}  // namespace vlp
