// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-board: makes a printable calibration board.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <string>

#include "program/app.h"
#include "rig/board.h"
#include "rig/file.h"
#include "simulation/board_pdf.h"

namespace vlp {
namespace {

struct Options {
  std::string output, paper = "A4", family = "tag36h11", dictionary = "DICT_5X5_100";
  std::optional<int> cols, rows;
  int first_id = 0;
  std::optional<double> tag_mm, square_mm, spacing;
  double marker_to_square_ratio = 0.75;
  bool kalibr = false, chessboard = false, charuco = false;
};

constexpr double kMillimetersPerMeter = 1000;

Board make_board_of_squares(const Options& options) {
  constexpr int cols = 10, rows = 7;
  Board board{"", options.cols.value_or(cols),   options.rows.value_or(rows), 0, 1, 1, false,
              0,  {false, BoardCorner::top_left}};
  board.kind = options.charuco ? BoardKind::charuco : BoardKind::chessboard;
  board.square_size_m = options.square_mm.value_or(0) / kMillimetersPerMeter;
  if (!options.charuco) return board;
  board.family = options.dictionary;
  board.first_id = options.first_id;
  return board;
}

Board make_board(const Options& options) {
  if (options.chessboard || options.charuco) return make_board_of_squares(options);
  constexpr int cols = 6, rows = 5;
  constexpr double lattice = 1, kalibr = 0.3;
  const IdOrder order{false, options.kalibr ? BoardCorner::bottom_left : BoardCorner::top_left};
  return {options.family,
          options.cols.value_or(cols),
          options.rows.value_or(rows),
          options.tag_mm.value_or(0) / kMillimetersPerMeter,
          options.spacing.value_or(options.kalibr ? kalibr : lattice),
          options.kalibr ? 2 : 1,
          options.kalibr,
          options.first_id,
          order};
}

void run(const Options& options) {
  const bool squares = options.chessboard || options.charuco;
  if (squares && std::min(options.cols.value_or(kMinSquaresPerSide),
                          options.rows.value_or(kMinSquaresPerSide)) < kMinSquaresPerSide) {
    throw std::invalid_argument(fmt::format(
        "--cols, --rows: a board of squares needs at least {0} x {0} squares", kMinSquaresPerSide));
  }
  if (!squares && options.square_mm) {
    throw std::invalid_argument("--square-mm: only for --chessboard and --charuco; use --tag-mm");
  }
  const PageSize& paper = require_page_size(options.paper);
  Board board = make_board(options);
  if (board.has_squares() ? !options.square_mm : !options.tag_mm) {
    const auto largest_m = find_tag_size_m(board, paper);
    if (!largest_m) {
      throw std::invalid_argument(fmt::format(
          "--cols, --rows: {} x {} {} do not fit on {}; use fewer or a larger --paper", board.cols,
          board.rows, board.has_squares() ? "squares" : "tags", paper.name));
    }
    (board.has_squares() ? board.square_size_m : board.tag_size_m) = *largest_m;
  }
  if (options.charuco) {
    constexpr double um_per_m = 1e6;
    board.tag_size_m =
        std::round(options.marker_to_square_ratio * board.square_size_m * um_per_m) / um_per_m;
  }
  const std::string pdf = render_board_pdf(board, paper);
  const std::string yaml =
      std::filesystem::path(options.output).replace_extension(".yaml").string();
  write_file(options.output, pdf);
  write_board(yaml, board);
  if (board.has_squares()) {
    fmt::print("{}: {} x {} squares of {:g} mm, on {}\n", options.output, board.cols, board.rows,
               board.square_size_m * kMillimetersPerMeter, paper.name);
  } else {
    fmt::print("{}: {} x {} tags of {:g} mm, gap {:g} mm, on {}\n", options.output, board.cols,
               board.rows, board.tag_size_m * kMillimetersPerMeter,
               board.tag_size_m * board.tag_spacing * kMillimetersPerMeter, paper.name);
  }
  fmt::print("{}: for vlp-intrinsics; measure the ruler on the print first\n", yaml);
}

void add_options(CLI::App& app, Options& options) {
  app.add_option("-o,--output", options.output,
                 "Output file of the board, PDF. The board description has the same name with "
                 "extension .yaml")
      ->required()
      ->check(make_extension_validator(".pdf"));
  app.add_option("--paper", options.paper, "Paper size, A0 to A4 or Letter (default: A4)");
  app.add_option("--cols", options.cols,
                 "Number of tags or squares along the width (default: 6 tags or 10 squares)")
      ->check(CLI::Range(1, kMaxTagsPerSide));
  app.add_option("--rows", options.rows,
                 "Number of tags or squares along the height (default: 5 tags or 7 squares)")
      ->check(CLI::Range(1, kMaxTagsPerSide));
  auto* tag_mm = app.add_option("--tag-mm", options.tag_mm,
                                "Width of a tag including its black border, in mm (default: "
                                "largest that fits on the paper)")
                     ->check(CLI::Range(1.0, 1000.0));
  auto* spacing =
      app.add_option(
             "--spacing", options.spacing,
             "Gap between tags as a fraction of the tag width (default: 1; with --kalibr 0.3)")
          ->check(CLI::Range(0.05, 5.0));
  auto* family = app.add_option("--family", options.family, "Tag family (default: tag36h11)")
                     ->check(CLI::IsMember({"tag36h11", "tag25h9", "tag16h5", "tagCircle21h7",
                                            "tagCircle49h12", "tagCustom48h12", "tagStandard41h12",
                                            "tagStandard52h13"}));
  auto* first_id =
      app.add_option("--first-id", options.first_id, "Id of the first tag or marker (default: 0)")
          ->check(CLI::Range(0, 100000));
  auto* kalibr = app.add_flag(
      "--kalibr", options.kalibr,
      "Make a Kalibr AprilGrid: black borders two bits wide, squares at the tag corners");
  auto* chessboard =
      app.add_flag("--chessboard", options.chessboard, "Make a chessboard")->excludes(kalibr);
  auto* charuco =
      app.add_flag("--charuco", options.charuco,
                   "Make a ChArUco board of OpenCV: chessboard with a marker in each white square")
          ->excludes(kalibr)
          ->excludes(chessboard);
  for (CLI::Option* of_tags : {tag_mm, spacing, family}) {
    of_tags->excludes(chessboard)->excludes(charuco);
  }
  first_id->excludes(chessboard);
  app.add_option("--square-mm", options.square_mm,
                 "Width of a square, in mm (default: largest that fits on the paper)")
      ->check(CLI::Range(1.0, 1000.0));
  app.add_option("--dictionary", options.dictionary,
                 "OpenCV dictionary of the markers (default: DICT_5X5_100)")
      ->needs(charuco);
  app.add_option("--marker-to-square-ratio", options.marker_to_square_ratio,
                 "Marker width as a fraction of the square width (default: 0.75)")
      ->check(CLI::Range(0.3, 0.9))
      ->needs(charuco);
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  const auto parser = vlp::make_app(
      "Creates a printable calibration board of AprilTags, squares (chessboard) or both (ChArUco, "
      "with markers of an OpenCV dictionary). Also writes its description, board.yaml, for "
      "vlp-intrinsics. Print the board at 100 %, measure the ruler on the print, and mount it on a "
      "flat surface.\n\n"
      "Examples:\n"
      "  build/bin/vlp-board -o board.pdf\n"
      "  build/bin/vlp-board --kalibr --cols 6 --rows 6 --paper A3 -o board.pdf\n",
      "vlp-board");
  CLI::App& app = *parser;
  vlp::Options options;
  vlp::add_options(app, options);
  return vlp::parse_and_run(app, argc, argv, [&] { vlp::run(options); });
}
