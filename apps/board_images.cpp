// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "board_images.h"

#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <opencv2/core/utility.hpp>

#include "app.h"
#include "calibration/intrinsics/board_check.h"
#include "corner_cache.h"
#include "detection/boards/other_tags.h"
#include "detection/image_file.h"
#include "progress.h"
#include "rig/input_error.h"

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

/// Says why no tag of the board is seen, if a few of the images show why.
[[noreturn]] void explain_no_tags(const std::vector<BoardView>& views,
                                  const std::vector<fs::path>& images, const Board& board,
                                  const std::string& board_file) {
  const auto stranger = std::find_if(views.begin(), views.end(),
                                     [](const auto& view) { return view.seen.foreign > 0; });
  if (stranger != views.end()) {
    throw InputError(
        board_file,
        fmt::format("the images show tags of {}, but with other ids than the board has, "
                    "{} to {} ({} of them in {})",
                    board.family, board.first_id, board.first_id + board.cols * board.rows - 1,
                    stranger->seen.foreign, stranger->image));
  }
  constexpr std::size_t tried = 3;
  for (std::size_t i = 0; i < std::min(tried, images.size()); ++i) {
    const std::string other = other_tags(board, read_image(images[i]));
    if (!other.empty()) throw InputError(board_file, images[i].string() + ": " + other);
  }
  throw Undetermined(fmt::format(
      "no tag of {} is seen in {} images: is the board in them, sharp, well lit, and each "
      "tag wider than 20 px?",
      board.family, views.size()));
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

std::vector<BoardView> board_views(const std::vector<fs::path>& images, const Board& board,
                                   const std::string& board_file, int threads,
                                   const std::string& cache) {
  cv::setNumThreads(1);  // the images themselves go in parallel
  const BoardDetector detector(board);
  BoardViews found;
  {
    Progress progress("images");
    found = detect_boards(detector, images, threads, corner_cache(cache, board),
                          [&](std::size_t done) { progress.update(done, images.size()); });
  }
  for (const std::string& refused : found.refused) spdlog::warn("{}; skipped", refused);
  if (found.views.empty()) {
    throw InputError(images.front(),
                     fmt::format("and the others: none of {} images can be used", images.size()));
  }
  check_sizes(found.views);
  const bool any = std::any_of(found.views.begin(), found.views.end(),
                               [](const BoardView& view) { return !view.seen.tags.empty(); });
  if (!any) explain_no_tags(found.views, images, board, board_file);
  const BoardCheck check = check_board(board, found.views, {});
  if (!check.problem.empty()) throw InputError(board_file, check.problem);
  const auto turned = std::count_if(found.views.begin(), found.views.end(), upside_down);
  if (turned > 0) spdlog::debug("{} views show the board upside down; that does no harm", turned);
  return found.views;
}

}  // namespace vlp
