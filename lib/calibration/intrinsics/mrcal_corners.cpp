// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>
#include <string_view>
#include <unordered_map>

#include "calibration/intrinsics/board_lattice.h"
#include "calibration/intrinsics/mrcal_files.h"
#include "detection/boards/corner_table.h"
#include "detection/boards/lattice_order.h"
#include "rig/file.h"
#include "rig/input_error.h"
#include "rig/yaml_text.h"

namespace vlp {
namespace {

constexpr std::size_t kMaxCornerFileBytes = std::size_t{1} << 30;

/// Row of the file; without a pixel, the corner was not seen.
struct CornerRow {
  std::size_t line;
  std::string_view image;
  std::optional<Eigen::Vector2d> pixel;
  double weight;
};

std::vector<std::string_view> split_words(std::string_view line) {
  constexpr std::string_view blank = " \t\r";
  std::vector<std::string_view> words;
  for (auto from = line.find_first_not_of(blank); from != line.npos;) {
    const auto end = std::min(line.find_first_of(blank, from), line.size());
    words.push_back(line.substr(from, end - from));
    from = line.find_first_not_of(blank, end);
  }
  return words;
}

/// Reads the rows of a file.
class CornerTable {
 public:
  CornerTable(const std::filesystem::path& file, const std::array<int, 2>& imager_px)
      : file_(file), imager_px_(imager_px), text_(read_text_file(file, kMaxCornerFileBytes)) {
    std::size_t line = 0;
    for (std::size_t from = 0; from < text_.size();) {
      const std::size_t end = text_.find('\n', from);
      read(++line, std::string_view(text_).substr(from, end - from));
      from = end + 1;
    }
    if (rows.empty()) throw InputError(file, "contains no corner");
    if (are_too_many_corners_outside(num_outside_, num_seen_)) throw InputError(*first_outside_);
  }

  InputError error(std::size_t line, const std::string& problem) const {
    return {file_, line, "", problem};
  }

  std::vector<CornerRow> rows;

 private:
  void read(std::size_t line, std::string_view text) {
    const auto words = split_words(text);
    if (words.empty()) return;
    if (words[0].front() == '#') {
      // The first is the legend; "##" and "#!" are comments.
      if (legend_ || words[0].starts_with("##") || words[0].starts_with("#!")) return;
      legend_ = true;
      weights_ = words.back() == "weight";
      return;
    }
    if (words.size() < 3 || words.size() > 4) {
      throw error(line, "should be: filename x y level; is it mrcal's table of corners?");
    }
    CornerRow row{line, words[0], {}, 1};
    const auto x = parse_number(line, words[1]), y = parse_number(line, words[2]);
    const auto fourth = words.size() == 4 ? parse_number(line, words[3]) : 1;
    if (words.size() == 4) row.weight = parse_weight(line, fourth);
    if (x && y && *x >= 0 && *y >= 0 && row.weight > 0) {
      row.pixel = {*x, *y};
      const std::string outside = describe_corner_outside(*row.pixel, imager_px_);
      ++num_seen_;
      if (!outside.empty() && num_outside_++ == 0) first_outside_ = error(line, outside);
    }
    rows.push_back(row);
  }

  /// Parses a number; std::nullopt for "-".
  std::optional<double> parse_number(std::size_t line, std::string_view word) const {
    if (word == "-") return {};
    double value = 0;
    const auto [end, problem] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (problem != std::errc() || end != word.data() + word.size() || !std::isfinite(value)) {
      throw error(line,
                  quote_for_message(truncate_text(word, 40)) + " should be a finite number, or -");
    }
    return value;
  }

  /// Returns the weight of a corner; 0 if it was not seen.
  double parse_weight(std::size_t line, std::optional<double> fourth) const {
    constexpr double max_level = 30, max_weight = 1000;
    if (!fourth || *fourth < 0) return 0;
    if (weights_ && *fourth > max_weight) {
      throw error(line, fmt::format("a weight of {:.6g}: weights go up to 1000", *fourth));
    }
    if (weights_) return *fourth;
    if (*fourth > max_level) throw error(line, "a level should be within 0 and 30");
    return std::exp2(-std::floor(*fourth));
  }

  const std::filesystem::path& file_;
  const std::array<int, 2>& imager_px_;
  std::string text_;
  bool weights_ = false;
  bool legend_ = false;
  std::size_t num_seen_ = 0, num_outside_ = 0;
  std::optional<InputError> first_outside_;
};

/// Describes the numbers of corners of a board, for messages.
std::string describe_size(const Board& board, const BoardLattice& lattice) {
  return fmt::format("a board of {} x {} {} has {} x {} corners", board.cols, board.rows,
                     board.has_squares() ? "squares" : "tags", lattice.lattice_cols(),
                     lattice.lattice_rows());
}

std::string describe_wrong_count(const Board& board, const BoardLattice& lattice,
                                 std::size_t rows) {
  std::string words = fmt::format("{} rows, but {}", rows, describe_size(board, lattice));
  if (lattice.num_board_parts() > 1) words += " of each kind";
  if (board.has_squares() && rows == static_cast<std::size_t>(board.cols * board.rows)) {
    words += fmt::format(
        "; cols and rows of board.yaml count squares, not the corners between them: cols {}, rows "
        "{}",
        board.cols + 1, board.rows + 1);
  } else {
    words += "; is the file cut short, or of another board?";
  }
  return words;
}

/// Part of a board that an image of the table stands for, and the name of the image itself. An
/// image of a board of four parts occurs four times, with -corner0 to -corner3 appended to its
/// name.
struct PartOfImage {
  std::string image;
  std::size_t part;
};

PartOfImage parse_image_part(const BoardLattice& lattice, const CornerTable& table,
                             std::size_t line, std::string_view name) {
  PartOfImage found{std::string(name), 0};
  if (lattice.num_board_parts() == 1) return found;
  const auto ending = name.rfind("-corner");
  if (ending == name.npos || ending + 8 != name.size() || name.back() < '0' || name.back() > '3') {
    throw table.error(line,
                      "an image of a board whose gaps differ from its tag width needs four "
                      "entries, NAME-corner0 to NAME-corner3, as vlp-intrinsics writes them");
  }
  found.part = static_cast<std::size_t>(name.back() - '0');
  found.image.resize(ending);
  return found;
}

/// Throws InputError if the corners lie in rows of another length than that of the board.
void check_row_length(const Board& board, const BoardLattice& lattice, const CornerTable& table,
                      const std::vector<LatticePixels>& images, std::size_t first_line) {
  const auto stated = static_cast<std::size_t>(lattice.lattice_cols());
  const std::size_t found_cols = estimate_points_per_row(images, stated);
  if (found_cols == stated) return;
  const bool is_swapped = found_cols == static_cast<std::size_t>(lattice.lattice_rows());
  throw table.error(first_line, fmt::format("the corners lie in rows of {}, but {}{}", found_cols,
                                            describe_size(board, lattice),
                                            is_swapped ? "; swap cols and rows of board.yaml"
                                                       : "; is board.yaml that of the board?"));
}

}  // namespace

std::vector<BoardView> read_mrcal_corners(const std::filesystem::path& file, const Board& board,
                                          const std::array<int, 2>& imager_px) {
  const BoardLattice lattice(board);
  const CornerTable table(file, imager_px);
  std::vector<BoardView> views;
  std::set<std::string_view> known;
  std::unordered_map<std::string, std::size_t> view_of_image;
  std::vector<LatticePixels> images;
  std::size_t first_line = 0;  // of an image with corners
  for (std::size_t from = 0; from < table.rows.size();) {
    const auto [line, name, first_pixel, weight] = table.rows[from];
    std::size_t end = from + 1;
    while (end < table.rows.size() && table.rows[end].image == name) ++end;
    if (!known.insert(name).second) {
      throw table.error(line, fmt::format("image '{}' occurs twice", name));
    }
    const auto [image, part] = parse_image_part(lattice, table, line, name);
    const auto [entry, is_new] = view_of_image.try_emplace(image, views.size());
    if (is_new) views.push_back({image, imager_px, {}});
    BoardView& view = views[entry->second];
    const bool none = end == from + 1 && !first_pixel;
    if (!none && end - from != lattice.points_per_part()) {
      // [LENS-6] `image '...' has` | mrcal's table: a row for each corner, detected or not; one row
      //   with `-` without board | complete it
      throw table.error(line, fmt::format("image '{}' has {}", name,
                                          describe_wrong_count(board, lattice, end - from)));
    }
    for (std::size_t i = from; i < end; ++i) {
      if (!table.rows[i].pixel) continue;
      view.detection.points.push_back({lattice.board_point_index(part, i - from),
                                       *table.rows[i].pixel, 0, table.rows[i].weight});
    }
    if (!none) {
      if (images.empty()) first_line = line;
      images.emplace_back();
      for (std::size_t i = from; i < end; ++i) images.back().push_back(table.rows[i].pixel);
    }
    from = end;
  }
  if (images.empty()) return views;
  for (BoardView& view : views) {
    std::sort(view.detection.points.begin(), view.detection.points.end(),
              [](const PointDetection& a, const PointDetection& b) { return a.index < b.index; });
  }
  check_row_length(board, lattice, table, images, first_line);
  if (lattice.num_board_parts() == 1) {
    for (BoardView& view : views) {
      renumber_lattice(view.detection.points, lattice.lattice_cols(), lattice.lattice_rows(),
                       board.kind == BoardKind::chessboard);
    }
  }
  return views;
}

}  // namespace vlp
