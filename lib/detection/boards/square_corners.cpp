// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/square_corners.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <set>

#include "detection/boards/edge_crossing.h"
#include "detection/boards/lattice_order.h"
#include "detection/boards/opencv_boards_library.h"
#include "detection/boards/tag_pattern.h"
#include "geometry/homography.h"
#include "geometry/median.h"

namespace vlp {
namespace {

/// Returns true if the pixel lies in the image; false if it is not finite.
bool is_in_image(const Eigen::Vector2d& pixel, const cv::Mat& image) {
  return pixel.x() >= -0.5 && pixel.y() >= -0.5 && pixel.x() < image.cols - 0.5 &&
         pixel.y() < image.rows - 0.5;
}

/// Image sizes for OpenCV's searches. On photographs, large squares at full resolution are often
/// missed: of 14 boards 960 px wide, the search by saddle points found 3, and 13 at a third of the
/// size. Small squares need the full resolution, which takes longest.
constexpr double kPreferredLongSide_px = 1300;  // of the first search
constexpr double kMaxSearched_px2 = 8e6;        // of the last search: limits time and memory

/// Step of the search for a chessboard.
struct SearchStep {
  /// Factor by which the image is reduced.
  int reduction;
  ChessboardSearch search;
};

/// Returns the steps of a search, the fastest first. The search by squares takes seconds if a large
/// image does not show the board, and is therefore used for reduced images only.
std::vector<SearchStep> plan_search(const cv::Size& size) {
  // OpenCV's search by squares requires a window of some pixels.
  constexpr int min_by_squares_px = 30, min_side_px = 200;
  const auto round_up = [](double value) {
    return std::max(1, static_cast<int>(std::ceil(value)));
  };
  const int preferred = round_up(std::max(size.width, size.height) / kPreferredLongSide_px);
  const int finest = round_up(std::sqrt(size.area() / kMaxSearched_px2));
  const int preferred_side_px = std::min(size.width, size.height) / preferred;
  std::vector<SearchStep> steps;
  if (preferred_side_px >= min_by_squares_px)
    steps.push_back({preferred, ChessboardSearch::by_squares});
  if (preferred_side_px / 2 >= min_side_px) {
    steps.push_back({2 * preferred, ChessboardSearch::by_squares});
    steps.push_back({2 * preferred, ChessboardSearch::by_saddle_points});
  }
  for (int reduction = preferred;; reduction = std::max(finest, reduction / 2)) {
    steps.push_back({reduction, ChessboardSearch::by_saddle_points});
    if (reduction <= finest) return steps;
  }
}

cv::Mat reduce_image(const cv::Mat& image, int times) {
  if (times <= 1) return image;
  cv::Mat small;
  cv::resize(image, small, {image.cols / times, image.rows / times}, 0, 0, cv::INTER_AREA);
  return small;
}

/// Converts a coordinate in the reduced image to the full image. Their sizes need not be multiples.
double scale_to_full_resolution(float at, int large, int small) {
  return (static_cast<double>(at) + 0.5) * large / small - 0.5;
}

}  // namespace

namespace {

/// Fits a corner by fit_edge_crossing() in a window that is large enough for the
/// blur.
/// @param free_px  distance from the corner within which only its squares are visible
std::optional<FittedCorner> fit_corner(const cv::Mat1b& image, const Eigen::Vector2d& guess_px,
                                       const std::array<Eigen::Vector2d, 2>& along,
                                       double free_px) {
  constexpr double min_radius_px = 2.5, sharp_radius_px = 8, max_radius_px = 48;
  constexpr double free_fraction = 0.75, radius_to_blur_ratio = 5;
  const double largest_px = std::clamp(free_px * free_fraction, min_radius_px, max_radius_px);
  double radius_px = std::min(sharp_radius_px, largest_px);
  for (;;) {
    const auto fit = fit_edge_crossing(image, guess_px, along, radius_px);
    const double required_px = fit ? radius_to_blur_ratio * fit->blur_px : 2 * radius_px;
    if (radius_px >= std::min(required_px, largest_px)) return fit;
    radius_px = std::min(1.1 * required_px, largest_px);
  }
}

}  // namespace

SquareCorners::SquareCorners(const Board& board)
    : cols_(board.cols - 1),
      rows_(board.rows - 1),
      square_size_m_(board.square_size_m),
      margin_m_((board.square_size_m - board.tag_size_m) / 2),
      layout_(list_board_tags(board)) {}

std::vector<PointDetection> SquareCorners::refine_corner_guesses(const std::vector<Guess>& guesses,
                                                                 const GrayLevels& image) const {
  constexpr int min_px = 2, max_px = 5;
  constexpr double edge_px = 2;  // a corner nearer to the image's edge is cut short
  std::vector<PointDetection> points;
  for (const auto& [index, pixel, next, free_px] : guesses) {
    if (!is_in_image(pixel, image.sharp)) continue;
    const int radius_px = std::clamp(static_cast<int>(free_px / 2), min_px, max_px);
    const int reach_px = std::clamp(static_cast<int>(free_px * 0.8), min_px, 2 * max_px);
    const std::array<Eigen::Vector2d, 2> along{next[0] - pixel, next[1] - pixel};
    const auto saddle = find_saddle_point(image.smoothed, pixel, reach_px, radius_px);
    auto fit = saddle ? fit_corner(image.sharp, *saddle, along, free_px) : std::nullopt;
    // Acute and blurred corners may have no saddle, or another one nearby.
    if (!fit) fit = fit_corner(image.sharp, pixel, along, free_px);
    if (!fit && !saddle) continue;
    const auto [at, sd_px, blur_px] = fit ? *fit : FittedCorner{*saddle, 0};
    if (at.x() < edge_px || at.y() < edge_px || at.x() > image.sharp.cols - 1 - edge_px ||
        at.y() > image.sharp.rows - 1 - edge_px) {
      continue;
    }
    points.push_back({index, at, sd_px});
  }
  return points;
}

namespace {

/// Levels of the squares of a chessboard, from all of its inner corners. Positions are in squares
/// from the first corner; beyond the corners they are extrapolated.
class SquareLevels {
 public:
  SquareLevels(const std::vector<PointDetection>& corners, int cols, int rows,
               const cv::Mat1b& image)
      : corners_(corners), cols_(cols), rows_(rows), image_(image) {}

  /// Returns the mean difference between neighboring squares along a row at position y; positive if
  /// the square at (0.5, 0.5) and every other one is brighter.
  double compute_row_contrast(double y) const {
    return compute_contrast(cols_, std::floor(y), [&](int col) { return get_level(col + 0.5, y); });
  }
  /// Returns the same along a column at position x.
  double compute_column_contrast(double x) const {
    return compute_contrast(rows_, std::floor(x), [&](int row) { return get_level(x, row + 0.5); });
  }

 private:
  static double compute_contrast(int corners, double offset, const auto& level) {
    double sum = 0;
    for (int i = 0; i + 2 < corners; ++i) {
      const double difference = level(i) - level(i + 1);
      sum += std::fmod(i + offset, 2) == 0 ? difference : -difference;
    }
    return sum / (corners - 2);
  }
  /// Returns the level at a position, or gray outside the image.
  double get_level(double x, double y) const {
    constexpr double gray = 128;
    const int col = std::clamp(static_cast<int>(x), 0, cols_ - 2);
    const int row = std::clamp(static_cast<int>(y), 0, rows_ - 2);
    const auto corner = [&](int right, int down) {
      return corners_[static_cast<std::size_t>((row + down) * cols_ + col + right)].pixel;
    };
    const double u = x - col, v = y - row;
    const Eigen::Vector2d pixel = (1 - v) * ((1 - u) * corner(0, 0) + u * corner(1, 0)) +
                                  v * ((1 - u) * corner(0, 1) + u * corner(1, 1));
    if (!is_in_image(pixel, image_)) return gray;
    return image_(static_cast<int>(std::lround(pixel.y())),
                  static_cast<int>(std::lround(pixel.x())));
  }

  const std::vector<PointDetection>& corners_;
  int cols_, rows_;
  const cv::Mat1b& image_;
};

/// Returns true if `corners` are those of a complete chessboard: the squares between them are
/// alternately black and white, and there are none beyond the outermost squares. OpenCV's searches
/// may return a part of a larger chessboard, or skip every other column.
bool are_corners_of_whole_board(const std::vector<PointDetection>& corners, int cols, int rows,
                                const cv::Mat1b& image) {
  constexpr double min_fraction = 0.3, max_fraction = 0.5;  // of the contrast of the board
  constexpr double middle = 0.5;
  // In squares from the outermost corners. Squares that the border of a larger board cuts are
  // narrower than others.
  constexpr double beyond = 1.3;
  const SquareLevels levels(corners, cols, rows, image);
  std::vector<double> contrasts;
  for (int row = 0; row + 1 < rows; ++row)
    contrasts.push_back(levels.compute_row_contrast(row + middle));
  for (int col = 0; col + 1 < cols; ++col)
    contrasts.push_back(levels.compute_column_contrast(col + middle));
  const double typical = upper_median(contrasts);
  const double weakest =
      std::ranges::min(contrasts, {}, [&](double contrast) { return contrast / typical; });
  const double largest_beyond =
      std::max({std::abs(levels.compute_row_contrast(-beyond)),
                std::abs(levels.compute_row_contrast(rows - 1 + beyond)),
                std::abs(levels.compute_column_contrast(-beyond)),
                std::abs(levels.compute_column_contrast(cols - 1 + beyond))});
  return weakest / typical > min_fraction && largest_beyond < max_fraction * std::abs(typical);
}

/// Returns true if at least 90 % of the corners of a chessboard are measured, and half of each row
/// and column. Corners may be covered or in the shadow of an edge. A whole line is missing if
/// OpenCV extrapolates a row beyond the board.
bool is_chessboard_confirmed(const std::vector<PointDetection>& corners, int cols, int rows) {
  constexpr double min_fraction = 0.9, min_line_fraction = 0.5;
  if (static_cast<double>(corners.size()) < min_fraction * cols * rows) return false;
  std::vector<int> in_col(static_cast<std::size_t>(cols)), in_row(static_cast<std::size_t>(rows));
  for (const PointDetection& corner : corners) {
    ++in_col[corner.index % in_col.size()];
    ++in_row[corner.index / in_col.size()];
  }
  return *std::ranges::min_element(in_col) >= min_line_fraction * rows &&
         *std::ranges::min_element(in_row) >= min_line_fraction * cols;
}

}  // namespace

std::vector<PointDetection> SquareCorners::search_chessboard(const cv::Mat1b& image) const {
  for (const auto& [reduction, search] : plan_search(image.size())) {
    const cv::Mat searched = reduce_image(image, reduction);
    const std::vector<cv::Point2f> found = detect_square_corners(searched, {cols_, rows_}, search);
    if (found.empty()) continue;
    std::vector<PointDetection> points;
    for (std::size_t i = 0; i < found.size(); ++i) {
      points.push_back({i,
                        {scale_to_full_resolution(found[i].x, image.cols, searched.cols),
                         scale_to_full_resolution(found[i].y, image.rows, searched.rows)}});
    }
    renumber_lattice(points, cols_, rows_, true);
    if (are_corners_of_whole_board(points, cols_, rows_, image)) return points;
  }
  return {};
}

std::vector<PointDetection> SquareCorners::detect_chessboard(const GrayLevels& image) const {
  const std::vector<PointDetection> points = search_chessboard(image.sharp);
  if (points.empty()) return {};
  const auto at = [&](int col, int row) {
    return points[static_cast<std::size_t>(row * cols_ + col)].pixel;
  };
  std::vector<Guess> guesses;
  for (int row = 0; row < rows_; ++row) {
    for (int col = 0; col < cols_; ++col) {
      const Eigen::Vector2d here = at(col, row);
      // The last corners of a row or column use the preceding corner.
      const Eigen::Vector2d right = at(col + (col + 1 < cols_ ? 1 : -1), row);
      const Eigen::Vector2d down = at(col, row + (row + 1 < rows_ ? 1 : -1));
      guesses.push_back({static_cast<std::size_t>(row * cols_ + col),
                         here,
                         {right, down},
                         std::min((right - here).norm(), (down - here).norm())});
    }
  }
  auto corners = refine_corner_guesses(guesses, image);
  return is_chessboard_confirmed(corners, cols_, rows_) ? corners : std::vector<PointDetection>();
}

std::vector<PointDetection> SquareCorners::detect_near_markers(
    const std::vector<TagDetection>& markers, const GrayLevels& image) const {
  constexpr double adjacent = 0.8, near = 2.2;  // in squares
  constexpr double max_marker_error =
      0.25;  // of a square: one of the markers is clutter, read as another
  std::vector<Guess> guesses;
  for (int row = 0; row < rows_; ++row) {
    for (int col = 0; col < cols_; ++col) {
      const Eigen::Vector2d here_m = square_size_m_ * Eigen::Vector2d(col, row);
      const auto [pairs, nearest_m] =
          match_tag_corners(markers, layout_, near * square_size_m_, [&](const BoardTag& tag) {
            return ((tag.corners_m[0] + tag.corners_m[2]) / 2 - here_m).norm();
          });
      if (nearest_m > adjacent * square_size_m_) continue;
      const Eigen::Matrix3d px_from_board = estimate_homography(pairs);
      const auto project = [&](const Eigen::Vector2d& at_m) -> Eigen::Vector2d {
        return (px_from_board * at_m.homogeneous()).hnormalized();
      };
      const Eigen::Vector2d here = project(here_m);
      const Eigen::Vector2d right = project(here_m + Eigen::Vector2d(square_size_m_, 0));
      const Eigen::Vector2d down = project(here_m + Eigen::Vector2d(0, square_size_m_));
      const double square_px = std::min((right - here).norm(), (down - here).norm());
      const bool one_plane = std::all_of(pairs.begin(), pairs.end(), [&](const PlanePair& pair) {
        return (project(pair.from) - pair.to).norm() < max_marker_error * square_px;
      });
      if (!one_plane) continue;
      guesses.push_back({static_cast<std::size_t>(row * cols_ + col),
                         here,
                         {right, down},
                         std::sqrt(2) * square_px * margin_m_ / square_size_m_});
    }
  }
  return refine_corner_guesses(guesses, image);
}

std::array<int, 2> SquareCorners::detect_largest_part(const cv::Mat1b& image) const {
  const int reduction = plan_search(image.size()).front().reduction;
  const cv::Size corners = detect_chessboard_size(reduce_image(image, reduction), {3, 3});
  if (corners.empty()) return {0, 0};
  std::array<int, 2> squares{corners.width + 1, corners.height + 1};
  // The board may be rotated by 90 degrees.
  if ((squares[0] < squares[1]) != (cols_ < rows_)) std::swap(squares[0], squares[1]);
  return squares;
}

std::array<int, 2> get_reduction_range(const cv::Size& size) {
  const auto [finest, coarsest] =
      std::ranges::minmax(plan_search(size), {}, &SearchStep::reduction);
  return {finest.reduction, coarsest.reduction};
}

namespace {

double compute_shortest_edge_px(const TagDetection& tag) {
  double shortest = INFINITY;
  for (std::size_t k = 0; k < 4; ++k) {
    shortest = std::min(shortest, (tag.corners_px[k] - tag.corners_px[(k + 1) % 4]).norm());
  }
  return shortest;
}

}  // namespace

TouchingTags::TouchingTags(const Board& board)
    : layout_(list_board_tags(board)),
      family_(make_tag_family(board.family)),
      border_bits_(board.border_bits),
      tag_size_m_(board.tag_size_m) {
  const double width = tag_width_bits(*family_, border_bits_);
  free_fraction_ = std::min(board.tag_spacing, border_bits_ / width);
}

std::optional<TagDetection> TouchingTags::refine_tag_corners(TagDetection tag,
                                                             const GrayLevels& image) const {
  constexpr int min_px = 2, max_px = 5;
  const double free_px = compute_shortest_edge_px(tag) * free_fraction_;
  const int radius_px = std::clamp(static_cast<int>(free_px / 2), min_px, max_px);
  const int reach_px = std::max(min_px, static_cast<int>(free_px * 0.8));
  for (auto& corner : tag.corners_px) {
    const auto found = find_saddle_point(image.smoothed, corner, reach_px, radius_px);
    if (!found) return {};
    corner = *found;
  }
  const auto saddles = tag.corners_px;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto found =
        fit_corner(image.sharp, saddles[k],
                   {saddles[(k + 1) % 4] - saddles[k], saddles[(k + 3) % 4] - saddles[k]}, free_px);
    if (!found) return {};
    tag.corners_px[k] = found->pixel;
    tag.corner_sds_px[k] = found->sd_px;
  }
  if (!has_tag_bits(tag, image.sharp, *family_, border_bits_)) return {};
  return tag;
}

std::optional<TagDetection> TouchingTags::predict_missing_tag(
    const BoardTag& missing, const std::vector<TagDetection>& tags) const {
  constexpr double max_distance = 2.2;  // in tags: neighbors, including diagonal ones
  const auto [pairs, nearest_m] = match_tag_corners(
      tags, layout_, max_distance * tag_size_m_,
      [&](const BoardTag& tag) { return (tag.corners_m[0] - missing.corners_m[0]).norm(); });
  if (pairs.empty()) return {};
  const Eigen::Matrix3d px_from_board = estimate_homography(pairs);
  TagDetection tag{missing.id, {}};
  for (std::size_t k = 0; k < 4; ++k) {
    tag.corners_px[k] = (px_from_board * missing.corners_m[k].homogeneous()).hnormalized();
  }
  return tag;
}

TouchingTags::CompletedTags TouchingTags::refine_and_complete_tags(
    const std::vector<TagDetection>& rough, const GrayLevels& image) const {
  CompletedTags result;
  std::set<int> refined_ids;
  const auto refine = [&](const std::optional<TagDetection>& guess) {
    const auto tag = guess ? refine_tag_corners(*guess, image) : std::nullopt;
    if (!tag) return false;
    result.tags.push_back(*tag);
    refined_ids.insert(tag->id);
    return true;
  };
  for (const TagDetection& tag : rough) refine(tag);
  for (bool more = true; more;) {
    more = false;
    result.rejected_predictions.clear();
    for (const BoardTag& place : layout_) {
      if (refined_ids.contains(place.id)) continue;
      const auto guess = predict_missing_tag(place, result.tags);
      if (refine(guess) || refine(predict_missing_tag(place, rough))) {
        more = true;
      } else if (guess) {
        result.rejected_predictions.push_back(*guess);
      }
    }
  }
  return result;
}

}  // namespace vlp
