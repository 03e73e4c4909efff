// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/board_check.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <vector>

#include "geometry/homography.h"
#include "rig/board_layout.h"
#include "rig/yaml_text.h"

namespace vlp {
namespace {

/// Largest edge displacement by tone curves, overexposure and blur, px.
constexpr double kMaxShift_px = 1.5;

/// Displacement from tag `from` to tag `to`, in widths of `from`: x right and y down on the board.
struct Step {
  int from, to;
  Eigen::Vector2d displacement;
  /// Width of `from` in the image, the mean of its edges.
  double width_px;
};

std::optional<TagDetection> undistort_tag(const TagDetection& tag,
                                          const std::optional<Lens>& lens) {
  if (!lens) return tag;
  TagDetection straight = tag;
  for (auto& corner : straight.corners_px) {
    const auto ray = lens->unproject_pixel(corner);
    if (!ray || !(ray->direction.z() > 0)) return {};
    corner = ray->direction.hnormalized();
  }
  return straight;
}

double compute_mean_edge_px(const TagDetection& tag) {
  double sum_px = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    sum_px += (tag.corners_px[(k + 1) % 4] - tag.corners_px[k]).norm();
  }
  return sum_px / 4;
}

/// Returns the steps from every tag to its four nearest neighbors, including tags that the board
/// does not have. `shift_px`: inward displacement of the tag edges.
std::vector<Step> collect_steps(std::span<const BoardView> views, const std::optional<Lens>& lens,
                                double shift_px) {
  constexpr std::size_t nearest = 4;
  std::vector<Step> steps;
  for (const BoardView& view : views) {
    std::vector<TagDetection> tags;
    std::vector<double> widths_px;
    for (const auto* seen : {&view.detection.tags, &view.detection.foreign_tags}) {
      for (const TagDetection& tag : *seen) {
        const auto straight = undistort_tag(tag, lens);
        if (!straight) continue;
        tags.push_back(*straight);
        widths_px.push_back(compute_mean_edge_px(tag));
      }
    }
    for (std::size_t i = 0; i < tags.size(); ++i) {
      const TagDetection& tag = tags[i];
      const std::array<PlanePair, 4> square{{{tag.corners_px[0], {-0.5, 0.5}},
                                             {tag.corners_px[1], {0.5, 0.5}},
                                             {tag.corners_px[2], {0.5, -0.5}},
                                             {tag.corners_px[3], {-0.5, -0.5}}}};
      const Eigen::Matrix3d tags_from_image = estimate_homography(square);
      std::vector<Step> around;
      for (const TagDetection& other : tags) {
        if (other.id == tag.id) continue;
        Eigen::Vector2d middle = Eigen::Vector2d::Zero();
        for (const auto& corner : other.corners_px) {
          middle += (tags_from_image * corner.homogeneous()).hnormalized() / 4;
        }
        const double width_px = widths_px[i] + 2 * shift_px;
        around.push_back({tag.id, other.id, middle * (widths_px[i] / width_px), width_px});
      }
      std::sort(around.begin(), around.end(), [](const Step& a, const Step& b) {
        return a.displacement.norm() < b.displacement.norm();
      });
      around.resize(std::min(around.size(), nearest));
      steps.insert(steps.end(), around.begin(), around.end());
    }
  }
  return steps;
}

/// Agreement of steps with a layout.
struct LayoutFit {
  /// Numbers of steps between tags of the layout: all, and those that agree with the layout.
  std::size_t num_counted = 0, num_agreeing = 0;
  std::optional<double> pitch;
  /// Line fitted to the distances between tags, px, over the widths of the tags:
  ///   distance = pitch (width + 2 shift_px),
  /// with edges displaced inwards by shift_px on either side. Tags of different widths separate
  /// pitch and displacement.
  struct Line {
    double pitch, pitch_sd, shift_px;
  };
  std::optional<Line> line;

  /// Returns the fraction of the counted steps that agree; 0 without steps.
  double fraction() const {
    return num_counted == 0 ? 0
                            : static_cast<double>(num_agreeing) / static_cast<double>(num_counted);
  }
};

std::optional<LayoutFit::Line> fit_pitch_line(
    const std::vector<Eigen::Vector2d>& widths_and_distances) {
  constexpr std::size_t minimum = 20;
  const auto count = static_cast<double>(widths_and_distances.size());
  if (widths_and_distances.size() < minimum) return {};
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const auto& each : widths_and_distances) mean += each / count;
  Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();
  for (const auto& each : widths_and_distances)
    moments += (each - mean) * (each - mean).transpose();
  if (!(moments(0, 0) > 0)) return {};
  const double slope = moments(0, 1) / moments(0, 0);
  const double residual = std::max(0.0, moments(1, 1) - slope * moments(0, 1));
  return LayoutFit::Line{slope, std::sqrt(residual / (count - 2) / moments(0, 0)),
                         (mean.y() / slope - mean.x()) / 2};
}

LayoutFit fit_board_layout(const Board& board, const std::vector<Step>& steps) {
  constexpr double straight = 0.25;       // off the way, of its length
  std::map<int, Eigen::Vector2d> places;  // in pitches
  for (const BoardTag& tag : list_board_tags(board)) {
    places[tag.id] = tag.corners_m[3] / compute_tag_pitch_m(board);
  }
  std::vector<double> pitches;
  std::vector<Eigen::Vector2d> widths_and_distances;
  std::size_t num_counted = 0;
  for (const Step& step : steps) {
    const auto from = places.find(step.from), to = places.find(step.to);
    if (from == places.end() || to == places.end()) continue;
    ++num_counted;
    const Eigen::Vector2d expected = to->second - from->second;
    const double pitch = step.displacement.dot(expected) / expected.squaredNorm();
    if (expected.norm() < 2.1 &&
        (step.displacement - pitch * expected).norm() < straight * step.displacement.norm() &&
        pitch > 0) {
      pitches.push_back(pitch);
      widths_and_distances.emplace_back(step.width_px, pitch * step.width_px);
    }
  }
  LayoutFit fit;
  if (pitches.empty()) return fit;
  fit.num_counted = num_counted;
  fit.num_agreeing = pitches.size();
  const auto middle = pitches.begin() + static_cast<std::ptrdiff_t>(pitches.size() / 2);
  std::nth_element(pitches.begin(), middle, pitches.end());
  fit.pitch = *middle;
  std::erase_if(widths_and_distances, [&](const Eigen::Vector2d& each) {
    constexpr double max_deviation = 0.15;
    return std::abs(each.y() / each.x() / *fit.pitch - 1) > max_deviation;
  });
  fit.line = fit_pitch_line(widths_and_distances);
  return fit;
}

/// Returns the increment of the id from a tag to the tag right of it (axis 0) or below it (axis 1),
/// by a majority of the neighbors; 0 without a majority.
int estimate_id_increment(int axis, const std::vector<Step>& steps) {
  constexpr double aside = 0.35, limit = 0.5;
  constexpr int min_votes = 4;
  // The adjacent tags are the shortest steps along the axis, from each tag.
  std::map<int, int> votes;
  int all = 0;
  for (std::size_t i = 0; i < steps.size();) {
    std::size_t end = i;
    while (end < steps.size() && steps[end].from == steps[i].from &&
           (end == i || steps[end].displacement.norm() >= steps[end - 1].displacement.norm())) {
      ++end;
    }
    for (const double sign : {1.0, -1.0}) {
      for (std::size_t k = i; k < end; ++k) {
        const double along = sign * steps[k].displacement[axis];
        if (along < 0 || std::abs(steps[k].displacement[1 - axis]) > aside * along) continue;
        ++votes[static_cast<int>(sign) * (steps[k].to - steps[k].from)];
        ++all;
        break;  // nearest first
      }
    }
    i = end;
  }
  for (const auto& [increment, count] : votes) {
    if (count >= min_votes && count > limit * all) return increment;
  }
  return 0;
}

/// Returns the layout that explains the steps; std::nullopt if none does. Ids that increase by one
/// along rows increase by the number of columns from row to row, and vice versa.
std::optional<Board> find_layout(Board board, const std::vector<Step>& steps) {
  constexpr double min_fraction = 0.8;
  constexpr int max_tags = 1000;
  const int right = estimate_id_increment(0, steps), down = estimate_id_increment(1, steps);
  const bool column_major = std::abs(down) == 1 && std::abs(right) != 1;
  const int line = std::abs(column_major ? right : down);  // tags in a row, or in a column
  if (std::abs(column_major ? down : right) != 1 || line < 1 || line > max_tags) return {};
  board.id_order = {column_major,
                    right > 0 ? (down > 0 ? BoardCorner::top_left : BoardCorner::bottom_left)
                              : (down > 0 ? BoardCorner::top_right : BoardCorner::bottom_right)};
  // Counts tags that lie on a line of ids with a neighbor; other tags belong to the surroundings.
  std::map<int, int> votes;
  for (const Step& step : steps) {
    if (std::abs(step.to - step.from) == 1 || std::abs(step.to - step.from) == line) {
      ++votes[step.from];
    }
  }
  std::erase_if(votes, [](const auto& vote) { return vote.second < 2; });
  if (votes.empty()) return {};
  const int minimum = votes.begin()->first, largest = votes.rbegin()->first;
  const int stated = column_major ? board.cols : board.rows;
  std::optional<Board> best;
  double best_fraction = 0;
  // No step crosses the position at which a line of ids begins.
  const auto try_first = [&](int first) {
    if (first < 0) return;
    Board candidate = board;
    candidate.first_id = first;
    const int lines = (largest - first) / line + 1;
    (column_major ? candidate.rows : candidate.cols) = line;
    (column_major ? candidate.cols : candidate.rows) =
        line == (column_major ? board.rows : board.cols) && first == board.first_id
            ? std::max(lines, stated)
            : lines;
    if (candidate.cols > max_tags || candidate.rows > max_tags) return;
    const double fraction = fit_board_layout(candidate, steps).fraction();
    if (fraction < min_fraction || fraction <= best_fraction) return;
    best = candidate;
    best_fraction = fraction;
  };
  if (board.first_id <= minimum) try_first(board.first_id);
  for (int first = minimum; best_fraction < 1 && first > minimum - line; --first) try_first(first);
  return best;
}

std::string describe_layout_problem(const Board& board, const std::vector<Step>& steps) {
  constexpr double min_fraction = 0.8;
  std::vector<Step> known;
  const int last_id = board.first_id + board.cols * board.rows - 1;
  const auto has = [&](int id) { return id >= board.first_id && id <= last_id; };
  std::copy_if(steps.begin(), steps.end(), std::back_inserter(known),
               [&](const Step& step) { return has(step.from) && has(step.to); });
  const bool fits = known.empty() || fit_board_layout(board, known).fraction() >= min_fraction;
  const auto found = find_layout(board, steps);
  if (fits && !known.empty()) {
    // Unknown tags may belong to another board next to this one, unless they continue its layout.
    std::vector<Step> across;
    std::copy_if(steps.begin(), steps.end(), std::back_inserter(across),
                 [&](const Step& step) { return has(step.from) != has(step.to); });
    constexpr std::size_t few = 10;
    if (!found || across.size() < few ||
        fit_board_layout(*found, across).num_counted < across.size() ||
        fit_board_layout(*found, across).fraction() < min_fraction) {
      return "";
    }
  }
  if (found && found->cols == board.cols && found->rows == board.rows &&
      found->first_id == board.first_id && found->id_order.from == board.id_order.from &&
      found->id_order.column_major == board.id_order.column_major) {
    return "";
  }
  if (found) {
    std::string text = "the images show cols " + std::to_string(found->cols);
    text.append(", rows ").append(std::to_string(found->rows));
    text.append(", id_order ").append(id_order_name(found->id_order));
    if (found->first_id != board.first_id) {
      text.append(", first_id ").append(std::to_string(found->first_id));
    }
    return text;
  }
  if (fits) return "";
  // [LENS-3] `not lie as on a board`
  return "the tags in the images do not lie as on a board of " + std::to_string(board.cols) +
         " x " + std::to_string(board.rows) + " tags from id " + std::to_string(board.first_id) +
         " in any id_order; is it another board?";
}

/// Returns true if the pitch agrees with `expected` from board.yaml, directly or with edges
/// displaced by tone curves, overexposure and blur.
bool is_pitch_consistent(const LayoutFit& fit, double expected, double tolerance) {
  constexpr double sigmas = 3;
  if (std::abs(*fit.pitch / expected - 1) <= tolerance) return true;
  return fit.line && std::abs(fit.line->shift_px) <= kMaxShift_px &&
         std::abs(fit.line->pitch / expected - 1) <=
             tolerance + sigmas * fit.line->pitch_sd / expected &&
         sigmas * fit.line->pitch_sd / expected <= tolerance;
}

std::string describe_charuco(const Board& board) {
  return "the images show cols " + std::to_string(board.cols) + ", rows " +
         std::to_string(board.rows) + ", top_left " + (board.top_left_white ? "white" : "black");
}

/// Describes a ChArUco board with another number of squares, or another color of the first square,
/// that explains the steps better than `board`; empty if `board` agrees.
std::string describe_charuco_problem(const Board& board, const std::vector<Step>& steps) {
  constexpr double min_fraction = 0.8;
  constexpr int minimum = 4, limit = 60;
  const LayoutFit stated = fit_board_layout(board, steps);
  // Unknown markers may belong to another board next to this one.
  if (stated.fraction() >= min_fraction && 2 * stated.num_counted > steps.size()) {
    // With an odd number of columns, most steps also agree with the wrong color.
    Board opposite = board;
    opposite.top_left_white = !board.top_left_white;
    const bool is_stated_better =
        fit_board_layout(opposite, steps).num_agreeing <= stated.num_agreeing;
    return is_stated_better ? "" : describe_charuco(opposite);
  }
  int largest = 0;
  for (const Step& step : steps) largest = std::max({largest, step.from, step.to});
  std::optional<Board> best;
  double best_fraction = 0;
  for (const bool white : {board.top_left_white, !board.top_left_white}) {
    for (int cols = minimum; cols <= limit; ++cols) {
      Board candidate = board;
      candidate.cols = cols;
      candidate.top_left_white = white;
      // The number of rows that the markers need, or that of board.yaml if it is larger.
      const int markers = largest - board.first_id + 1;
      const int squares = 2 * markers - (white ? 1 : 0);
      candidate.rows = std::max(minimum, (squares + cols - 1) / cols);
      if (candidate.rows > limit) continue;
      if (cols == board.cols) candidate.rows = std::max(candidate.rows, board.rows);
      const double fraction = static_cast<double>(fit_board_layout(candidate, steps).num_agreeing) /
                              static_cast<double>(steps.size());
      if (fraction < min_fraction || fraction <= best_fraction) continue;
      best_fraction = fraction;
      best = candidate;
    }
  }
  if (!best) {
    if (stated.fraction() >= min_fraction) return "";
    return "the markers in the images do not lie as on a ChArUco board of " +
           std::to_string(board.cols) + " x " + std::to_string(board.rows) + " squares from id " +
           std::to_string(board.first_id) + "; is it another board?";
  }
  return describe_charuco(*best);
}

BoardCheck check_charuco_layout(const Board& board, const std::vector<Step>& steps) {
  BoardCheck check{describe_charuco_problem(board, steps), fit_board_layout(board, steps).pitch};
  if (!check.problem.empty() || !check.pitch) return check;
  // The outlines of markers are accurate to one or two pixels.
  constexpr double tolerance = 0.15, hundreds = 100;
  const double stated = board.square_size_m / board.tag_size_m;
  if (std::abs(*check.pitch / stated - 1) <= tolerance) return check;
  check.problem = "a square is " + format_exact_number(std::round(hundreds * stated) / hundreds) +
                  " markers wide by board.yaml, but " +
                  format_exact_number(std::round(hundreds * *check.pitch) / hundreds) +
                  " in the images";
  return check;
}

}  // namespace

BoardCheck check_board_layout(const Board& board, std::span<const BoardView> views,
                              const std::optional<Lens>& lens, double shift_px) {
  // A larger displacement is caused by another spacing, not by a tone curve.
  const auto steps = collect_steps(views, lens, std::clamp(shift_px, -kMaxShift_px, kMaxShift_px));
  constexpr std::size_t min_steps = 10;
  if (steps.size() < min_steps) return {};
  if (board.has_squares()) return check_charuco_layout(board, steps);
  BoardCheck check{describe_layout_problem(board, steps), {}};
  const LayoutFit fit = fit_board_layout(board, steps);
  check.pitch = fit.pitch;
  if (!check.problem.empty() || !fit.pitch) return check;
  const double tolerance = lens ? 0.01 : 0.05;
  if (!is_pitch_consistent(fit, 1 + board.tag_spacing, tolerance)) {
    const double hundreds = 100;
    const double seen = std::round((*fit.pitch - 1) * hundreds) / hundreds;
    // [LENS-4] `images show gaps` | wrong `tag_spacing`; strong tone curve or overexposure; out of
    //   focus | measure it; expose less; focus
    check.problem = "tag_spacing is " + format_exact_number(board.tag_spacing) +
                    ", but the images show gaps of " + format_exact_number(seen) + " tags";
  }
  return check;
}

}  // namespace vlp
