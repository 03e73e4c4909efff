// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/board_images.h"

#include <fmt/core.h>

#include <algorithm>
#include <opencv2/core/utility.hpp>

#include "calibration/intrinsics/board_check.h"
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

/// Skips views that show the same as one before them to the last digit: copies of a file, under
/// whatever name, tell nothing new.
void skip_copies(SeenBoards& seen) {
  const auto same = [](const BoardView& a, const BoardView& b) {
    return !a.seen.tags.empty() &&
           std::equal(a.seen.tags.begin(), a.seen.tags.end(), b.seen.tags.begin(),
                      b.seen.tags.end(), [](const SeenTag& one, const SeenTag& two) {
                        return one.id == two.id && one.corners_px == two.corners_px;
                      });
  };
  std::vector<BoardView> kept;
  for (BoardView& view : seen.views) {
    const auto original = std::find_if(kept.begin(), kept.end(),
                                       [&](const BoardView& other) { return same(view, other); });
    if (original != kept.end()) {
      seen.skipped.push_back({view.image, "is the same picture as " + original->image});
    } else {
      kept.push_back(std::move(view));
    }
  }
  seen.views = std::move(kept);
}

/// Share of an image's pixels that are at its brightest level.
double white_share(const cv::Mat& image) {
  const double white = image.depth() == CV_16U ? 65535 : 255;
  constexpr double nearly = 0.996;
  return static_cast<double>(cv::countNonZero(image >= nearly * white)) /
         static_cast<double>(image.total());
}

/// What a few of the images say of tags that are not as board.yaml says.
struct Looked {
  double white_share = 0;
  std::string other_tags;
  fs::path image;
};

Looked looked_at(const BoardImages& input) {
  constexpr int tried = 3;
  Looked looked;
  int read = 0;
  for (const fs::path& file : input.images) {
    if (read == tried || !looked.other_tags.empty()) break;
    try {
      const cv::Mat image = read_image(file, input.max_mpx);
      looked.white_share = std::max(looked.white_share, white_share(image));
      looked.other_tags = other_tags(input.board, image);
      looked.image = file;
      ++read;
    } catch (const InputError&) {
      continue;  // it is skipped already
    }
  }
  return looked;
}

/// Why no tag of the board is seen, if a few of the images show why.
void explain_no_tags(const BoardImages& input, SeenBoards& seen) {
  const Board& board = input.board;
  int unusable = 0, overexposed = 0;
  for (const BoardView& view : seen.views) {
    unusable += view.seen.unusable;
    overexposed += view.seen.overexposed;
  }
  constexpr double much = 0.1;
  const Looked looked = looked_at(input);
  if (looked.white_share > much || (overexposed > 0 && 2 * overexposed > unusable)) {
    std::string words = fmt::format(
        "no tag of the board can be used in {} images, and {:.0f} % of the image is overexposed: "
        "white runs over the tags' corners; expose shorter",
        seen.views.size(), 100 * looked.white_share);
    if (!looked.other_tags.empty()) words += "; or is board.yaml wrong? " + looked.other_tags;
    return seen.fail(StepFailure::undetermined, std::move(words));
  }
  if (!looked.other_tags.empty()) {
    return seen.fail(StepFailure::wrong_board, looked.image.string() + ": " + looked.other_tags,
                     input.board_file);
  }
  if (unusable > 0) {
    return seen.fail(
        StepFailure::undetermined,
        fmt::format("{} tags of the board are seen in {} images, but none with all four corners "
                    "sharp: are they blurred, hidden, cut by the image's edge, or seen twice?",
                    unusable, seen.views.size()));
  }
  const auto stranger = std::find_if(seen.views.begin(), seen.views.end(),
                                     [](const auto& view) { return !view.seen.foreign.empty(); });
  if (stranger != seen.views.end()) {
    const std::string shown = check_board(board, seen.views, {}).problem;
    return seen.fail(
        StepFailure::wrong_board,
        fmt::format("the images show tags of {}, but with other ids than the board has, "
                    "{} to {} ({} of them in {}){}",
                    board.family, board.first_id, board.first_id + board.cols * board.rows - 1,
                    stranger->seen.foreign.size(), stranger->image,
                    shown.empty() ? "" : "; " + shown),
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
  FoundBoards found = detect_boards(
      detector, input.images, input.threads, corner_cache(input.cache, input.board),
      [&](std::size_t done) {
        if (progress) progress(done, input.images.size());
      },
      input.max_mpx);
  SeenBoards seen;
  seen.skipped = skipped_images(input.images, found.refused);
  seen.views = std::move(found.views);
  if (seen.views.empty()) {
    throw nothing_usable(input.images.front().parent_path(), input.images.size(), seen);
  }
  check_sizes(seen.views);
  skip_copies(seen);
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
