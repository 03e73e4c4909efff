// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "detection/boards/board_detector.h"
#include "frontend/image_source.h"
#include "rig/board.h"

namespace vlp {

/// Detection of a board in an image with the values by which the image is accepted or rejected.
struct CachedView {
  BoardView view;
  /// Blur of the sharpest edges of the image (ImageBlur::sigma_px): sigma of a Gaussian, px.
  /// std::nullopt for an image without contrast.
  std::optional<double> blur_px;
  /// Level that 1 % of the image's pixels exceed, as a fraction of full scale
  /// (ImageBlur::bright_fraction). `white_fraction` is the fraction of the board's pixels that are
  /// at full scale.
  double bright_fraction, white_fraction;
};

/// Cache of detections with one file per image in a folder, which may be deleted at any time. Safe
/// to share between threads.
///
/// A file is named by the SHA-256 of the image and of all that the detection depends on: the board
/// and the version of the program. Corners are restored as the same doubles. Files that cannot be
/// read or written are ignored.
class CornerCache {
 public:
  /// Creates the folder if it is missing. Without a folder name there is no cache.
  CornerCache(std::filesystem::path folder, const Board& board);

  /// Returns the stored detection of an image with the same content; std::nullopt if there is none.
  std::optional<CachedView> find_cached_view(const SourceImage& image) const;
  /// Stores the detection of an image in its file. A file that cannot be written is skipped.
  void store_cached_view(const SourceImage& image, CachedView view) const;

 private:
  std::filesystem::path make_file_path(const SourceImage& image) const;

  std::filesystem::path folder_;
  std::string settings_;
};

}  // namespace vlp
