// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/board_images.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <utility>

#include "calibration/intrinsics/board_check.h"
#include "calibration/intrinsics/board_lattice.h"
#include "calibration/intrinsics/common_curve.h"
#include "calibration/intrinsics/corner_blunders.h"
#include "calibration/intrinsics/mrcal_files.h"
#include "detection/boards/corner_cache.h"
#include "detection/boards/corner_table.h"
#include "detection/boards/other_tags.h"
#include "detection/boards/square_corners.h"
#include "detection/image_file.h"
#include "rig/board_layout.h"
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

/// By its tags, where it has any; their ids and corners are read all the same.
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
  std::vector<BoardView> kept;
  std::vector<std::vector<SeenPoint>> known;
  SkippedViews skipped;
  for (BoardView& view : seen.views) {
    auto corners = corners_of(view.seen);
    const auto original = std::find_if(known.begin(), known.end(), [&](const auto& other) {
      return !corners.empty() &&
             std::equal(corners.begin(), corners.end(), other.begin(), other.end(),
                        [](const SeenPoint& one, const SeenPoint& two) {
                          return one.index == two.index && one.pixel == two.pixel;
                        });
    });
    if (original != known.end()) {
      const BoardView& same = kept[static_cast<std::size_t>(original - known.begin())];
      skipped.add(view.image, "is the same picture as " + same.image,
                  "are the same pictures as others");
    } else {
      kept.push_back(std::move(view));
      known.push_back(std::move(corners));
    }
  }
  seen.views = std::move(kept);
  skipped.tell(seen);
}

void tell_turned(SeenBoards& seen, const Board& board) {
  if (board.kind == BoardKind::chessboard) {
    seen.details.push_back(
        "a chessboard does not tell which of its ends is up; the lens does not depend on it");
  }
  const auto turned = std::count_if(seen.views.begin(), seen.views.end(), upside_down);
  if (turned == 0) return;
  seen.details.push_back(
      fmt::format("{} views show the board upside down; that does no harm", turned));
}

bool is_mrcal_table(const fs::path& file) { return file.extension() == ".vnl"; }

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

/// Frames of videos that lie apart.
FromVideos a_few(const BoardImages& input) {
  constexpr std::size_t tried = 12;
  const FromVideos all{input.every, input.max_mpx};
  const std::size_t apart =
      std::max<std::size_t>(1, ImageSource(input.images, all).expected() / tried);
  return {input.every * static_cast<int>(apart), input.max_mpx};
}

Looked looked_at(const BoardImages& input) {
  constexpr int tried = 3;
  Looked looked;
  int read = 0;
  ImageSource images(input.images, a_few(input));
  while (const auto source = images.next()) {
    if (read == tried || !looked.other_tags.empty()) break;
    try {
      const cv::Mat image = source->read(input.max_mpx);
      looked.white_share = std::max(looked.white_share, white_share(image));
      looked.other_tags = other_tags(input.board, image);
      looked.image = source->file;
      ++read;
    } catch (const InputError&) {
      continue;  // it is skipped already
    }
  }
  return looked;
}

/// Why no chessboard is seen, by the largest one in a few of the images.
void explain_no_chessboard(const BoardImages& input, SeenBoards& seen) {
  constexpr std::size_t tried = 12;
  const Board& board = input.board;
  std::array<int, 2> most{0, 0};
  ImageSource images(input.images, a_few(input));
  for (auto source = images.next(); source && source->index < tried; source = images.next()) {
    try {
      const auto shown = chessboard_shown(source->read(input.max_mpx));
      if (shown[0] * shown[1] > most[0] * most[1]) most = shown;
    } catch (const InputError&) {
      continue;  // it is skipped already
    }
  }
  // It may be turned by a quarter.
  if ((most[0] < most[1]) != (board.cols < board.rows)) std::swap(most[0], most[1]);
  const auto [cols, rows] = most;
  if (cols > board.cols || rows > board.rows) {
    std::string words =
        fmt::format("the images show a chessboard of {} x {} squares or more", cols, rows);
    if (cols == board.cols + 1 && rows == board.rows + 1) {
      words += ": cols and rows count squares, not the corners between them";
    }
    return seen.fail(StepFailure::wrong_board, std::move(words), input.board_file);
  }
  std::string words = fmt::format(
      "no chessboard of {} x {} squares is seen in {} images: is all of it in them, with white "
      "around it, sharp, well lit, and each square wider than 10 px?",
      board.cols, board.rows, seen.views.size());
  if (cols > 0) words += fmt::format(" At most {} x {} squares are seen", cols, rows);
  seen.fail(StepFailure::undetermined, std::move(words));
}

std::string not_seen(const Board& board, std::size_t images) {
  return fmt::format(
      "no {} of {} is seen in {} images: is the board in them, sharp, well lit, and each {} wider "
      "than 20 px?",
      board.has_squares() ? "marker" : "tag", board.family, images,
      board.has_squares() ? "marker" : "tag");
}

/// Why no tag of the board is seen, if a few of the images show why.
void explain_no_tags(const BoardImages& input, SeenBoards& seen) {
  const Board& board = input.board;
  if (board.kind == BoardKind::chessboard) return explain_no_chessboard(input, seen);
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
                    board.family, board.first_id,
                    board.first_id + static_cast<int>(board_layout(board).size()) - 1,
                    stranger->seen.foreign.size(), stranger->image,
                    shown.empty() ? "" : "; " + shown),
        input.board_file);
  }
  seen.fail(StepFailure::undetermined, not_seen(board, seen.views.size()));
}

/// Leaves out corners that lie elsewhere than their neighbours say; of tags the whole tag.
void leave_out_blunders(SeenBoards& seen, const Board& board) {
  const BoardLattice lattice(board);
  for (BoardView& view : seen.views) {
    const auto blunders = corner_blunders(lattice.corners(view.seen));
    if (blunders.empty()) continue;
    const auto corners = corners_of(view.seen);
    const Eigen::Vector2d first = corners[blunders.front()].pixel;
    seen.warnings.push_back(fmt::format(
        "{}: {} of its {} corners lie elsewhere than their neighbours put them, the first at "
        "({:.1f}, {:.1f}); left out",
        view.image, blunders.size(), corners.size(), first.x(), first.y()));
    for (auto i = blunders.rbegin(); i != blunders.rend(); ++i) {
      if (!view.seen.points.empty()) {
        view.seen.points.erase(view.seen.points.begin() + static_cast<std::ptrdiff_t>(*i));
        continue;
      }
      const auto tag = view.seen.tags.begin() + static_cast<std::ptrdiff_t>(*i / 4);
      const bool gone = i != blunders.rbegin() && *(i - 1) / 4 == *i / 4;
      if (gone) continue;
      view.seen.tags.erase(tag);
      ++view.seen.unusable;
    }
  }
}

}  // namespace

bool holds_corners(const fs::path& file) {
  return is_mrcal_table(file) || file.extension() == ".csv";
}

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
  const BoardDetector detector(input.board);
  ImageSource images(input.images, {input.every, input.max_mpx});
  FoundBoards found = detect_boards(
      detector, images, input.threads, corner_cache(input.cache, input.board),
      [&](std::size_t done) {
        if (progress) progress(done, std::max(done, images.expected()));
      },
      input.max_mpx);
  SeenBoards seen;
  seen.skipped = skipped_images(found.images, found.refused);
  seen.warnings = images.warnings();
  seen.views = std::move(found.views);
  if (seen.views.empty()) {
    throw nothing_usable(input.images.front().parent_path(), found.images.size(), seen);
  }
  check_sizes(seen.views);
  skip_copies(seen);
  const bool any = std::any_of(seen.views.begin(), seen.views.end(),
                               [](const BoardView& view) { return view.seen.any(); });
  if (!any) explain_no_tags(input, seen);
  tell_turned(seen, input.board);
  take_common_curve(seen.views, input.board);
  return seen;
}

SeenBoards see_corners(const CornerFile& input) {
  SeenBoards seen;
  seen.views = is_mrcal_table(input.file)
                   ? read_corners(input.file, input.board, input.imager_px)
                   : read_corner_table(input.file, input.board, input.imager_px);
  leave_out_blunders(seen, input.board);
  skip_copies(seen);
  const bool any = std::any_of(seen.views.begin(), seen.views.end(),
                               [](const BoardView& view) { return view.seen.any(); });
  if (!any) {
    seen.fail(StepFailure::wrong_board,
              fmt::format("none of its {} images has a corner of the board; is it of another board "
                          "than {}?",
                          seen.views.size(), input.board_file.string()),
              input.file);
  }
  tell_turned(seen, input.board);
  return seen;
}

}  // namespace vlp
