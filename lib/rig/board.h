// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace vlp {

/// Corner of a board at which the ids begin, with the board as printed and upright.
enum class BoardCorner { bottom_left, bottom_right, top_left, top_right };

/// Order in which the tag ids count up on a board: along rows, or columns if `column_major`,
/// beginning at the corner `from`. In YAML: "row-major-from-bottom-left" (Kalibr),
/// "column-major-from-top-left", ...
struct IdOrder {
  bool column_major;
  BoardCorner from;
};

/// Returns the name of an order in YAML, for example "row-major-from-bottom-left".
std::string id_order_name(const IdOrder& order);

/// Pattern of a board: AprilTags in rows; black and white squares; squares with an ArUco marker in
/// each white square, as OpenCV's CharucoBoard. In YAML: "apriltags", "chessboard", "charuco".
enum class BoardKind { apriltags, chessboard, charuco };

/// Minimum number of squares, and maximum number of squares or tags, along each side of a board.
/// The time of a lens calibration increases with all corners of the board, not only visible ones.
inline constexpr int kMinSquaresPerSide = 4, kMaxTagsPerSide = 50;

/// Printed calibration board: its pattern and dimensions, seen flat and upright. Boards of squares
/// use square_size_m instead of tag_spacing, border_bits and corner_squares.
struct Board {
  /// AprilTag family, for example "tag36h11". ChArUco boards: OpenCV's dictionary, for example
  /// "DICT_5X5_100".
  std::string family;
  /// Number of tags, or of squares, along the board's width and height.
  int cols;
  int rows;
  /// Edge length of a tag's square with its black border, or of a ChArUco board's marker.
  double tag_size_m;
  /// Ratio of the gap between neighboring tags to tag_size_m.
  double tag_spacing;
  /// Width of a tag's black border, in bits: 1, or 2 for the boards of Kalibr.
  int border_bits;
  /// True if black squares touch the corners of the tags (Kalibr's boards).
  bool corner_squares;
  /// Smallest tag id of the board; the others follow without gaps.
  int first_id;
  IdOrder id_order;
  BoardKind kind = BoardKind::apriltags;
  /// Boards of squares: edge length of a square.
  double square_size_m = 0;
  /// ChArUco boards: true if the top left square is white, as on boards with an even number of rows
  /// by OpenCV before version 4.6 ("legacy pattern"). Ids follow the rows of white squares from the
  /// top left.
  bool top_left_white = false;
  /// Relative standard deviation of printed lengths, independent along width and height; 0 if
  /// unknown.
  double print_sd = 0;

  bool has_squares() const { return kind != BoardKind::apriltags; }
};

/// Reads a board from `vlp-board/1` or from a target file of Kalibr, basalt or yac.
///
/// Keys of `vlp-board/1`:
///   apriltags   the fields up to id_order, by name
///   chessboard  kind, cols, rows, square_size_m
///   charuco     as chessboard, with marker_size_m, dictionary, first_id? (0), top_left? (black, or
///               white)
///   all         print_sd?
/// Keys of Kalibr's targets:
///   AprilGrid     target_type? (aprilgrid; basalt's JSON has none), tagCols, tagRows, tagSize in
///   m,
///                 tagSpacing, codeOffset?
///   checkerboard  target_type, targetCols, targetRows (of corners), rowSpacingMeters,
///                 colSpacingMeters
/// Keys of yac's targets, at the top, or in calib_target or calibration_target of a calibration
/// file of yac, whose other keys are ignored:
///   AprilGrid     target_type, tag_cols, tag_rows, tag_size in m, tag_spacing
/// @throws InputError if the file cannot be read or is invalid, or if the family has fewer tags
Board read_board(const std::filesystem::path& file);

/// Writes a file for read_board(), atomically. Throws InputError if it cannot be written.
void write_board(const std::filesystem::path& file, const Board& board);

}  // namespace vlp
