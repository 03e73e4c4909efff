// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace vlp {

/// Lit pixels of a row that stand side by side: columns from begin to before end.
struct Run {
  int row, begin, end;

  int width() const { return end - begin; }
};

/// Of tiles: so many rows and columns. Those at the right and at the bottom may have less.
inline constexpr int kTile_px = 64;

/// How many pixels of each tile are above `threshold`: 0, 1, or 2 when there are more. `image` has
/// one channel of 8 or 16 bits.
cv::Mat1b lit_tiles(const cv::Mat& image, double threshold);

/// The runs of pixels above `threshold`, row by row. Gaps of up to two pixels do not end a run;
/// runs of less than three pixels are noise. `image` has one channel of 8 or 16 bits. Only tiles
/// that are `lit`, not 0, are looked at, or all of them when it is empty.
std::vector<Run> find_runs(const cv::Mat& image, double threshold, const cv::Mat1b& lit = {});

/// Runs that belong to one light: they overlap from row to row, across up to `most_dark_rows` dark
/// ones. Lights that touch are one blob.
struct Blob {
  std::vector<Run> runs;  // by row

  int top() const { return runs.front().row; }
  int bottom() const { return runs.back().row; }
  cv::Rect box() const;
};

std::vector<Blob> group_runs(const std::vector<Run>& runs, int most_dark_rows);

}  // namespace vlp
