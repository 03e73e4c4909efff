// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "detection/boards/board_detector.h"
#include "detection/image_source.h"

namespace vlp {

/// A board in an image.
struct BoardView {
  /// The image's name, without its folder.
  std::string image;
  std::array<int, 2> imager_px;
  SeenBoard seen;
};

/// What is known of an image before it is read, and what to do with what was found in it: a cache.
struct BoardCache {
  std::function<std::optional<BoardView>(const SourceImage& image)> find;
  std::function<void(const SourceImage& image, const BoardView& view)> keep;
};

struct FoundBoards {
  /// In the order of the images.
  std::vector<BoardView> views;
  /// Images that could not be used, and why, in one line each.
  std::vector<std::string> refused;
  /// All of them, in their order.
  std::vector<std::filesystem::path> images;
};

/// Detects the board in each image, so many at a time, with the corners of tags behind each tone
/// curve that an image may have (SeenTag::behind_curves). An image that cannot be read, or has more
/// than max_mpx million pixels and is not in the cache, is refused and does not end it. The result
/// does not depend on the threads. `progress` gets the images done so far; its calls do not
/// overlap, while those of `cache`, whose functions may be empty, do.
FoundBoards detect_boards(const BoardDetector& detector, ImageSource& images, int threads,
                          const BoardCache& cache,
                          const std::function<void(std::size_t done)>& progress,
                          double max_mpx = kUsualMaxMpx);

}  // namespace vlp
