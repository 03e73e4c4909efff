// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "lamps/image/image_view.h"
#include "lamps/image/lit_tiles.h"
#include "lamps/image/pixel_box.h"

namespace vlp {

/// Consecutive lit pixels of a row: columns begin to end - 1.
struct PixelRun {
  int row, begin, end;

  int pixel_run_width_px() const { return end - begin; }
};

/// Returns the mean gray level of the pixels of a run. The dark level is not subtracted.
/// @pre The run is not empty and lies in the image.
double mean_level(const ImageView& image, const PixelRun& run);

/// Finds the runs of pixels above `threshold`, row by row. Gaps of up to two pixels do not end a
/// run; runs of less than three pixels are discarded as noise. Searches the nonzero tiles of `lit`,
/// or all tiles if `lit` is empty.
std::vector<PixelRun> list_pixel_runs(const ImageView& image, double threshold,
                                      const TileMask& lit = {});

/// Runs of one light: they overlap from row to row, across up to `max_dark_rows` dark rows. Lights
/// that touch form one blob.
struct Blob {
  std::vector<PixelRun> runs;  // ordered by row

  int first_blob_row() const { return runs.front().row; }
  int last_blob_row() const { return runs.back().row; }
  PixelBox blob_bounding_box() const;
};

std::vector<Blob> group_into_blobs(const std::vector<PixelRun>& runs, int max_dark_rows);

}  // namespace vlp
