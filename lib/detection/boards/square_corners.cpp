// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/square_corners.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "detection/boards/edge_crossing.h"
#include "detection/boards/lattice_order.h"
#include "detection/boards/opencv_boards_library.h"
#include "detection/boards/tag_pattern.h"
#include "geometry/homography.h"

namespace vlp {
namespace {

/// Returns true if the pixel lies in the image; false if it is not finite.
bool is_in_image(const Eigen::Vector2d& pixel, const cv::Mat& image) {
  return pixel.x() >= -0.5 && pixel.y() >= -0.5 && pixel.x() < image.cols - 0.5 &&
         pixel.y() < image.rows - 0.5;
}

/// Returns the factor by which a large image is reduced for OpenCV's search, which then needs a
/// fraction of the memory. Corners are refined in the full image.
int choose_reduction_factor(const cv::Mat& image) {
  constexpr double large_px = 8e6;
  return static_cast<int>(std::ceil(std::sqrt(static_cast<double>(image.total()) / large_px)));
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

SquareCorners::SquareCorners(const Board& board)
    : cols_(board.cols - 1),
      rows_(board.rows - 1),
      square_size_m_(board.square_size_m),
      margin_m_((board.square_size_m - board.tag_size_m) / 2),
      layout_(list_board_tags(board)) {}

std::vector<PointDetection> SquareCorners::refine_corner_guesses(const std::vector<Guess>& guesses,
                                                                 const GrayLevels& image) const {
  constexpr int min_px = 2, max_px = 5;
  constexpr double min_fit_px = 2.5, max_fit_px = 8, fit_fraction = 0.75;
  constexpr double edge_px = 2;  // a corner nearer to the image's edge is cut short
  std::vector<PointDetection> points;
  for (const auto& [index, pixel, next, free_px] : guesses) {
    if (!is_in_image(pixel, image.sharp)) continue;
    const int radius_px = std::clamp(static_cast<int>(free_px / 2), min_px, max_px);
    const int reach_px = std::clamp(static_cast<int>(free_px * 0.8), min_px, 2 * max_px);
    const auto saddle = find_saddle_point(image.smoothed, pixel, reach_px, radius_px);
    if (!saddle) continue;
    const double fit_px = std::clamp(free_px * fit_fraction, min_fit_px, max_fit_px);
    const Eigen::Vector2d at = fit_edge_intersection_at_corner(
                                   image.sharp, *saddle, {next[0] - pixel, next[1] - pixel}, fit_px)
                                   .value_or(*saddle);
    if (at.x() < edge_px || at.y() < edge_px || at.x() > image.sharp.cols - 1 - edge_px ||
        at.y() > image.sharp.rows - 1 - edge_px) {
      continue;
    }
    points.push_back({index, at});
  }
  return points;
}

std::vector<PointDetection> SquareCorners::detect_chessboard_corners(
    const GrayLevels& image) const {
  const cv::Mat searched = reduce_image(image.sharp, choose_reduction_factor(image.sharp));
  const std::vector<cv::Point2f> found = find_chessboard_corners(searched, {cols_, rows_});
  if (found.empty()) return {};
  std::vector<PointDetection> points;
  const bool whole = searched.size() == image.sharp.size();
  for (std::size_t i = 0; i < found.size(); ++i) {
    const auto [x, y] = found[i];
    points.push_back({i, {x, y}});
    if (whole) continue;
    points.back().pixel = {scale_to_full_resolution(x, image.sharp.cols, searched.cols),
                           scale_to_full_resolution(y, image.sharp.rows, searched.rows)};
  }
  renumber_lattice_points(points, cols_, rows_, true);
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
  // A single missing corner makes all others doubtful, because OpenCV extrapolates the lattice.
  return corners.size() == guesses.size() ? corners : std::vector<PointDetection>();
}

std::vector<PointDetection> SquareCorners::detect_corners_near_markers(
    const std::vector<TagDetection>& markers, const GrayLevels& image) const {
  constexpr double adjacent = 0.8, near = 2.2;  // in squares
  constexpr double max_marker_error =
      0.25;  // of a square: one of the markers is clutter, read as another
  std::vector<Guess> guesses;
  for (int row = 0; row < rows_; ++row) {
    for (int col = 0; col < cols_; ++col) {
      const Eigen::Vector2d here_m = square_size_m_ * Eigen::Vector2d(col, row);
      const auto [pairs, nearest_m] = find_nearest_tag_corners(
          markers, layout_, near * square_size_m_, [&](const BoardTag& tag) {
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

std::array<int, 2> detect_chessboard_size_in_squares(const cv::Mat& image) {
  constexpr int min_px = 10;
  if (std::min(image.cols, image.rows) < min_px) return {0, 0};
  const cv::Mat1b levels =
      reduce_image(scale_image_to_8_bits(image), choose_reduction_factor(image));
  const cv::Size corners = find_chessboard_size_in_corners(levels, {3, 3});
  if (corners.empty()) return {0, 0};
  return {corners.width + 1, corners.height + 1};
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
  const double width = tag_width_with_border_in_bits(*family_, border_bits_);
  free_fraction_ = std::min(board.tag_spacing, border_bits_ / width);
}

std::optional<TagDetection> TouchingTags::refine_tag_corners(TagDetection tag,
                                                             const GrayLevels& image) const {
  constexpr int min_px = 2, max_px = 5;
  constexpr double min_fit_px = 2.5, max_fit_px = 8, fit_fraction = 0.75;
  const double free_px = compute_shortest_edge_px(tag) * free_fraction_;
  const int radius_px = std::clamp(static_cast<int>(free_px / 2), min_px, max_px);
  const int reach_px = std::max(min_px, static_cast<int>(free_px * 0.8));
  for (auto& corner : tag.corners_px) {
    const auto found = find_saddle_point(image.smoothed, corner, reach_px, radius_px);
    if (!found) return {};
    corner = *found;
  }
  const double fit_px = std::clamp(free_px * fit_fraction, min_fit_px, max_fit_px);
  const auto saddles = tag.corners_px;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto found = fit_edge_intersection_at_corner(
        image.sharp, saddles[k],
        {saddles[(k + 1) % 4] - saddles[k], saddles[(k + 3) % 4] - saddles[k]}, fit_px);
    if (found) tag.corners_px[k] = *found;
  }
  if (!image_matches_tag_bits(tag, image.smoothed, *family_, border_bits_)) return {};
  return tag;
}

std::optional<TagDetection> TouchingTags::predict_missing_tag(
    const BoardTag& missing, const std::vector<TagDetection>& tags) const {
  constexpr double max_distance = 2.2;  // in tags: neighbors, including diagonal ones
  const auto [pairs, nearest_m] = find_nearest_tag_corners(
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

std::vector<TagDetection> TouchingTags::find_missing_tags(const std::vector<TagDetection>& tags,
                                                          const GrayLevels& image) const {
  std::vector<TagDetection> all = tags;
  for (bool more = true; more;) {
    more = false;
    for (const BoardTag& place : layout_) {
      const bool known = std::any_of(all.begin(), all.end(),
                                     [&](const TagDetection& tag) { return tag.id == place.id; });
      if (known) continue;
      const auto guess = predict_missing_tag(place, all);
      const auto tag = guess ? refine_tag_corners(*guess, image) : std::nullopt;
      if (!tag) continue;
      all.push_back(*tag);
      more = true;
    }
  }
  return {all.begin() + static_cast<std::ptrdiff_t>(tags.size()), all.end()};
}

}  // namespace vlp
