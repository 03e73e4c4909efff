// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/board_images.h"

#include <fmt/core.h>

#include <algorithm>
#include <opencv2/core/utility.hpp>

#include "detection/boards/corner_cache.h"
#include "detection/boards/other_tags.h"
#include "detection/image_file.h"
#include "rig/input_error.h"
#include "session/skipped_images.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

void check_sizes(const std::vector<BoardView>& views) {
  const auto [width, height] = views.front().imager_px;
  for (const BoardView& view : views) {
    if (view.imager_px == views.front().imager_px) continue;
    throw InputError(
        view.image,
        fmt::format("is {} x {}, but {} is {} x {} px; are they of one camera?", view.imager_px[0],
                    view.imager_px[1], views.front().image, width, height));
  }
}

/// By its tags; their ids and corners are read all the same.
bool upside_down(const BoardView& view) {
  double down_px = 0;
  for (const SeenTag& tag : view.seen.tags) {
    down_px +=
        (tag.corners_px[0] - tag.corners_px[3]).y() + (tag.corners_px[1] - tag.corners_px[2]).y();
  }
  return down_px < 0;
}

/// Why no tag of the board is seen, if a few of the images show why.
void explain_no_tags(const BoardImages& input, SeenBoards& seen) {
  const Board& board = input.board;
  const auto stranger = std::find_if(seen.views.begin(), seen.views.end(),
                                     [](const auto& view) { return view.seen.foreign > 0; });
  if (stranger != seen.views.end()) {
    return seen.fail(
        StepFailure::wrong_board,
        fmt::format("the images show tags of {}, but with other ids than the board has, "
                    "{} to {} ({} of them in {})",
                    board.family, board.first_id, board.first_id + board.cols * board.rows - 1,
                    stranger->seen.foreign, stranger->image),
        input.board_file);
  }
  constexpr std::size_t tried = 3;
  for (std::size_t i = 0; i < std::min(tried, input.images.size()); ++i) {
    const std::string other = other_tags(board, read_image(input.images[i]));
    if (other.empty()) continue;
    return seen.fail(StepFailure::wrong_board, input.images[i].string() + ": " + other,
                     input.board_file);
  }
  seen.fail(StepFailure::undetermined,
            fmt::format("no tag of {} is seen in {} images: is the board in them, sharp, well lit, "
                        "and each tag wider than 20 px?",
                        board.family, seen.views.size()));
}

}  // namespace

std::vector<fs::path> image_files(const std::vector<std::string>& names) {
  std::vector<fs::path> files;
  for (const std::string& name : names) {
    if (!fs::is_directory(name)) {
      files.emplace_back(name);
      continue;
    }
    const auto inside = images_in(name);
    files.insert(files.end(), inside.begin(), inside.end());
  }
  return files;
}

SeenBoards see_boards(const BoardImages& input, const StepProgress& progress) {
  cv::setNumThreads(1);  // the images themselves go in parallel
  const BoardDetector detector(input.board);
  FoundBoards found = detect_boards(detector, input.images, input.threads,
                                    corner_cache(input.cache, input.board), [&](std::size_t done) {
                                      if (progress) progress(done, input.images.size());
                                    });
  SeenBoards seen;
  seen.skipped = skipped_images(input.images, found.refused);
  seen.views = std::move(found.views);
  if (seen.views.empty()) {
    throw nothing_usable(input.images.front().parent_path(), input.images.size(), seen);
  }
  check_sizes(seen.views);
  const bool any = std::any_of(seen.views.begin(), seen.views.end(),
                               [](const BoardView& view) { return !view.seen.tags.empty(); });
  if (!any) explain_no_tags(input, seen);
  const auto turned = std::count_if(seen.views.begin(), seen.views.end(), upside_down);
  if (turned > 0) {
    seen.details.push_back(
        fmt::format("{} views show the board upside down; that does no harm", turned));
  }
  return seen;
}

}  // namespace vlp
