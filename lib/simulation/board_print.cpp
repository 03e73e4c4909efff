// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0

#include "simulation/board_print.h"

#include <apriltag/apriltag.h>
#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "detection/boards/tag_finder.h"
#include "detection/boards/tag_pattern.h"
#include "rig/board_layout.h"

namespace vlp {
namespace {

/// Converts the id to the type of libapriltag: int, since version 3.4 unsigned.
template <typename Id>
image_u8_t* render_tag(image_u8_t* (*draw)(apriltag_family_t*, Id), apriltag_family_t* family,
                       int id) {
  return draw(family, static_cast<Id>(id));
}

void add_corner_squares(const Board& board, const InkRadiances& ink, std::vector<Rectangle>& all) {
  const double gap_m = board.tag_size_m * board.tag_spacing;
  for (int row = 0; row <= board.rows; ++row) {
    for (int col = 0; col <= board.cols; ++col) {
      const double right_m = col * compute_tag_pitch_m(board),
                   bottom_m = row * compute_tag_pitch_m(board);
      all.push_back({right_m - gap_m, bottom_m - gap_m, right_m, bottom_m, ink.black});
    }
  }
}

void add_squares(const Board& board, const InkRadiances& ink, std::vector<Rectangle>& all) {
  const double size_m = board.square_size_m;
  for (int row = 0; row < board.rows; ++row) {
    for (int col = 0; col < board.cols; ++col) {
      if (!is_square_black(board, col, row)) continue;
      const double left_m = (col - 1) * size_m, top_m = (row - 1) * size_m;
      all.push_back({left_m, top_m, left_m + size_m, top_m + size_m, ink.black});
    }
  }
}

TagPattern make_tag_bits(const Board& board, int id) {
  if (!board.has_squares()) return make_tag_pattern(board.family, id, board.border_bits);
  const ArucoMarker marker = make_aruco_marker(board.family, id);
  TagPattern pattern{marker.width + 2, 0, {}};
  pattern.white.assign(pattern.flat_bit_index(0, pattern.pattern_width_bits()), false);
  for (int row = 0; row < marker.width; ++row) {
    for (int col = 0; col < marker.width; ++col) {
      pattern.white[pattern.flat_bit_index(col + 1, row + 1)] =
          marker.white[static_cast<std::size_t>(row * marker.width + col)];
    }
  }
  return pattern;
}

void add_tag(const Board& board, const BoardTag& tag, const InkRadiances& ink,
             std::vector<Rectangle>& all) {
  const TagPattern pattern = make_tag_bits(board, tag.id);
  const double bit_m = board.tag_size_m / pattern.border_width;
  if (2 * pattern.outside * bit_m > board.tag_size_m * board.tag_spacing) {
    throw std::invalid_argument("the gap between the tags is too small for " + board.family);
  }
  const Eigen::Vector2d corner_m =
      tag.corners_m[3] - Eigen::Vector2d::Constant(pattern.outside * bit_m);
  for (int row = 0; row < pattern.pattern_width_bits(); ++row) {
    for (int col = 0; col < pattern.pattern_width_bits(); ++col) {
      const double left_m = corner_m.x() + col * bit_m, top_m = corner_m.y() + row * bit_m;
      const bool white = pattern.white[pattern.flat_bit_index(col, row)];
      all.push_back({left_m, top_m, left_m + bit_m, top_m + bit_m, white ? ink.white : ink.black});
    }
  }
}

/// Returns the printed rectangles with the paper below them, in printing order: later ones cover
/// earlier ones.
std::vector<Rectangle> make_rectangles(const SceneBoard& board) {
  const InkRadiances ink{board.white_e_per_s - board.surround_e_per_s,
                         board.black_e_per_s - board.surround_e_per_s};
  const double margin_m = board.margin_m + compute_printed_margin_m(board.pattern);
  const Eigen::Vector2d field_m = compute_tag_field_size_m(board.pattern);
  std::vector<Rectangle> all = make_board_pattern(board.pattern, ink);
  all.insert(all.begin(),
             {-margin_m, -margin_m, field_m.x() + margin_m, field_m.y() + margin_m, ink.white});
  return all;
}

}  // namespace

TagPattern make_tag_pattern(const std::string& name, int id, int border_bits) {
  const TagFamily codes = make_tag_family(name);
  if (id < 0 || static_cast<uint32_t>(id) >= codes->ncodes) {
    throw std::invalid_argument(name + " has no tag " + std::to_string(id) + ", only 0 to " +
                                std::to_string(codes->ncodes - 1));
  }
  const bool plain = !codes->reversed_border && codes->total_width == codes->width_at_border + 2;
  if (border_bits == 2 && !plain) {
    throw std::invalid_argument("tags of " + name + " have no border of two black bits");
  }
  // For plain tags libapriltag also renders the white surroundings, which are paper here.
  const int extra = border_bits - 1;
  const int trimmed = plain ? 1 : 0;
  TagPattern pattern;
  pattern.border_width = codes->width_at_border + 2 * extra;
  pattern.outside = (codes->total_width - codes->width_at_border) / 2 - trimmed;
  const int width = pattern.pattern_width_bits();
  pattern.white.assign(pattern.flat_bit_index(0, width), false);
  const std::unique_ptr<image_u8_t, void (*)(image_u8_t*)> rendered(
      render_tag(apriltag_to_image, codes.get(), id), image_u8_destroy);
  for (int row = extra; row < width - extra; ++row) {
    for (int column = extra; column < width - extra; ++column) {
      const int y = row - extra + trimmed, x = column - extra + trimmed;
      pattern.white[pattern.flat_bit_index(column, row)] =
          rendered->buf[y * rendered->stride + x] > 127;
    }
  }
  return pattern;
}

std::vector<Rectangle> make_board_pattern(const Board& board, const InkRadiances& ink) {
  std::vector<Rectangle> all;
  if (board.has_squares()) add_squares(board, ink, all);
  if (board.corner_squares) add_corner_squares(board, ink, all);
  for (const BoardTag& tag : list_board_tags(board)) add_tag(board, tag, ink, all);
  return all;
}

double compute_printed_margin_m(const Board& board) {
  if (board.has_squares()) return board.square_size_m;
  return board.corner_squares ? board.tag_size_m * board.tag_spacing : 0;
}

BoardWarp::BoardWarp(const SceneBoard& board)
    : inverse_half_field_per_m_(2 / compute_tag_field_size_m(board.pattern).array()),
      warp_m_(board.warp_m) {}

BoardWarp::Depth BoardWarp::compute_deflection(const Eigen::Vector2d& at_m) const {
  Depth warp{0, {0, 0}};
  for (Eigen::Index axis = 0; axis < 2; ++axis) {
    const double fraction = at_m[axis] * inverse_half_field_per_m_[axis] - 1;
    const double inside = std::clamp(fraction, -kMaxOffset, kMaxOffset);
    warp.depth_m += warp_m_[axis] * (1 - inside * inside);
    if (fraction == inside)
      warp.slope[axis] = -2 * warp_m_[axis] * inside * inverse_half_field_per_m_[axis];
  }
  return warp;
}

BoardPattern::BoardPattern(const SceneBoard& board)
    : warp_(board), mosaic_(make_rectangles(board)) {}

std::optional<Eigen::Vector2d> BoardWarp::intersect_parabola(
    const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
  // With u = o + d t in half fields: z = warp (1 - u^2) at the distance t is a t^2 + b t + c = 0.
  const Eigen::Array2d o = origin.head<2>().array() * inverse_half_field_per_m_ - 1,
                       d = direction.head<2>().array() * inverse_half_field_per_m_;
  const Eigen::Array2d warp_m = warp_m_.array();
  const double a = (warp_m * d.square()).sum(), b = direction.z() + 2 * (warp_m * o * d).sum(),
               c = origin.z() - (warp_m * (1 - o.square())).sum();
  const double discriminant = b * b - 4 * a * c;
  if (!(discriminant >= 0)) return std::nullopt;
  const double distance = -2 * c / (b + std::copysign(std::sqrt(discriminant), b));
  const Eigen::Array2d fraction = o + distance * d;
  if (!(distance > 0 && (fraction.abs() <= kMaxOffset).all())) return std::nullopt;
  return origin.head<2>() + distance * direction.head<2>();
}

Eigen::Vector2d BoardPattern::intersect(const Eigen::Vector3d& origin,
                                        const Eigen::Vector3d& direction) const {
  if (warp_.is_board_flat()) return intersect_plane(origin, direction);
  if (const auto met_m = warp_.intersect_parabola(origin, direction)) return *met_m;
  // Beside the paper: Newton's method along the ray; converges in two or three steps.
  Eigen::Vector2d at_m = intersect_plane(origin, direction);
  constexpr double tolerance_m = 1e-9;
  double distance = -origin.z() / direction.z();
  for (int step = 0; step < 8; ++step) {
    const auto [depth_m, slope] = warp_.compute_deflection(at_m);
    const double missed_m = origin.z() + distance * direction.z() - depth_m;
    if (!(std::abs(missed_m) > tolerance_m)) break;
    distance -= missed_m / (direction.z() - slope.dot(direction.head<2>()));
    at_m = origin.head<2>() + distance * direction.head<2>();
  }
  return at_m;
}

}  // namespace vlp
