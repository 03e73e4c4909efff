// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <optional>

#include "detection/boards/board_detector.h"
#include "frontend/image_source.h"
#include "rig/board.h"

namespace vlp {

/// Detection of a board in an image with the values by which the image is accepted or rejected.
struct CachedView {
  BoardView view;
  /// Sigma of the blur; std::nullopt without contrast.
  std::optional<double> blur_px;
  /// ImageBlur::bright_fraction; fraction of the board's pixels at full scale.
  double bright_fraction, white_fraction;
};

/// Functions to find and store earlier detections, safe to call from several threads. Both are
/// empty if there is no cache.
struct BoardCache {
  std::function<std::optional<CachedView>(const SourceImage& image)> find;
  std::function<void(const SourceImage& image, const CachedView& view)> keep;
};

/// Creates a cache with one file per image in `folder`, which is created if missing and may be
/// deleted at any time. Without a folder name there is no cache.
///
/// A file is named by the SHA-256 of the image and of all that the detection depends on: the board
/// and the version of the program. Corners are restored as the same doubles. Files that cannot be
/// read or written are ignored.
BoardCache corner_cache(const std::filesystem::path& folder, const Board& board);

}  // namespace vlp
