// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/board.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "rig/file.h"
#include "rig/yaml_parts.h"
#include "rig/yaml_writer.h"

namespace vlp {
namespace {

constexpr const char* kBoardFormat = "vlp-board/1";
constexpr std::array kFamilies{"tag36h11",         "tag25h9",         "tag16h5",
                               "tagCircle21h7",    "tagCircle49h12",  "tagCustom48h12",
                               "tagStandard41h12", "tagStandard52h13"};
// Number of tags of each family in libapriltag.
constexpr std::array kFamilySizes{587, 35, 30, 38, 65535, 42211, 2115, 48714};
// In the order of BoardCorner.
constexpr std::array kCorners{"bottom-left", "bottom-right", "top-left", "top-right"};

// In the order of BoardKind.
constexpr std::array kKinds{"apriltags", "chessboard", "charuco"};

constexpr int kMaxId = 1'000'000;  // families have fewer
constexpr double kMinTag_m = 1e-4, kMaxTag_m = 2;
constexpr double kMaxPrintSd = 0.02;  // check_board_layout() detects larger errors

/// Returns the index of a word among `names`. For other words, the message lists the names after
/// `introduction`.
std::size_t find_word(const YamlValue& value, const auto& names, const std::string& introduction) {
  std::string list;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (value.read_text() == names[i]) return i;
    list += (i == 0 ? "" : ", ") + std::string(names[i]);
  }
  throw value.make_unknown_word_error(introduction + list);
}

IdOrder read_id_order(const YamlValue& value) {
  std::vector<IdOrder> orders;
  std::vector<std::string> names;
  for (const bool column_major : {false, true}) {
    for (std::size_t corner = 0; corner < kCorners.size(); ++corner) {
      orders.push_back({column_major, static_cast<BoardCorner>(corner)});
      names.push_back(id_order_name(orders.back()));
    }
  }
  return orders[find_word(value, names, "the orders are: ")];
}

/// Returns a board of squares without tags.
Board make_board_of_squares(BoardKind kind) {
  Board board{"", 0, 0, 0, 1, 1, false, 0, {false, BoardCorner::top_left}};
  board.kind = kind;
  return board;
}

Board read_squares(YamlMap& map, BoardKind kind) {
  Board board = make_board_of_squares(kind);
  board.cols = map.require("cols").read_integer({kMinSquaresPerSide, kMaxTagsPerSide});
  board.rows = map.require("rows").read_integer({kMinSquaresPerSide, kMaxTagsPerSide});
  board.square_size_m = map.require("square_size_m").read_number({kMinTag_m, kMaxTag_m, "m"});
  if (kind == BoardKind::chessboard) return board;
  const YamlValue marker = map.require("marker_size_m");
  board.tag_size_m = marker.read_number({kMinTag_m, kMaxTag_m, "m"});
  if (!(board.tag_size_m < board.square_size_m)) {
    throw marker.make_error("a marker is smaller than the square around it");
  }
  const YamlValue dictionary = map.require("dictionary");
  board.family = dictionary.read_text();
  if (!board.family.starts_with("DICT_")) {
    throw dictionary.make_error("should be one of OpenCV's dictionaries, such as DICT_5X5_100");
  }
  if (const auto first = map.find("first_id")) {
    board.first_id = first->read_integer({0, kMaxId});
  }
  if (const auto top_left = map.find("top_left")) {
    board.top_left_white = top_left->read_text() == "white";
    if (!board.top_left_white && top_left->read_text() != "black") {
      throw top_left->make_unknown_word_error("the colors of a square are: black, white");
    }
  }
  return board;
}

/// Reads Kalibr's checkerboard, which counts corners.
Board read_kalibr_checkerboard(YamlMap& map) {
  Board board = make_board_of_squares(BoardKind::chessboard);
  board.cols =
      map.require("targetCols").read_integer({kMinSquaresPerSide - 1, kMaxTagsPerSide - 1}) + 1;
  board.rows =
      map.require("targetRows").read_integer({kMinSquaresPerSide - 1, kMaxTagsPerSide - 1}) + 1;
  const YamlValue height = map.require("rowSpacingMeters");
  board.square_size_m = map.require("colSpacingMeters").read_number({kMinTag_m, kMaxTag_m, "m"});
  constexpr double rounding = 1e-9;
  if (std::abs(height.read_number({kMinTag_m, kMaxTag_m, "m"}) - board.square_size_m) > rounding) {
    throw height.make_error("is not colSpacingMeters: the lens is found from squares");
  }
  return board;
}

/// Throws InputError at the number of rows if the family has fewer tags than the board.
void check_family_has_tags(const Board& board, const YamlValue& rows) {
  const auto family = std::ranges::find(kFamilies, board.family) - kFamilies.begin();
  const int size = kFamilySizes[static_cast<std::size_t>(family)];
  const int tags = board.cols * board.rows;
  if (board.first_id <= size - tags) return;
  throw rows.make_error("a board of " + std::to_string(tags) + " tags from id " +
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
Board read_grid_target(YamlMap& map) {
  if (const auto kind = map.find("target_type")) {
    if (kind->read_text() == "checkerboard") return read_kalibr_checkerboard(map);
    if (kind->read_text() != "aprilgrid") {
      throw kind->make_error("should be aprilgrid or checkerboard; from others no lens is found");
    }
  }
  const GridKeys& keys = map.has(kYacKeys.cols) ? kYacKeys : kKalibrKeys;
  Board board{"tag36h11", 0, 0, 0, 0, 2, true, 0, {false, BoardCorner::bottom_left}};
  board.cols = map.require(keys.cols).read_integer({1, kMaxTagsPerSide});
  const YamlValue rows = map.require(keys.rows);
  board.rows = rows.read_integer({1, kMaxTagsPerSide});
  board.tag_size_m = map.require(keys.size).read_number({kMinTag_m, kMaxTag_m, "m"});
  board.tag_spacing = map.require(keys.spacing).read_number({0.01, 10, "(gap / tag)"});
  if (const auto first = map.find("codeOffset")) {
    board.first_id = first->read_integer({0, kMaxId});
  }
  check_family_has_tags(board, rows);
  return board;
}

}  // namespace

std::string id_order_name(const IdOrder& order) {
  return std::string(order.column_major ? "column" : "row") + "-major-from-" +
         kCorners[static_cast<std::size_t>(order.from)];
}

Board read_board_from_yaml(YamlMap& map) {
  const auto named = map.find("kind");
  const BoardKind kind =
      named ? static_cast<BoardKind>(find_word(*named, kKinds, "the kinds of boards are: "))
            : BoardKind::apriltags;
  if (kind != BoardKind::apriltags) return read_squares(map, kind);
  Board board;
  board.family = kFamilies[find_word(map.require("family"), kFamilies, "the families are: ")];
  board.cols = map.require("cols").read_integer({1, kMaxTagsPerSide});
  const YamlValue rows = map.require("rows");
  board.rows = rows.read_integer({1, kMaxTagsPerSide});
  board.tag_size_m = map.require("tag_size_m").read_number({kMinTag_m, kMaxTag_m, "m"});
  board.tag_spacing = map.require("tag_spacing").read_number({0.01, 10, "(gap / tag)"});
  board.border_bits = map.require("border_bits").read_integer({1, 2});
  board.corner_squares = map.require("corner_squares").read_boolean();
  board.first_id = map.require("first_id").read_integer({0, kMaxId});
  board.id_order = read_id_order(map.require("id_order"));
  check_family_has_tags(board, rows);
  return board;
}

Board read_board(const std::filesystem::path& file) {
  YamlMap document = read_yaml_file(file);
  for (const char* const key : {"calib_target", "calibration_target"}) {
    if (const auto target = document.find(key)) return target->convert_mapping(read_grid_target);
  }
  const bool grid = document.has("target_type") || document.has(kKalibrKeys.cols);
  if (!grid) check_yaml_format(document, kBoardFormat);
  Board board = grid ? read_grid_target(document) : read_board_from_yaml(document);
  if (const auto print_sd = grid ? std::nullopt : document.find("print_sd")) {
    board.print_sd = print_sd->read_number({0, kMaxPrintSd, "(relative)"});
  }
  document.check_all_keys_read();
  return board;
}

void write_board(const std::filesystem::path& file, const Board& board) {
  YAML::Emitter out;
  out << YAML::BeginMap;
  emit_yaml_plain_word(out, "format", kBoardFormat);
  if (board.has_chessboard_squares()) {
    emit_yaml_plain_word(out, "kind", kKinds[static_cast<std::size_t>(board.kind)]);
  } else {
    emit_yaml_plain_word(out, "family", board.family);
  }
  emit_yaml_integer(out, "cols", board.cols);
  emit_yaml_integer(out, "rows", board.rows);
  if (board.has_chessboard_squares()) {
    emit_yaml_number(out, "square_size_m", board.square_size_m);
  } else {
    emit_yaml_number(out, "tag_size_m", board.tag_size_m);
    emit_yaml_number(out, "tag_spacing", board.tag_spacing);
    emit_yaml_integer(out, "border_bits", board.border_bits);
    emit_yaml_plain_word(out, "corner_squares", board.corner_squares ? "true" : "false");
    emit_yaml_integer(out, "first_id", board.first_id);
    emit_yaml_plain_word(out, "id_order", id_order_name(board.id_order));
  }
  if (board.kind == BoardKind::charuco) {
    emit_yaml_number(out, "marker_size_m", board.tag_size_m);
    emit_yaml_plain_word(out, "dictionary", board.family);
    emit_yaml_integer(out, "first_id", board.first_id);
    emit_yaml_plain_word(out, "top_left", board.top_left_white ? "white" : "black");
  }
  if (board.print_sd > 0) emit_yaml_number(out, "print_sd", board.print_sd);
  out << YAML::EndMap << YAML::Newline;
  write_file(file, out.c_str());
}

}  // namespace vlp
