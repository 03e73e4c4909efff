// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/board.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <vector>

#include "rig/file.h"
#include "rig/yaml_documents.h"
#include "rig/yaml_parts.h"
#include "rig/yaml_writer.h"

namespace vlp {
namespace {

constexpr const char* kBoardFormat = "vlp-board/1";
constexpr std::array<std::string_view, 8> kFamilies{
    "tag36h11",       "tag25h9",        "tag16h5",          "tagCircle21h7",
    "tagCircle49h12", "tagCustom48h12", "tagStandard41h12", "tagStandard52h13"};
// Number of tags of each family in libapriltag.
constexpr std::array kFamilySizes{587, 35, 30, 38, 65535, 42211, 2115, 48714};
// In the order of BoardCorner.
constexpr std::array kCorners{"bottom-left", "bottom-right", "top-left", "top-right"};
constexpr std::array<std::string_view, 3> kKinds{"apriltags", "chessboard", "charuco"};
constexpr std::array<std::string_view, 2> kSquareColors{"black", "white"};

constexpr Range kTagsPerSide{1, kMaxTagsPerSide};
constexpr Range kSquaresPerSide{kMinSquaresPerSide, kMaxTagsPerSide};
constexpr Range kTagId{0, 1'000'000};  // families have fewer tags
constexpr Range kTagSize{1e-4, 2, "m"};
constexpr Range kTagSpacing{0.01, 10, "(gap / tag)"};
constexpr Range kPrintSd{0, 0.02, "(relative)"};  // check_board_layout() detects larger errors

/// Returns a board of squares without tags.
Board make_board_of_squares(BoardKind kind) {
  Board board{"", 0, 0, 0, 1, 1, false, 0, {false, BoardCorner::top_left}};
  board.kind = kind;
  return board;
}

/// Reads Kalibr's checkerboard, which counts corners.
Board read_checkerboard(YamlMap& io) {
  Board board = make_board_of_squares(BoardKind::chessboard);
  constexpr Range corners_per_side{kMinSquaresPerSide - 1, kMaxTagsPerSide - 1};
  io.required("targetCols", board.cols, corners_per_side);
  io.required("targetRows", board.rows, corners_per_side);
  ++board.cols;
  ++board.rows;
  double height_m = 0;
  const YamlField height = io.required("rowSpacingMeters", height_m, kTagSize);
  io.required("colSpacingMeters", board.square_size_m, kTagSize);
  constexpr double rounding = 1e-9;
  height.check(std::abs(height_m - board.square_size_m) <= rounding,
               "is not colSpacingMeters: the lens is found from squares");
  return board;
}

/// Throws InputError at the number of rows if the family has fewer tags than the board.
void check_family_has_tags(const Board& board, const auto& rows) {
  const auto family = std::ranges::find(kFamilies, board.family) - kFamilies.begin();
  const int size = kFamilySizes[static_cast<std::size_t>(family)];
  const int tags = board.cols * board.rows;
  if (board.first_id <= size - tags) return;
  rows.check(false, "a board of " + std::to_string(tags) + " tags from id " +
                        std::to_string(board.first_id) + " needs more than the " +
                        std::to_string(size) + " tags of " + board.family +
                        "; correct cols, rows, or the first id");
}

/// Names of the keys of an AprilGrid in the files of a calibration tool.
struct GridKeys {
  const char *cols, *rows, *size, *spacing;
};
constexpr GridKeys kKalibrKeys{"tagCols", "tagRows", "tagSize", "tagSpacing"};
constexpr GridKeys kYacKeys{"tag_cols", "tag_rows", "tag_size", "tag_spacing"};

/// Reads a target of kind checkerboard of Kalibr, or aprilgrid of Kalibr, basalt or yac, as in
/// Kalibr's documentation: tag36h11 with a border of two bits and squares at the corners. Ids count
/// from codeOffset, or 0, along the rows from the bottom left.
void read_grid_target(YamlMap& io, Board& board) {
  std::string type = "aprilgrid";
  const YamlField target_type = io.optional("target_type", type);
  if (type == "checkerboard") {
    board = read_checkerboard(io);
    return;
  }
  target_type.check(type == "aprilgrid",
                    "should be aprilgrid or checkerboard; from others no lens is found");
  const GridKeys& keys = io.has(kYacKeys.cols) ? kYacKeys : kKalibrKeys;
  board = {"tag36h11", 0, 0, 0, 0, 2, true, 0, {false, BoardCorner::bottom_left}};
  io.required(keys.cols, board.cols, kTagsPerSide);
  const YamlField rows = io.required(keys.rows, board.rows, kTagsPerSide);
  io.required(keys.size, board.tag_size_m, kTagSize);
  io.required(keys.spacing, board.tag_spacing, kTagSpacing);
  io.optional("codeOffset", board.first_id, kTagId);
  check_family_has_tags(board, rows);
}

/// Board with the keys that only its own file has.
struct BoardFile {
  Board board;
};

}  // namespace

std::string id_order_name(const IdOrder& order) {
  return std::string(order.column_major ? "column" : "row") + "-major-from-" +
         kCorners[static_cast<std::size_t>(order.from)];
}

static void read_value(const YamlValue& value, IdOrder& order) {
  std::vector<std::string> names;
  for (const bool column_major : {false, true}) {
    for (std::size_t corner = 0; corner < kCorners.size(); ++corner)
      names.push_back(id_order_name({column_major, static_cast<BoardCorner>(corner)}));
  }
  const std::vector<std::string_view> views(names.begin(), names.end());
  const std::size_t index = value.read_word({views, "the orders are: "});
  order = {index >= kCorners.size(), static_cast<BoardCorner>(index % kCorners.size())};
}

static void write_value(YamlWriter& out, const IdOrder& order) { out << id_order_name(order); }

template <typename Io>
static void describe_tags(Io& io, Described<Io, Board> board) {
  io.required("family", board.family, Words{kFamilies, "the families are: "});
  io.required("cols", board.cols, kTagsPerSide);
  const auto rows = io.required("rows", board.rows, kTagsPerSide);
  io.required("tag_size_m", board.tag_size_m, kTagSize);
  io.required("tag_spacing", board.tag_spacing, kTagSpacing);
  io.required("border_bits", board.border_bits, Range{1, 2});
  io.required("corner_squares", board.corner_squares);
  io.required("first_id", board.first_id, kTagId);
  io.required("id_order", board.id_order);
  if constexpr (Io::is_reader) check_family_has_tags(board, rows);
}

template <typename Io>
static void describe_squares(Io& io, Described<Io, Board> board) {
  io.required("cols", board.cols, kSquaresPerSide);
  io.required("rows", board.rows, kSquaresPerSide);
  io.required("square_size_m", board.square_size_m, kTagSize);
  if (board.kind == BoardKind::chessboard) return;
  io.required("marker_size_m", board.tag_size_m, kTagSize)
      .check(board.tag_size_m < board.square_size_m,
             "a marker is smaller than the square around it");
  io.required("dictionary", board.family, PlainText())
      .check(board.family.starts_with("DICT_"),
             "should be one of OpenCV's dictionaries, such as DICT_5X5_100");
  io.optional_with_default("first_id", board.first_id, kTagId);
  io.optional_with_default("top_left", board.top_left_white,
                           Words{kSquareColors, "the colors of a square are: "});
}

template <typename Io>
void describe(Io& io, Described<Io, Board> board) {
  io.optional("kind", board.kind, Words{kKinds, "the kinds of boards are: "});
  if (!board.has_squares()) return describe_tags(io, board);
  if constexpr (Io::is_reader) board = make_board_of_squares(board.kind);
  describe_squares(io, board);
}

template void describe<YamlMap>(YamlMap& io, Board& board);

template <typename Io>
static void describe(Io& io, Described<Io, BoardFile> file) {
  describe(io, file.board);
  io.optional("print_sd", file.board.print_sd, kPrintSd);
}

Board read_board(const std::filesystem::path& file) {
  YamlMap document = read_yaml_file(file);
  BoardFile result{};
  for (const char* const key : {"calib_target", "calibration_target"}) {
    if (document.optional(key, result.board, read_grid_target)) return result.board;
  }
  if (document.has("target_type") || document.has(kKalibrKeys.cols)) {
    read_grid_target(document, result.board);
  } else {
    check_yaml_format(document, kBoardFormat);
    describe(document, result);
  }
  document.check_all_keys_read();
  return result.board;
}

std::string format_board(const Board& board) {
  return format_document(kBoardFormat, BoardFile{board});
}

void write_board(const std::filesystem::path& file, const Board& board) {
  write_file(file, format_board(board));
}

}  // namespace vlp
