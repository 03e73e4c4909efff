// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/board_intake.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "calibration/intrinsics/board_check.h"
#include "calibration/intrinsics/corner_outliers.h"
#include "calibration/intrinsics/mrcal_files.h"
#include "detection/boards/corner_table.h"
#include "detection/boards/other_tags.h"
#include "detection/boards/square_corners.h"
#include "frontend/image_quality.h"
#include "frontend/observation.h"
#include "geometry/median.h"
#include "rig/board_layout.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

/// Returns the box around the corners of the board; the whole image if there are none.
cv::Rect get_board_region(const BoardDetection& seen, const cv::Mat& image) {
  std::vector<cv::Point2f> corners;
  const auto add = [&](const Eigen::Vector2d& pixel) {
    corners.emplace_back(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
  };
  for (const TagDetection& tag : seen.tags) {
    for (const auto& corner : tag.corners_px) add(corner);
  }
  for (const PointDetection& point : seen.points) add(point.pixel);
  return corners.empty() ? cv::Rect({}, image.size()) : cv::boundingRect(corners);
}

/// Returns true if most of the tags that cannot be used are overexposed.
bool are_tags_overexposed(const BoardDetection& seen) {
  return 2 * seen.num_overexposed_tags > seen.num_unusable_tags;
}

/// Returns the median edge length in the image, px, of the detected tags, or of the squares between
/// detected corners; 0 without any.
double compute_median_edge_px(const Board& board, const BoardDetection& seen) {
  std::vector<double> edges_px;
  for (std::size_t i = 1; i < seen.points.size(); ++i) {
    const auto &before = seen.points[i - 1], &point = seen.points[i];
    const bool is_next = point.index == before.index + 1 &&
                         point.index % static_cast<std::size_t>(board.cols - 1) != 0;
    if (is_next) edges_px.push_back((point.pixel - before.pixel).norm());
  }
  if (!board.has_squares()) {
    for (const TagDetection& tag : seen.tags) {
      for (std::size_t k = 0; k < 4; ++k)
        edges_px.push_back((tag.corners_px[(k + 1) % 4] - tag.corners_px[k]).norm());
    }
  }
  return edges_px.empty() ? 0 : upper_median(edges_px);
}

/// Returns the median of the reported standard deviations of the corners, px; std::nullopt if half
/// of the corners have none.
std::optional<double> compute_median_sd_px_of(const BoardDetection& seen) {
  std::vector<double> sds_px;
  for (const PointDetection& corner : collect_detected_corners(seen)) {
    sds_px.push_back(corner.sd_px > 0 ? corner.sd_px : std::numeric_limits<double>::infinity());
  }
  if (sds_px.empty()) return std::nullopt;
  const double median_px = upper_median(sds_px);
  return std::isfinite(median_px) ? std::optional(median_px) : std::nullopt;
}

/// Describes which searches did not find a chessboard, and the largest part of one.
std::string explain_chessboard(const Board& board, const BoardDetection& seen,
                               const std::array<int, 2>& size_px) {
  const auto [finest, coarsest] = get_reduction_range({size_px[0], size_px[1]});
  std::string message =
      fmt::format("no complete chessboard of {} x {} squares", board.cols, board.rows);
  const auto [cols, rows] = seen.largest_chessboard_part;
  if (cols > board.cols || rows > board.rows) {
    return fmt::format(
        "a larger chessboard of {} x {} squares or more is visible; correct cols and "
        "rows of board.yaml",
        cols, rows);
  }
  if (cols == board.cols && rows == board.rows) {
    return fmt::format(
        "{} x {} squares are visible, but over a tenth of the corners cannot be "
        "measured; uncover them, or focus",
        cols, rows);
  }
  message += cols > 0 ? fmt::format("; the largest part has {} x {}", cols, rows)
                      : std::string("; no part of one is visible");
  return message + fmt::format(
                       " (searched by squares and by corners, image reduced {} to {} times); "
                       "show all squares, or correct cols and rows of board.yaml",
                       finest, coarsest);
}

std::string explain_corners(const Board& board, const BoardDetection& seen,
                            const std::array<int, 2>& size_px) {
  if (board.kind == BoardKind::chessboard && seen.points.empty()) {
    return explain_chessboard(board, seen, size_px);
  }
  if (board.has_squares() || !seen.points.empty()) {
    return fmt::format("only {} corners of the board can be used, or too many of them in a line",
                       seen.points.size());
  }
  std::string message = fmt::format("only {} tags of the board can be used", seen.tags.size());
  if (are_tags_overexposed(seen)) {
    // [LENS-1] `runs over the`
    message += fmt::format(", around {} more white is overexposed and runs over the corners",
                           seen.num_overexposed_tags);
  } else if (seen.num_unusable_tags > 0) {
    message += fmt::format(", {} more are blurred, hidden or cut", seen.num_unusable_tags);
  }
  return message;
}

/// Rejects images that do not have the most frequent size. Among equally frequent sizes the first
/// one counts.
void reject_other_sizes(std::vector<Observation>& images) {
  std::map<std::array<int, 2>, std::size_t> counts;
  for (const Observation& image : images) {
    if (image.board) ++counts[image.size_px];
  }
  if (counts.size() < 2) return;
  const auto most_frequent =
      std::max_element(images.begin(), images.end(), [&](const auto& a, const auto& b) {
        return (a.board ? counts[a.size_px] : 0) < (b.board ? counts[b.size_px] : 0);
      });
  const std::array<int, 2> size_px = most_frequent->size_px;
  for (Observation& image : images) {
    if (!image.board || image.size_px == size_px) continue;
    image.reject(RejectionReason::wrong_size, explain_image_size(image.size_px, size_px));
    image.board.reset();
  }
}

bool is_upside_down(const BoardView& view) {
  double down_px = 0;
  for (const TagDetection& tag : view.detection.tags) {
    down_px +=
        (tag.corners_px[0] - tag.corners_px[3]).y() + (tag.corners_px[1] - tag.corners_px[2]).y();
  }
  return down_px < 0;
}

void note_image_orientation(const Board& board, Observations& result) {
  if (board.kind == BoardKind::chessboard) {
    result.details.emplace_back(
        "a chessboard has the same appearance after a rotation by 180 degrees; this does not "
        "affect the lens");
  }
  const auto turned = std::count_if(
      result.images.begin(), result.images.end(),
      [](const Observation& image) { return image.board && is_upside_down(*image.board); });
  if (turned == 0) return;
  result.details.push_back(
      fmt::format("{} views show the board upside down; this is harmless", turned));
}

std::vector<BoardView> collect_views(const std::vector<Observation>& images) {
  std::vector<BoardView> views;
  for (const Observation& image : images) {
    if (image.board) views.push_back(*image.board);
  }
  return views;
}

/// Returns options for a few frames of each video, spread over its length.
FrontendOptions make_sparse_options(const std::vector<fs::path>& images, FrontendOptions options) {
  constexpr std::size_t num_samples = 12;
  const std::size_t step =
      std::max<std::size_t>(1, ImageSource(images, options).expected_image_count() / num_samples);
  options.every *= static_cast<int>(step);
  return options;
}

/// Reads up to `num_samples` images that can be read, until `inspect` returns false.
void explain_from_sample_images(
    const std::vector<fs::path>& images, const FrontendOptions& options, int num_samples,
    const std::function<bool(const fs::path& file, const cv::Mat&)>& inspect) {
  const FrontendOptions sparse = make_sparse_options(images, options);
  ImageSource source(images, sparse);
  while (const auto image = source.read_next_image()) {
    try {
      if (!inspect(image->file, image->read_gray_image(sparse)) || --num_samples == 0) return;
    } catch (const InputError&) {
      continue;  // rejected already
    }
  }
}

/// Explains why the chessboard is not detected, from the largest part of one in the images.
IntakeFailure explain_no_chessboard(const Board& board, const fs::path& board_file,
                                    const std::vector<BoardView>& views) {
  std::array<int, 2> largest{0, 0};
  for (const BoardView& view : views) {
    const auto squares = view.detection.largest_chessboard_part;
    if (squares[0] * squares[1] > largest[0] * largest[1]) largest = squares;
  }
  const auto [cols, rows] = largest;
  if (cols > board.cols || rows > board.rows) {
    std::string message =
        fmt::format("the images show a chessboard of {} x {} squares or more", cols, rows);
    if (cols == board.cols + 1 && rows == board.rows + 1) {
      message += ": cols and rows count squares, not the corners between them";
    }
    return {true, std::move(message), board_file};
  }
  std::string message = fmt::format(
      "no chessboard of {} x {} squares is visible in {} images: is it complete, with a white "
      "margin, sharp, well lit, and each square wider than 10 px?",
      board.cols, board.rows, views.size());
  if (cols > 0) {
    message += fmt::format(
        " At most {} x {} squares are visible: cover none, or correct cols and "
        "rows of board.yaml",
        cols, rows);
  }
  return {false, std::move(message)};
}

/// Explains why no image shows a corner of the board.
IntakeFailure explain_no_board(const std::vector<fs::path>& images, const Board& board,
                               const fs::path& board_file, const FrontendOptions& options,
                               const std::vector<BoardView>& views) {
  if (board.kind == BoardKind::chessboard) {
    return explain_no_chessboard(board, board_file, views);
  }
  int unusable = 0, overexposed = 0;
  for (const BoardView& view : views) {
    unusable += view.detection.num_unusable_tags;
    overexposed += view.detection.num_overexposed_tags;
  }
  double white = 0;
  std::string description;
  fs::path described_file;
  constexpr int num_samples = 3;
  explain_from_sample_images(
      images, options, num_samples, [&](const fs::path& file, const cv::Mat& image) {
        white = std::max(white, compute_saturated_fraction(image, cv::Rect({}, image.size())));
        description = describe_other_tags(board, image);
        described_file = file;
        return description.empty();
      });
  constexpr double max_white = 0.1;
  if (white > max_white || (overexposed > 0 && 2 * overexposed > unusable)) {
    std::string message = fmt::format(
        "no tag of the board can be used in {} images, and {:.0f} % of the image is overexposed: "
        "white runs over the tags' corners; expose shorter",
        views.size(), 100 * white);
    if (!description.empty()) message += "; or is board.yaml wrong? " + description;
    return {false, std::move(message)};
  }
  if (!description.empty()) return {true, described_file.string() + ": " + description, board_file};
  if (unusable > 0) {
    return {false,
            fmt::format(
                "{} tags of the board are visible in {} images, but none with four sharp corners: "
                "are they blurred, covered, cut off by the image border, or visible twice?",
                unusable, views.size())};
  }
  const auto foreign = std::find_if(views.begin(), views.end(), [](const auto& view) {
    return !view.detection.foreign_tags.empty();
  });
  if (foreign != views.end()) {
    const std::string layout = check_board_layout(board, views, {}).problem;
    return {true,
            fmt::format("the images show tags of {}, but with other ids than those of the board, "
                        "{} to {} ({} of them in {}){}",
                        board.family, board.first_id,
                        board.first_id + static_cast<int>(list_board_tags(board).size()) - 1,
                        foreign->detection.foreign_tags.size(), foreign->image,
                        layout.empty() ? "" : "; " + layout),
            board_file};
  }
  const char* tag = board.has_squares() ? "marker" : "tag";
  return {false, fmt::format("no {} of {} is visible in {} images: is the board in them, sharp, "
                             "well lit, and each {} wider than 20 px?",
                             tag, board.family, views.size(), tag)};
}

/// Rejects corners that contradict their neighbors. A tag is rejected as a whole. Returns a
/// description; empty if no corner is rejected.
std::string remove_corner_outliers(const BoardLattice& lattice, BoardView& view) {
  const auto blunders = list_corner_outliers(lattice.list_corners(view.detection));
  if (blunders.empty()) return "";
  const auto corners = collect_detected_corners(view.detection);
  const Eigen::Vector2d first = corners[blunders.front()].pixel;
  // [LENS-5] `neighbors predict them` | outliers: corners (for tags, the whole tag) or image
  //   rejected | check the image
  std::string message = fmt::format(
      "{} of its {} corners are not where their neighbors predict them, the first at "
      "({:.1f}, {:.1f}); rejected",
      blunders.size(), corners.size(), first.x(), first.y());
  for (auto i = blunders.rbegin(); i != blunders.rend(); ++i) {
    if (!view.detection.points.empty()) {
      view.detection.points.erase(view.detection.points.begin() + static_cast<std::ptrdiff_t>(*i));
      continue;
    }
    const bool is_removed = i != blunders.rbegin() && *(i - 1) / 4 == *i / 4;
    if (is_removed) continue;
    view.detection.tags.erase(view.detection.tags.begin() + static_cast<std::ptrdiff_t>(*i / 4));
    ++view.detection.num_unusable_tags;
  }
  return message;
}

bool is_mrcal_table(const fs::path& file) { return file.extension() == ".vnl"; }

/// Rejects an image with too few corners to determine the pose of the board.
void reject_few_corners(const Board& board, const BoardLattice& lattice, Observation& image) {
  const BoardDetection& seen = image.board->detection;
  if (lattice.can_determine_pose(seen)) return;
  if (!seen.has_corners() && !seen.foreign_tags.empty()) {
    // [LENS-3] `the board does not have`, `not show the board` | other board, or wrong `first_id`,
    //   `cols`, `rows`, `id_order` | correct `board.yaml`
    return image.reject(RejectionReason::other_board, "shows tags that the board does not have");
  }
  if (!seen.has_corners() && seen.num_unusable_tags == 0 && board.kind != BoardKind::chessboard) {
    return image.reject(RejectionReason::no_board, "does not show the board");
  }
  image.reject(
      are_tags_overexposed(seen) ? RejectionReason::overexposed : RejectionReason::too_few_corners,
      explain_corners(board, seen, image.size_px));
}

}  // namespace

BoardIntake::BoardIntake(const Board& board, const FrontendOptions& options,
                         const std::optional<std::array<int, 2>>& imager_px)
    : board_(board),
      lattice_(board),
      detector_(board),
      options_(options),
      imager_px_(imager_px),
      cache_(options.corner_cache, board) {}

Observation BoardIntake::detect_board(const SourceImage& source) const {
  Observation result{source.file, source.time_s};
  std::optional<CachedView> found = cache_.find_cached_view(source);
  if (found && (!imager_px_ || found->view.imager_px == *imager_px_)) {
    result.size_px = found->view.imager_px;
  } else {
    read_and_detect(source, options_, imager_px_, result, [&](const cv::Mat& image) {
      const ImageBlur blur = measure_image_blur(image);
      BoardView view{result.image_file_name(), result.size_px, detector_.detect_board(image)};
      const double white =
          compute_saturated_fraction(image, get_board_region(view.detection, image));
      found = CachedView{std::move(view),
                         std::isfinite(blur.sigma_px) ? std::optional(blur.sigma_px) : std::nullopt,
                         blur.bright_fraction, white};
    });
    if (!result.is_image_kept()) return result;
    cache_.store_cached_view(source, *found);
  }
  result.blur_px = found->blur_px;
  result.board = std::move(found->view);
  reject_low_quality_image(result, found->bright_fraction, found->white_fraction);
  return result;
}

void BoardIntake::reject_low_quality_image(Observation& image, double bright_fraction,
                                           double white_fraction) const {
  const BoardDetection& seen = image.board->detection;
  const bool has_pose = lattice_.can_determine_pose(seen);
  if (white_fraction > options_.max_white_fraction) {
    constexpr double max_sd_px = 0.25;
    const auto sd_px = has_pose ? compute_median_sd_px_of(seen) : std::nullopt;
    const std::string text =
        fmt::format("overexposed: {:.0f} % of the {} is at full scale", 100 * white_fraction,
                    seen.has_corners() ? "board" : "image");
    if (!sd_px || *sd_px > max_sd_px) {
      return image.reject(
          RejectionReason::overexposed,
          fmt::format("{}, {:.0f} % at most; expose shorter (limit: --max-white-fraction)", text,
                      100 * options_.max_white_fraction));
    }
    image.doubt =
        fmt::format("{}; used, as its corners have standard deviations of {:.2f} px", text, *sd_px);
  }
  if (!has_pose && bright_fraction < options_.min_bright_fraction) {
    // [LENS-1] `too dark:` | corners not measurable, or displaced | change exposure or light
    return image.reject(RejectionReason::too_dark,
                        fmt::format("too dark: the brightest 1 % reach {:.0f} % of the full scale, "
                                    "{:.0f} % at least",
                                    100 * bright_fraction, 100 * options_.min_bright_fraction));
  }
  // [LENS-2] `no contrast` | no sharp edges | focus, hold still
  if (!image.blur_px) return image.reject(RejectionReason::no_contrast, "no contrast");
  const std::string problem = describe_blur(image);
  if (!problem.empty()) return image.reject(RejectionReason::blurred, problem);
  reject_few_corners(board_, lattice_, image);
}

std::string BoardIntake::describe_blur(const Observation& image) const {
  // Half a bit of a tag of eight bits; a square needs corners with a saddle.
  constexpr double max_tag_fraction = 0.06, max_square_fraction = 0.2;
  const double in_image_px =
      options_.max_blur_fraction * std::max(image.size_px[0], image.size_px[1]);
  if (*image.blur_px > in_image_px) {
    return fmt::format(
        "blurred: {:.1f} px, {:.1f} at most, {:g} of the longer side (limit: --max-blur-fraction); "
        "focus, or keep camera and board still",
        *image.blur_px, in_image_px, options_.max_blur_fraction);
  }
  const double edge_px = compute_median_edge_px(board_, image.board->detection);
  const bool has_squares = board_.has_squares();
  const double on_board_px = (has_squares ? max_square_fraction : max_tag_fraction) * edge_px;
  if (edge_px == 0 || *image.blur_px <= on_board_px) return "";
  return fmt::format(
      "blurred: {:.1f} px, {:.1f} at most for {} of {:.0f} px; move the board nearer, "
      "or focus",
      *image.blur_px, on_board_px, has_squares ? "squares" : "tags", edge_px);
}

Observations detect_boards(const std::vector<fs::path>& images, const Board& board,
                           const fs::path& board_file, const FrontendOptions& options,
                           const IntakeProgress& progress) {
  const BoardIntake intake(board, options);
  ImageSource source(images, options);
  Observations result = collect_observations(
      source, options.threads, [&](const SourceImage& image) { return intake.detect_board(image); },
      progress);
  check_any_readable(images.front().parent_path(), result.images);
  reject_other_sizes(result.images);
  reject_repeated_images(result.images, ImageUse::boards, options);
  if (std::none_of(result.images.begin(), result.images.end(), [](const Observation& image) {
        return image.board && image.board->detection.has_corners();
      })) {
    result.failure =
        explain_no_board(images, board, board_file, options, collect_views(result.images));
  }
  note_image_orientation(board, result);
  return result;
}

bool is_corner_file(const fs::path& file) {
  return is_mrcal_table(file) || file.extension() == ".csv";
}

Observations read_board_views(const fs::path& file, const Board& board, const fs::path& board_file,
                              const std::array<int, 2>& imager_px, const FrontendOptions& options) {
  Observations result;
  const BoardLattice lattice(board);
  bool is_seen = false;
  for (BoardView& view : is_mrcal_table(file) ? read_mrcal_corners(file, board, imager_px)
                                              : read_corner_table(file, board, imager_px)) {
    std::string doubt = remove_corner_outliers(lattice, view);
    is_seen = is_seen || view.detection.has_corners();
    Observation image{view.image};
    image.doubt = std::move(doubt);
    image.size_px = view.imager_px;
    image.board = std::move(view);
    reject_few_corners(board, lattice, image);
    result.images.push_back(std::move(image));
  }
  reject_repeated_images(result.images, ImageUse::boards, options);
  if (!is_seen) {
    result.failure = {true,
                      fmt::format("none of its {} images has a corner of the board; is it of "
                                  "another board than {}?",
                                  result.images.size(), board_file.string()),
                      file};
  }
  note_image_orientation(board, result);
  return result;
}

}  // namespace vlp
