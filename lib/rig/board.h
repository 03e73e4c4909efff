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

/// What is printed: AprilTags in rows; black and white squares; the same with an ArUco marker in
/// each white square, as OpenCV's CharucoBoard has it. In YAML: "apriltags", "chessboard",
/// "charuco".
enum class BoardKind { apriltags, chessboard, charuco };

/// A printed board, flat and upright.
struct Board {
  /// AprilTag family, for example "tag36h11"; of a ChArUco board OpenCV's dictionary, for example
  /// "DICT_5X5_100".
  std::string family;
  /// Tags along the board's width and height; of the other kinds squares.
  int cols;
  int rows;
  /// Edge of a tag's black border, or of a ChArUco board's marker.
  double tag_size_m;
  /// Gap between tags / tag size.
  double tag_spacing;
  /// 1, or 2 for Kalibr's boards.
  int border_bits;
  /// Black squares that touch the tags' corners (Kalibr's boards).
  bool corner_squares;
  int first_id;
  IdOrder id_order;
  BoardKind kind = BoardKind::apriltags;
  /// Of boards of squares: their edge.
  double square_size_m = 0;
  /// Of ChArUco boards: the top left square is white, as on boards of an even number of rows that
  /// OpenCV before version 4.6 drew ("legacy pattern"). Ids go along the rows of white squares,
  /// from the top left.
  bool top_left_white = false;
  /// Relative standard deviation of printed lengths, independent along the board's width and its
  /// height; 0 if it is not stated.
  double print_sd = 0;

  bool has_squares() const { return kind != BoardKind::apriltags; }
};

/// Reads `vlp-board/1`: of a board of AprilTags every field up to id_order is a key of the same
/// name, of a chessboard `kind`, `cols`, `rows` and `square_size_m`, of a ChArUco board these and
/// `marker_size_m`, `dictionary`, `first_id?` (0) and `top_left?` (black, or white); of all
/// `print_sd?`. Or the YAML
/// file that Kalibr describes a target by: an AprilGrid (target_type, tagCols, tagRows, tagSize in
/// m, tagSpacing, codeOffset), or a checkerboard (targetCols, targetRows: of corners;
/// rowSpacingMeters, colSpacingMeters). Throws InputError.
Board read_board(const std::filesystem::path& file);

/// Writes what read_board() reads, whole or not at all. Throws InputError.
void write_board(const std::filesystem::path& file, const Board& board);

}  // namespace vlp
