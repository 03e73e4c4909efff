// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "lamps/image/image_view.h"
#include "lamps/image/lit_tiles.h"
#include "lamps/image/pixel_box.h"

namespace vlp {

/// Consecutive lit pixels of a row: columns from begin to before end.
struct Run {
  int row, begin, end;

  int width() const { return end - begin; }
};

/// Finds the runs of pixels above `threshold`, row by row. Gaps of up to two pixels do not end a
/// run; runs of less than three pixels are noise. Searches the tiles that are not 0 in `lit`, or
/// all if it is empty.
std::vector<Run> find_runs(const ImageView& image, double threshold, const TileMask& lit = {});

/// Runs that belong to one light: they overlap from row to row, across up to `max_dark_rows` dark
/// ones. Lights that touch are one blob.
struct Blob {
  std::vector<Run> runs;  // by row

  int top() const { return runs.front().row; }
  int bottom() const { return runs.back().row; }
  PixelBox box() const;
};

std::vector<Blob> group_runs(const std::vector<Run>& runs, int max_dark_rows);

}  // namespace vlp
