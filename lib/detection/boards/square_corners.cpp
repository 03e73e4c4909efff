// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/square_corners.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>

#include "detection/boards/edge_crossing.h"
#include "detection/boards/lattice_order.h"
#include "geometry/homography.h"

namespace vlp {
namespace {

constexpr int kFlags = cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_EXHAUSTIVE;

/// Returns true if the pixel lies in the image; false if it is not finite.
bool in_image(const Eigen::Vector2d& pixel, const cv::Mat& image) {
  return pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < image.cols && pixel.y() < image.rows;
}

/// Returns the factor by which a large image is reduced for OpenCV's search, which then needs a
/// fraction of the memory. Corners are refined in the full image.
int reduction_of(const cv::Mat& image) {
  constexpr double large_px = 8e6;
  return static_cast<int>(std::ceil(std::sqrt(static_cast<double>(image.total()) / large_px)));
}

cv::Mat reduced(const cv::Mat& image, int times) {
  if (times <= 1) return image;
  cv::Mat small;
  cv::resize(image, small, {image.cols / times, image.rows / times}, 0, 0, cv::INTER_AREA);
  return small;
}

/// Converts a coordinate in the reduced image to the full image. Their sizes need not be multiples.
double enlarged(float at, int large, int small) {
  return (static_cast<double>(at) + 0.5) * large / small - 0.5;
}

/// Seeds OpenCV's random number generator equally for each image, so that results are reproducible.
void start_chance() { cv::theRNG().state = 1; }

}  // namespace

SquareCorners::SquareCorners(const Board& board)
    : cols_(board.cols - 1),
      rows_(board.rows - 1),
      square_size_m_(board.square_size_m),
      margin_m_((board.square_size_m - board.tag_size_m) / 2),
      layout_(board_layout(board)) {}

std::vector<SeenPoint> SquareCorners::exact(const std::vector<Guess>& guesses,
                                            const GreyLevels& image) const {
  constexpr int least_px = 2, most_px = 5;
  constexpr double least_fit_px = 2.5, most_fit_px = 8, fit_share = 0.75;
  constexpr double edge_px = 2;  // a corner nearer to the image's edge is cut short
  std::vector<SeenPoint> points;
  for (const auto& [index, pixel, next, free_px] : guesses) {
    if (!in_image(pixel, image.sharp)) continue;
    const int radius_px = std::clamp(static_cast<int>(free_px / 2), least_px, most_px);
    const int reach_px = std::clamp(static_cast<int>(free_px * 0.8), least_px, 2 * most_px);
    const auto saddle = saddle_point(image.smoothed, pixel, reach_px, radius_px);
    if (!saddle) continue;
    const double fit_px = std::clamp(free_px * fit_share, least_fit_px, most_fit_px);
    const Eigen::Vector2d at =
        edge_crossing(image.sharp, *saddle, {next[0] - pixel, next[1] - pixel}, fit_px)
            .value_or(*saddle);
    if (at.x() < edge_px || at.y() < edge_px || at.x() >= image.sharp.cols - edge_px ||
        at.y() >= image.sharp.rows - edge_px) {
      continue;
    }
    points.push_back({index, at});
  }
  return points;
}

std::vector<SeenPoint> SquareCorners::of_chessboard(const GreyLevels& image) const {
  std::vector<cv::Point2f> found;
  const cv::Mat searched = reduced(image.sharp, reduction_of(image.sharp));
  start_chance();
  if (!cv::findChessboardCornersSB(searched, {cols_, rows_}, found, kFlags)) return {};
  std::vector<SeenPoint> points;
  const bool whole = searched.size() == image.sharp.size();
  for (std::size_t i = 0; i < found.size(); ++i) {
    const auto [x, y] = found[i];
    points.push_back({i, {x, y}});
    if (whole) continue;
    points.back().pixel = {enlarged(x, image.sharp.cols, searched.cols),
                           enlarged(y, image.sharp.rows, searched.rows)};
  }
  order_lattice(points, cols_, rows_, true);
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
  auto corners = exact(guesses, image);
  // A single missing corner makes all others doubtful, because OpenCV extrapolates the lattice.
  return corners.size() == guesses.size() ? corners : std::vector<SeenPoint>();
}

std::vector<SeenPoint> SquareCorners::beside(const std::vector<SeenTag>& markers,
                                             const GreyLevels& image) const {
  constexpr std::size_t enough = 4;
  constexpr double adjacent = 0.8, near = 2.2;  // in squares
  constexpr double misread = 0.25;  // of a square: one of the markers is clutter, read as another
  std::vector<Guess> guesses;
  for (int row = 0; row < rows_; ++row) {
    for (int col = 0; col < cols_; ++col) {
      const Eigen::Vector2d here_m = square_size_m_ * Eigen::Vector2d(col, row);
      std::vector<std::pair<double, const SeenTag*>> around;
      for (const SeenTag& marker : markers) {
        const auto place = std::find_if(layout_.begin(), layout_.end(),
                                        [&](const auto& tag) { return tag.id == marker.id; });
        const double away = ((place->corners_m[0] + place->corners_m[2]) / 2 - here_m).norm();
        if (away < near * square_size_m_) around.emplace_back(away, &marker);
      }
      std::sort(around.begin(), around.end(), [](const auto& a, const auto& b) {
        return std::pair(a.first, a.second->id) < std::pair(b.first, b.second->id);
      });
      if (around.empty() || around.front().first > adjacent * square_size_m_) continue;
      std::vector<PlanePair> pairs;
      for (std::size_t i = 0; i < std::min(enough, around.size()); ++i) {
        const SeenTag& marker = *around[i].second;
        const auto place = std::find_if(layout_.begin(), layout_.end(),
                                        [&](const auto& tag) { return tag.id == marker.id; });
        for (std::size_t k = 0; k < 4; ++k) {
          pairs.push_back({place->corners_m[k], marker.corners_px[k]});
        }
      }
      const Eigen::Matrix3d px_from_board = homography(pairs);
      const auto seen = [&](const Eigen::Vector2d& at_m) -> Eigen::Vector2d {
        return (px_from_board * at_m.homogeneous()).hnormalized();
      };
      const Eigen::Vector2d here = seen(here_m);
      const Eigen::Vector2d right = seen(here_m + Eigen::Vector2d(square_size_m_, 0));
      const Eigen::Vector2d down = seen(here_m + Eigen::Vector2d(0, square_size_m_));
      const double square_px = std::min((right - here).norm(), (down - here).norm());
      const bool one_plane = std::all_of(pairs.begin(), pairs.end(), [&](const PlanePair& pair) {
        return (seen(pair.from) - pair.to).norm() < misread * square_px;
      });
      if (!one_plane) continue;
      guesses.push_back({static_cast<std::size_t>(row * cols_ + col),
                         here,
                         {right, down},
                         std::sqrt(2) * square_px * margin_m_ / square_size_m_});
    }
  }
  return exact(guesses, image);
}

std::array<int, 2> chessboard_shown(const cv::Mat& image) {
  constexpr int least_px = 10;
  if (std::min(image.cols, image.rows) < least_px) return {0, 0};
  const cv::Mat1b levels = reduced(eight_bits(image), reduction_of(image));
  std::vector<cv::Point2f> corners;
  cv::Mat squares;
  start_chance();
  if (!cv::findChessboardCornersSB(levels, {3, 3}, corners, kFlags | cv::CALIB_CB_LARGER,
                                   squares)) {
    return {0, 0};
  }
  // The metadata have one entry per corner.
  return {squares.cols + 1, squares.rows + 1};
}

}  // namespace vlp
