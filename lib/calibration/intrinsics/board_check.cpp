// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/board_check.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "geometry/homography.h"
#include "rig/board_layout.h"
#include "rig/yaml_text.h"

namespace vlp {
namespace {

/// Where tag `to` is, seen from tag `from`, whose width is 1: x right and y down on the print.
struct Step {
  int from, to;
  Eigen::Vector2d way;
};

std::optional<SeenTag> straightened(const SeenTag& tag, const std::optional<Lens>& lens) {
  if (!lens) return tag;
  SeenTag straight = tag;
  for (auto& corner : straight.corners_px) {
    const auto ray = lens->unproject(corner);
    if (!ray || !(ray->direction.z() > 0)) return {};
    corner = ray->direction.hnormalized();
  }
  return straight;
}

/// From every tag to its nearest neighbours.
std::vector<Step> steps_in(std::span<const BoardView> views, const std::optional<Lens>& lens) {
  constexpr std::size_t nearest = 3;
  std::vector<Step> steps;
  for (const BoardView& view : views) {
    std::vector<SeenTag> tags;
    for (const SeenTag& tag : view.seen.tags) {
      if (const auto straight = straightened(tag, lens)) tags.push_back(*straight);
    }
    for (const SeenTag& tag : tags) {
      const std::array<PlanePair, 4> square{{{tag.corners_px[0], {-0.5, 0.5}},
                                             {tag.corners_px[1], {0.5, 0.5}},
                                             {tag.corners_px[2], {0.5, -0.5}},
                                             {tag.corners_px[3], {-0.5, -0.5}}}};
      const Eigen::Matrix3d tags_from_image = homography(square);
      std::vector<Step> around;
      for (const SeenTag& other : tags) {
        if (other.id == tag.id) continue;
        Eigen::Vector2d middle = Eigen::Vector2d::Zero();
        for (const auto& corner : other.corners_px) {
          middle += (tags_from_image * corner.homogeneous()).hnormalized() / 4;
        }
        around.push_back({tag.id, other.id, middle});
      }
      std::sort(around.begin(), around.end(),
                [](const Step& a, const Step& b) { return a.way.norm() < b.way.norm(); });
      around.resize(std::min(around.size(), nearest));
      steps.insert(steps.end(), around.begin(), around.end());
    }
  }
  return steps;
}

struct Fit {
  /// Steps that go to a neighbour, over all.
  double share = 0;
  std::optional<double> pitch;
};

Fit fit_of(const Board& board, const std::vector<Step>& steps) {
  constexpr double straight = 0.25;       // off the way, of its length
  std::map<int, Eigen::Vector2d> places;  // in pitches
  for (const BoardTag& tag : board_layout(board)) {
    places[tag.id] = tag.corners_m[3] / tag_pitch_m(board);
  }
  std::vector<double> pitches;
  for (const Step& step : steps) {
    const auto from = places.find(step.from), to = places.find(step.to);
    if (from == places.end() || to == places.end()) continue;
    const Eigen::Vector2d expected = to->second - from->second;
    const double pitch = step.way.dot(expected) / expected.squaredNorm();
    if (expected.norm() < 1.5 &&
        (step.way - pitch * expected).norm() < straight * step.way.norm() && pitch > 0) {
      pitches.push_back(pitch);
    }
  }
  Fit fit;
  if (pitches.empty()) return fit;
  fit.share = static_cast<double>(pitches.size()) / static_cast<double>(steps.size());
  const auto middle = pitches.begin() + static_cast<std::ptrdiff_t>(pitches.size() / 2);
  std::nth_element(pitches.begin(), middle, pitches.end());
  fit.pitch = *middle;
  return fit;
}

/// The layout that explains the steps, if one does.
std::optional<Board> better_order(Board board, const std::vector<Step>& steps, double enough) {
  for (const bool swapped : {false, true}) {
    if (swapped) std::swap(board.cols, board.rows);
    for (const bool column_major : {false, true}) {
      for (const auto from : {BoardCorner::bottom_left, BoardCorner::bottom_right,
                              BoardCorner::top_left, BoardCorner::top_right}) {
        board.id_order = {column_major, from};
        if (fit_of(board, steps).share >= enough) return board;
      }
    }
  }
  return {};
}

}  // namespace

BoardCheck check_board(const Board& board, std::span<const BoardView> views,
                       const std::optional<Lens>& lens) {
  constexpr double enough = 0.8;
  const auto steps = steps_in(views, lens);
  constexpr std::size_t least_steps = 10;
  if (steps.size() < least_steps) return {};
  const Fit fit = fit_of(board, steps);
  BoardCheck check{"", fit.pitch};
  if (fit.share < enough) {
    const auto better = better_order(board, steps, enough);
    if (!better) {
      check.problem = "the tags in the images do not lie as on a board of " +
                      std::to_string(board.cols) + " x " + std::to_string(board.rows) +
                      " tags from id " + std::to_string(board.first_id) +
                      " in any id_order; is it another board?";
    } else {
      check.problem = "the images show cols " + std::to_string(better->cols) + ", rows " +
                      std::to_string(better->rows) + ", id_order " + name_of(better->id_order);
    }
    return check;
  }
  const double tolerance = lens ? 0.01 : 0.05;
  const double expected = 1 + board.tag_spacing;
  if (std::abs(*fit.pitch / expected - 1) > tolerance) {
    const double hundreds = 100;
    const double seen = std::round((*fit.pitch - 1) * hundreds) / hundreds;
    check.problem = "tag_spacing is " + shortest(board.tag_spacing) +
                    ", but the images show gaps of " + shortest(seen) + " tags";
  }
  return check;
}

}  // namespace vlp
