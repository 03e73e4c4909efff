// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace vlp {

/// The corner where the ids of a board begin, the board seen as printed and upright.
enum class BoardCorner { bottom_left, bottom_right, top_left, top_right };

/// The order in which ids are counted over a board: along its rows or along its columns, from a
/// corner. In YAML: "row-major-from-bottom-left" (Kalibr), "column-major-from-top-left", ...
struct IdOrder {
  bool column_major;
  BoardCorner from;
};

/// The order as YAML names it.
std::string name_of(const IdOrder& order);

/// A printed board of AprilTags, flat and upright.
struct Board {
  /// AprilTag family, for example "tag36h11".
  std::string family;
  /// Tags along the board's width and height.
  int cols;
  int rows;
  /// Edge of a tag's black border.
  double tag_size_m;
  /// Gap between tags / tag size.
  double tag_spacing;
  /// 1, or 2 for Kalibr's boards.
  int border_bits;
  /// Black squares that touch the tags' corners (Kalibr's boards).
  bool corner_squares;
  int first_id;
  IdOrder id_order;
};

/// Reads `vlp-board/1`, of which every field above is a key of the same name, or the YAML file that
/// Kalibr describes its AprilGrid by (target_type, tagCols, tagRows, tagSize in m, tagSpacing,
/// codeOffset). Throws InputError.
Board read_board(const std::filesystem::path& file);

/// Writes what read_board() reads, whole or not at all. Throws InputError.
void write_board(const std::filesystem::path& file, const Board& board);

}  // namespace vlp
