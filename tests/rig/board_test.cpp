// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/board.h"

#include <gmock/gmock.h>

#include "rig/samples.h"

namespace vlp {
namespace {

using testing::HasSubstr;

std::string refusal_with(const std::string& from, const std::string& to) {
  const TemporaryFolder folder;
  return refusal(read_board, folder.file("board.yaml", changed(kBoardYaml, from, to)));
}

TEST(ReadBoard, ReadsEveryKey) {
  const TemporaryFolder folder;
  expect_same(read_board(folder.file("board.yaml", kBoardYaml)), sample_board());
}

TEST(WriteBoard, WritesExpectedYamlByteForByte) {
  const TemporaryFolder folder;
  write_board(folder / "board.yaml", sample_board());
  EXPECT_EQ(folder.read_content(folder / "board.yaml"), kBoardYaml);
}

TEST(WriteBoard, RoundTripsEachIdOrder) {
  const std::pair<std::string, IdOrder> orders[] = {
      {"row-major-from-bottom-left", {false, BoardCorner::bottom_left}},
      {"row-major-from-bottom-right", {false, BoardCorner::bottom_right}},
      {"row-major-from-top-left", {false, BoardCorner::top_left}},
      {"row-major-from-top-right", {false, BoardCorner::top_right}},
      {"column-major-from-bottom-left", {true, BoardCorner::bottom_left}},
      {"column-major-from-bottom-right", {true, BoardCorner::bottom_right}},
      {"column-major-from-top-left", {true, BoardCorner::top_left}},
      {"column-major-from-top-right", {true, BoardCorner::top_right}}};
  const TemporaryFolder folder;
  for (const auto& [name, order] : orders) {
    SCOPED_TRACE(name);
    const std::string text = changed(kBoardYaml, "column-major-from-top-left", name);
    Board board = sample_board();
    board.id_order = order;
    expect_same(read_board(folder.file("board.yaml", text)), board);
    write_board(folder / "written.yaml", board);
    EXPECT_EQ(folder.read_content(folder / "written.yaml"), text);
  }
}

constexpr const char* kKalibrTarget =
    "target_type: 'aprilgrid' #gridtype\n"
    "tagCols: 5               #number of apriltags\n"
    "tagRows: 4               #number of apriltags\n"
    "tagSize: 0.02            #size of apriltag, edge to edge [m]\n"
    "tagSpacing: 0.2          #ratio of space between tags to tagSize\n";

TEST(ReadBoard, ReadsBoardFromKalibrAprilGrid) {
  const TemporaryFolder folder;
  const Board board{"tag36h11", 5, 4, 0.02, 0.2, 2, true, 0, {false, BoardCorner::bottom_left}};
  expect_same(read_board(folder.file("target.yaml", kKalibrTarget)), board);
}

/// Ends as the files that Kalibr distributes.
TEST(ReadBoard, UsesKalibrCodeOffsetAsFirstId) {
  const TemporaryFolder folder;
  const auto with = [&](const std::string& offset) {
    return folder.file("target.yaml", kKalibrTarget + ("codeOffset: " + offset) +
                                          " #code offset for the first tag (default: 0)\n");
  };
  Board board{"tag36h11", 5, 4, 0.02, 0.2, 2, true, 0, {false, BoardCorner::bottom_left}};
  expect_same(read_board(with("0")), board);
  board.first_id = 100;
  expect_same(read_board(with("100")), board);
  EXPECT_THAT(refusal(read_board, with("-1")), HasSubstr("target.yaml:6: codeOffset: should be"));
  EXPECT_THAT(refusal(read_board, with("0.5")), HasSubstr("target.yaml:6: codeOffset: should be"));
}

constexpr const char* kYacTarget =
    "target_type: 'aprilgrid'  # Target type\n"
    "tag_rows: 4               # Number of rows\n"
    "tag_cols: 5               # Number of cols\n"
    "tag_size: 0.02            # Size of apriltag, edge to edge [m]\n"
    "tag_spacing: 0.2          # Ratio of space between tags to tagSize\n";

/// The same text with each line indented, below `key` of a calibration file.
std::string nested(const std::string& key, const std::string& target) {
  std::string text = "settings: {fix_intrinsics: true}\n" + key + ":\n  ";
  for (const char letter : target) text += letter == '\n' ? "\n  " : std::string(1, letter);
  return text + "\ncam0: {resolution: [640, 480]}\n";
}

TEST(ReadBoard, ReadsBoardFromYacTargetAndCalibrationFile) {
  const TemporaryFolder folder;
  const Board board{"tag36h11", 5, 4, 0.02, 0.2, 2, true, 0, {false, BoardCorner::bottom_left}};
  expect_same(read_board(folder.file("target.yaml", kYacTarget)), board);
  for (const char* key : {"calib_target", "calibration_target"})
    expect_same(read_board(folder.file("calib.yaml", nested(key, kYacTarget))), board);
}

TEST(ReadBoard, RejectsInvalidKeysAndValuesOfYacTarget) {
  const TemporaryFolder folder;
  const auto rejection_message = [&](const std::string& from, const std::string& to) {
    return refusal(read_board, folder.file("target.yaml", changed(kYacTarget, from, to)));
  };
  EXPECT_THAT(rejection_message("tag_size", "tagSize"), HasSubstr("key 'tag_size' is missing"));
  EXPECT_THAT(rejection_message("tag_rows: 4", "tag_rows: 51"),
              HasSubstr("target.yaml:2: tag_rows: should be a whole number within 1 and 50"));
  EXPECT_THAT(rejection_message("aprilgrid", "circlegrid"), HasSubstr("aprilgrid or checkerboard"));
  EXPECT_THAT(rejection_message("# Target type", "\nfamily: tag36h11"), HasSubstr("'family'"));
  const std::string wrong = changed(nested("calib_target", kYacTarget), "0.02", "20");
  EXPECT_THAT(refusal(read_board, folder.file("calib.yaml", wrong)),
              HasSubstr("calib.yaml:6: calib_target.tag_size: 20 m is not within"));
}

/// basalt's JSON has no target_type.
TEST(ReadBoard, ReadsBoardFromBasaltJson) {
  const TemporaryFolder folder;
  const Board board{"tag36h11", 5, 4, 0.02, 0.2, 2, true, 0, {false, BoardCorner::bottom_left}};
  expect_same(
      read_board(folder.file("aprilgrid.json",
                             "{\n    \"tagCols\": 5,\n    \"tagRows\": 4,\n    \"tagSize\": 0.02,\n"
                             "    \"tagSpacing\": 0.2\n}\n")),
      board);
}

TEST(ReadBoard, RejectsMoreTagsThanFamilyHas) {
  const TemporaryFolder folder;
  // tag36h11 has the ids 0 to 586.
  const auto kalibr = [&](const std::string& rows, const std::string& offset) {
    return folder.file("target.yaml", changed(kKalibrTarget, "tagRows: 4", "tagRows: " + rows) +
                                          "codeOffset: " + offset + "\n");
  };
  EXPECT_EQ(read_board(kalibr("50", "337")).rows, 50);
  EXPECT_EQ(refusal(read_board, kalibr("50", "338")),
            "target.yaml:3: tagRows: a board of 250 tags from id 338 needs more than the 587 tags "
            "of tag36h11; correct cols, rows, or the first id");
  EXPECT_THAT(refusal_with("tag36h11", "tag16h5"),
              HasSubstr("board.yaml:4: rows: a board of 40 tags from id 1 needs more than the 30"));
}

TEST(ReadBoard, RejectsOtherKalibrTargetTypesAndWrongKeys) {
  const TemporaryFolder folder;
  const auto rejection_message = [&](const std::string& from, const std::string& to) {
    return refusal(read_board, folder.file("target.yaml", changed(kKalibrTarget, from, to)));
  };
  EXPECT_THAT(rejection_message("aprilgrid", "circlegrid"), HasSubstr("aprilgrid or checkerboard"));
  EXPECT_THAT(rejection_message("tagSize", "tagsize"), HasSubstr("key 'tagSize' is missing"));
  EXPECT_THAT(rejection_message("tagCols: 5", "tagCols: 0"), HasSubstr("tagCols"));
  EXPECT_THAT(rejection_message("#gridtype", "\nrowSpacingMeters: 1"),
              HasSubstr("'rowSpacingMeters'"));
}

Board squares(BoardKind kind) {
  Board board{"", 10, 7, 0, 1, 1, false, 0, {false, BoardCorner::top_left}};
  board.kind = kind;
  board.square_size_m = 0.03;
  return board;
}

constexpr const char* kCharuco =
    "format: vlp-board/1\nkind: charuco\ncols: 10\nrows: 7\nsquare_size_m: 0.03\n"
    "marker_size_m: 0.02\ndictionary: DICT_5X5_100\n";

TEST(ReadBoard, ReadsChessboardAndCharucoBoard) {
  const TemporaryFolder folder;
  const std::string chessboard =
      "format: vlp-board/1\nkind: chessboard\ncols: 10\nrows: 7\nsquare_size_m: 0.03\n";
  expect_same(read_board(folder.file("board.yaml", chessboard)), squares(BoardKind::chessboard));
  write_board(folder / "written.yaml", squares(BoardKind::chessboard));
  EXPECT_EQ(folder.read_content(folder / "written.yaml"), chessboard);

  Board charuco = squares(BoardKind::charuco);
  charuco.family = "DICT_5X5_100";
  charuco.tag_size_m = 0.02;
  expect_same(read_board(folder.file("board.yaml", kCharuco)), charuco);
  charuco.first_id = 5;
  charuco.top_left_white = true;
  const std::string all = std::string(kCharuco) + "first_id: 5\ntop_left: white\n";
  expect_same(read_board(folder.file("board.yaml", all)), charuco);
  write_board(folder / "written.yaml", charuco);
  EXPECT_EQ(folder.read_content(folder / "written.yaml"), all);
}

TEST(ReadBoard, RejectsInvalidValuesOfCharucoBoard) {
  const TemporaryFolder folder;
  const auto rejection_message = [&](const std::string& from, const std::string& to) {
    return refusal(read_board, folder.file("board.yaml", changed(kCharuco, from, to)));
  };
  EXPECT_THAT(rejection_message("charuco", "checkers"),
              HasSubstr("board.yaml:2: kind: 'checkers' is unknown; the kinds of boards are: "
                        "apriltags, chessboard, charuco"));
  EXPECT_THAT(rejection_message("charuco", "chessboard"), HasSubstr("'marker_size_m'"));
  EXPECT_THAT(rejection_message("rows: 7", "rows: 3"),
              HasSubstr("board.yaml:4: rows: should be a whole number within 4 and 50"));
  EXPECT_THAT(rejection_message("0.02", "0.03"), HasSubstr("smaller than the square around it"));
  EXPECT_THAT(rejection_message("DICT_5X5_100", "tag36h11"),
              HasSubstr("one of OpenCV's dictionaries"));
  EXPECT_THAT(rejection_message("dictionary", "top_left: red\ndictionary"),
              HasSubstr("top_left: 'red' is unknown; the colors of a square are: black, white"));
}

TEST(ReadBoard, ReadsKalibrCheckerboardWithEqualSpacingsOnly) {
  const TemporaryFolder folder;
  const std::string target =
      "target_type: 'checkerboard'\ntargetCols: 9\ntargetRows: 6\n"
      "rowSpacingMeters: 0.03\ncolSpacingMeters: 0.03\n";
  expect_same(read_board(folder.file("target.yaml", target)), squares(BoardKind::chessboard));
  EXPECT_THAT(refusal(read_board, folder.file("target.yaml", changed(target, "0.03", "0.031"))),
              HasSubstr("target.yaml:4: rowSpacingMeters: is not colSpacingMeters"));
}

TEST(WriteBoard, RoundTripsOneBorderBitWithoutCornerSquares) {
  Board board = sample_board();
  board.border_bits = 1;
  board.corner_squares = false;
  board.first_id = 0;
  board.family = "tagStandard41h12";
  const TemporaryFolder folder;
  write_board(folder / "board.yaml", board);
  expect_same(read_board(folder / "board.yaml"), board);
}

TEST(WriteBoard, RoundTripsPrintSdAndReadRejectsTooLargeOne) {
  const TemporaryFolder folder;
  const Board board = read_board(folder.file("board.yaml", kBoardYaml + "print_sd: 0.0002\n"));
  EXPECT_EQ(board.print_sd, 0.0002);
  write_board(folder / "written.yaml", board);
  EXPECT_EQ(read_board(folder / "written.yaml").print_sd, 0.0002);
  EXPECT_EQ(sample_board().print_sd, 0);
  EXPECT_THAT(refusal(read_board, folder.file("board.yaml", kBoardYaml + "print_sd: 0.2\n")),
              HasSubstr("print_sd: 0.2 (relative) is not within 0 and 0.02"));
}

TEST(ReadBoard, ReportsLineAndKeyOfMissingKey) {
  for (const std::string key : {"family", "cols", "rows", "tag_size_m", "tag_spacing",
                                "border_bits", "corner_squares", "first_id", "id_order"}) {
    const std::size_t begin = kBoardYaml.find("\n" + key + ":") + 1;
    const std::string line = kBoardYaml.substr(begin, kBoardYaml.find('\n', begin) + 1 - begin);
    EXPECT_THAT(refusal_with(line, ""),
                HasSubstr("board.yaml:1: key '" + key + "' is missing; the keys are: format, "));
  }
}

TEST(ReadBoard, ReportsLineAndKeyOfInvalidValue) {
  struct Refusal {
    std::string from, to, message;
  };
  for (const auto& [from, to, message] : std::vector<Refusal>{
           {"tag36h11", "tag36h12", "2: family: 'tag36h12' is unknown; the families are: tag36h11"},
           {"cols: 8", "cols: 0", "3: cols: should be a whole number within 1 and 50"},
           {"rows: 5", "rows: 4.5", "4: rows: should be a whole number within 1 and 50"},
           {"0.016", "16", "5: tag_size_m: 16 m is not within 0.0001 and 2 m"},
           {"0.016", "16 mm", "5: tag_size_m: should be a finite number"},
           {"tag_size_m: 0.016", "tag_size_m:", "5: tag_size_m: should be a finite number"},
           {"0.3", "30 %", "6: tag_spacing: should be a"},
           {"0.3", "0", "6: tag_spacing: 0 (gap / tag) is"},
           {"border_bits: 2", "border_bits: 3", "7: border_bits: should be a whole number within"},
           {"squares: true", "squares: yes", "8: corner_squares: should be true or false"},
           {"first_id: 1", "first_id: -1", "9: first_id: should be a whole number within 0 and"},
           {"column-major-from-top-left", "column-major",
            "10: id_order: 'column-major' is unknown; the orders are: row-major-from-bottom-left"},
           {"id_order: column-major-from-top-left", "id_order:", "10: id_order: should be text"}}) {
    EXPECT_THAT(refusal_with(from, to), testing::StartsWith("board.yaml:" + message)) << to;
  }
}

}  // namespace
}  // namespace vlp
